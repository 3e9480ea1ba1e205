#pragma once
// The CSV sinks: progress.csv (a row per update) and Monitor's monitor.csv (a row per episode). Private to run.

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "consac/base/status.h"
#include "report/table.h"

namespace consac::run {

/// A file that is written line by line. A failed write is remembered once and further ones are dropped.
class LineFile {
 public:
  LineFile() = default;
  ~LineFile();
  LineFile(const LineFile&) = delete;
  LineFile& operator=(const LineFile&) = delete;
  /// Opens for writing, or for going on at the end.
  Status Open(const std::string& path, bool append);
  /// Writes a text as it is.
  void Write(std::string_view text);
  /// Pushes what was written to the system.
  void Flush();
  /// The first failure; ok while there is none.
  const Status& status() const { return status_; }
  /// True once open.
  bool is_open() const { return file_ != nullptr; }

 private:
  std::string path_;
  std::FILE* file_ = nullptr;
  Status status_;
};

/// progress.csv: the table's keys as columns. New keys become new columns, for which the file is written again.
class ProgressCsv {
 public:
  /// Opens; with append, keeps the rows whose step column is at most `last_step`.
  Status Open(const std::string& path, const std::string& step_key, bool append, std::int64_t last_step);
  /// One row.
  void Add(const Cells& cells);
  /// The first failure.
  const Status& status() const { return file_.status(); }
  /// Pushes what was written to the system.
  void Flush() { file_.Flush(); }

 private:
  void Rewrite();
  std::string path_;
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;  // kept to add columns; a few hundred bytes per update
  LineFile file_;
};

/// Drops the lines of a Monitor file past `rows` episodes, of a run that was killed after its last checkpoint.
Status TruncateMonitor(const std::string& path, std::int64_t rows);

}  // namespace consac::run
