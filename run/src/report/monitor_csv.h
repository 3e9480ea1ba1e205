#pragma once
// monitor.csv: one line per episode in the format of Stable Baselines' Monitor, for its load_results and for plots:
//   #{"t_start":1700000000.25,"env_id":"road-v0"}
//   r,l,t
//   21.0,104,0.518204
// Source: Stable Baselines 2.10.2, bench/monitor.py.

#include <cstdint>
#include <memory>
#include <string>

#include "consac/base/archive.h"
#include "consac/base/status.h"
#include "consac/learn/log/output_file.h"

namespace consac::run {

/// The file.
class MonitorCsv {
 public:
  /// Makes or continues `path`; `start_time` is in seconds since 1970.
  static Result<std::unique_ptr<MonitorCsv>> Open(const std::string& path, const std::string& world_id,
                                                  double start_time, learn::OpenMode mode);
  /// Adds an episode: reward, steps, seconds since the run began. Never allocates.
  void Append(double reward, std::int64_t length, double seconds);
  /// Hands buffered rows to the system.
  void Flush() { file_->Flush(); }
  /// The first failed write.
  const Status& status() const { return file_->status(); }
  /// The file's length: loading it drops the episodes that came after the checkpoint.
  void Visit(Archive& archive);

 private:
  explicit MonitorCsv(std::unique_ptr<learn::OutputFile> file) : file_(std::move(file)) {}
  std::unique_ptr<learn::OutputFile> file_;
};

}  // namespace consac::run
