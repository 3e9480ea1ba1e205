#pragma once
// TensorBoard event files, written without TensorFlow: framed protobuf records of scalars. One file per process; a
// resumed run adds a file to the same folder, whose first records tell TensorBoard which steps are being repeated.
// Sources: tensorboard's event.proto and summary.proto; TensorFlow's record_writer.cc for the framing.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "consac/base/status.h"
#include "report/output_file.h"

namespace consac::run {

/// CRC-32C, rotated and offset, as it stands in event files.
std::uint32_t MaskedCrc(std::string_view bytes);
/// The record of `payload`: length, its checksum, payload, its checksum.
std::string FrameRecord(std::string_view payload);
/// The payload that opens every event file.
std::string VersionEvent(double wall_time);
/// The payload that makes TensorBoard forget this folder's events from `first_step` on.
std::string RestartEvent(double wall_time, std::int64_t first_step);

/// The folder of a run as Stable Baselines names it, made when missing: root/PPO2_1. A resumed run gets the latest
/// that exists, a new one the number after it.
Result<std::string> TensorboardFolder(const std::string& root, const std::string& algorithm, OpenMode mode);

/// An event file being written.
class EventWriter {
 public:
  /// Starts a file in `folder`. `wall_time` in seconds since 1970.
  static Result<std::unique_ptr<EventWriter>> Open(const std::string& folder, double wall_time);

  /// Closes the file; one that no number was added to goes, as of a run that could not begin or be gone on with.
  ~EventWriter();
  EventWriter(const EventWriter&) = delete;
  EventWriter& operator=(const EventWriter&) = delete;

  /// Says that steps from `first_step` on are written again.
  void Restart(double wall_time, std::int64_t first_step);
  /// Adds a number under `tag` (at most 200 characters count) at `step`. Never allocates.
  void Scalar(double wall_time, std::int64_t step, std::string_view tag, double value);
  /// Hands buffered records to the system.
  void Flush() { file_->Flush(); }
  /// The first failed write.
  const Status& status() const { return file_->status(); }
  /// Where it writes.
  const std::string& path() const { return file_->path(); }

 private:
  explicit EventWriter(std::unique_ptr<OutputFile> file) : file_(std::move(file)) {}
  std::unique_ptr<OutputFile> file_;
  bool empty_ = true;
};

}  // namespace consac::run
