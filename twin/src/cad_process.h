#pragma once
// The program consac-cad, run as a child under limits, and what it wrote. Private to twin.

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "consac/base/status.h"
#include "consac/twin/import.h"

namespace consac::twin {

/// What consac-cad wrote: bytes that are in no folder and gone with this object.
class CadOutput {
 public:
  CadOutput() = default;
  ~CadOutput();
  CadOutput(const CadOutput&) = delete;
  CadOutput& operator=(const CadOutput&) = delete;
  /// All of it.
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  friend Result<std::shared_ptr<CadOutput>> RunCadProgram(const std::string&, const CadOptions&, const ImportProgress&);
  std::span<const std::byte> bytes_;
};

/// Lets consac-cad read `path`. kUnavailable where there is no such program, kDataLoss with its own line where it
/// cannot read the file or crashes, kDeadlineExceeded and kResourceExhausted where it meets its limits, kCancelled
/// where `progress` says so. Nothing is left of it then.
Result<std::shared_ptr<CadOutput>> RunCadProgram(const std::string& path, const CadOptions& options,
                                                 const ImportProgress& progress);

}  // namespace consac::twin
