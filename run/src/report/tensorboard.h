#pragma once
// TensorBoard event files: framed, checksummed protobuf records, written by hand for scalars. Private to run.
// Source: TensorFlow's record format; tensorboard/compat/proto/{event,summary}.proto.

#include <cstdint>
#include <string>
#include <string_view>

#include "consac/base/status.h"
#include "report/text_files.h"

namespace consac::run {

/// One record with its length and masked CRC-32C checks.
std::string FrameRecord(std::string_view payload);
/// An Event payload that names the file version.
std::string VersionEvent(double wall_time);
/// An Event payload with one scalar.
std::string ScalarEvent(double wall_time, std::int64_t step, std::string_view tag, float value);

/// One event file in a folder; a resumed run adds another file to the same folder.
class TensorBoardFile {
 public:
  /// Makes folder/events.out.tfevents.<seconds>.<host>.<pid>.<number>.
  Status Open(const std::string& folder);
  /// One scalar at a step. NaN is written too; TensorBoard shows it as a gap.
  void Scalar(std::int64_t step, std::string_view tag, double value);
  /// Pushes what was written to the system.
  void Flush() { file_.Flush(); }
  /// The first failure.
  const Status& status() const { return file_.status(); }

 private:
  LineFile file_;
};

/// "PPO2_1": the first free number, as Stable Baselines names its runs; the last one when `again`.
std::string TensorBoardFolder(const std::string& parent, const std::string& algorithm, bool again);

}  // namespace consac::run
