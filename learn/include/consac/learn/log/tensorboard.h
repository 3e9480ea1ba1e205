#pragma once
// TensorBoard event files, written without TensorFlow: framed protobuf records of scalars. One file per process; a
// resumed run adds a file to the same folder, whose first records tell TensorBoard which steps are being repeated.
// Sources: tensorboard's event.proto and summary.proto; TensorFlow's record_writer.cc for the framing.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "consac/base/status.h"
#include "consac/learn/log/output_file.h"

namespace consac::learn {

/// Seconds since 1970, which events say they happened at.
double WallTime();
/// CRC-32C, rotated and offset, as it stands in event files.
std::uint32_t MaskedCrc(std::string_view bytes);
/// The record of `payload`, of less than 500 bytes: length, its checksum, payload, its checksum.
std::string FrameRecord(std::string_view payload);
/// The payload that opens every event file.
std::string VersionEvent(double wall_time);
/// The payload that makes TensorBoard forget this folder's events from `first_step` on.
std::string RestartEvent(double wall_time, std::int64_t first_step);

/// What every event file's name begins with.
inline constexpr std::string_view kEventFile = "events.out.tfevents.";
/// A name that no other process' has: "events.out.tfevents.1700000000.HOST.NUMBER.0". TensorBoard reads a folder's
/// files in the order of their names.
std::string EventFileName(std::int64_t second);

/// An event file being written.
class EventWriter {
 public:
  /// Starts the file `path`. `wall_time` in seconds since 1970.
  static Result<std::unique_ptr<EventWriter>> Open(const std::string& path, double wall_time);

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

}  // namespace consac::learn
