#pragma once
// progress.csv: the table's rows for tools. The first row fixes the columns, a new key adds one on the right (the
// earlier rows are then empty there), as in Stable Baselines. A resumed run drops the rows that it is about to repeat.

#include <memory>
#include <string>
#include <vector>

#include "consac/base/status.h"
#include "consac/learn/log/output_file.h"
#include "consac/learn/log/row.h"

namespace consac::learn {

/// The file. Every row is written at once.
class ProgressCsv {
 public:
  /// What of an existing file stays.
  struct Resume {
    bool append = false;         ///< false: none of it
    std::string step_column;     ///< rows whose number here ...
    std::int64_t last_step = 0;  ///< ... is larger are dropped
  };
  /// Makes or continues `path`.
  static Result<std::unique_ptr<ProgressCsv>> Open(const std::string& path, const Resume& resume);

  /// Adds a row.
  void Append(const Row& row);
  /// The first failed write.
  const Status& status() const { return file_->status().ok() ? status_ : file_->status(); }

 private:
  ProgressCsv(std::vector<std::string> columns, std::unique_ptr<OutputFile> file);
  bool AddColumns(const Row& row);

  std::vector<std::string> columns_;
  std::unique_ptr<OutputFile> file_;
  Status status_;  // of rewriting
};

}  // namespace consac::learn
