#pragma once
// Candidates that are picked on the page of `consac twin view`: what it is told of a CAD file, and the one file of
// hints that it may write, the one named by --hints.

#include <string>
#include <string_view>

#include "consac/base/status.h"

namespace consac::cli {

/// Of one CAD file that is shown.
class TwinHints {
 public:
  /// `path`: the file of hints; "" none was named, and nothing is saved. A token is made, which whoever saves must
  /// know.
  explicit TwinHints(std::string path);
  /// JSON for the page: "candidates" as candidates.json has them, the "hints" so far, "file", "token" and "version" to
  /// save by; instead of those two an "error" where the file cannot be read.
  std::string Text(std::string_view candidates) const;
  /// The hints of a request {"token": ..., "version": ..., "hints": {...}} as a file's text. kFailedPrecondition
  /// without the token, or where the file is not the one that the page has read; kInvalidArgument where they are no
  /// hints.
  Result<std::string> Asked(std::string_view body) const;
  /// Writes them.
  Status Save(const std::string& hints) const;

 private:
  Result<std::string> Written() const;  // the file; "" where there is none

  std::string path_, token_;
};

}  // namespace consac::cli
