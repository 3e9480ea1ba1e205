#include "report/tensorboard.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <iterator>
#include <span>
#include <system_error>

#include "consac/base/hash.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "system/system.h"

namespace consac::run {
namespace {

constexpr std::size_t kLongestTag = 200;
constexpr std::size_t kFrameBytes = 16;

// Appends protobuf fields to a buffer whose inline room is enough for any record written here.
class ProtoText {
 public:
  void Fixed32(std::uint32_t bits) {
    for (int shift = 0; shift < 32; shift += 8) bytes_.push_back(static_cast<char>(bits >> shift));
  }
  void Fixed64(std::uint64_t bits) {
    for (int shift = 0; shift < 64; shift += 8) bytes_.push_back(static_cast<char>(bits >> shift));
  }
  void Varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<char>(value | 0x80));
    bytes_.push_back(static_cast<char>(value));
  }
  void DoubleField(int field, double value) {
    Varint(static_cast<std::uint64_t>(field << 3 | 1));
    Fixed64(std::bit_cast<std::uint64_t>(value));
  }
  void VarintField(int field, std::uint64_t value) {
    Varint(static_cast<std::uint64_t>(field << 3));
    Varint(value);
  }
  void FloatField(int field, float value) {
    Varint(static_cast<std::uint64_t>(field << 3 | 5));
    Fixed32(std::bit_cast<std::uint32_t>(value));
  }
  void BytesField(int field, std::string_view value) {
    Varint(static_cast<std::uint64_t>(field << 3 | 2));
    Varint(value.size());
    bytes_.append(value);
  }
  std::string_view view() const { return {bytes_.data(), bytes_.size()}; }

 private:
  fmt::memory_buffer bytes_;
};

// The head of a frame; the tail is the masked checksum of the payload.
void AppendFrame(std::string_view payload, ProtoText* out, fmt::memory_buffer* record) {
  out->Fixed64(payload.size());
  out->Fixed32(MaskedCrc(out->view()));
  record->append(out->view());
  record->append(payload);
  ProtoText tail;
  tail.Fixed32(MaskedCrc(payload));
  record->append(tail.view());
}

std::string HostInFileName() {
  std::string host = HostName();
  std::replace_if(
      host.begin(), host.end(), [](unsigned char c) { return std::isalnum(c) == 0 && c != '-'; }, '_');
  return host;
}

// The largest number after `prefix` among the names in `folder`, up to a dot or the end; 0 without one.
std::int64_t LargestNumber(const std::string& folder, const std::string& prefix) {
  std::int64_t largest = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator it(ToPath(folder), error), end; !error && it != end; it.increment(error)) {
    std::string name = FromPath(it->path().filename());
    if (!name.starts_with(prefix)) continue;
    name = name.substr(prefix.size());
    std::int64_t number = 0;
    if (ParseNumber(std::string_view(name).substr(0, name.find('.')), &number)) largest = std::max(largest, number);
  }
  return largest;
}

}  // namespace

std::uint32_t MaskedCrc(std::string_view bytes) {
  return std::rotr(Crc32c(std::as_bytes(std::span(bytes))), 15) + 0xA282EAD8u;
}

std::string FrameRecord(std::string_view payload) {
  ProtoText head;
  fmt::memory_buffer record;
  AppendFrame(payload, &head, &record);
  return fmt::to_string(record);
}

std::string VersionEvent(double wall_time) {
  ProtoText event;
  event.DoubleField(1, wall_time);
  event.BytesField(3, "brain.Event:2");
  return std::string(event.view());
}

std::string RestartEvent(double wall_time, std::int64_t first_step) {
  ProtoText session_log, event;
  session_log.VarintField(1, 1);  // SessionLog.status = START
  event.DoubleField(1, wall_time);
  event.VarintField(2, static_cast<std::uint64_t>(first_step));
  event.BytesField(7, session_log.view());
  return std::string(event.view());
}

Result<std::string> TensorboardFolder(const std::string& root, const std::string& algorithm, OpenMode mode) {
  std::string prefix = algorithm + "_";
  std::transform(prefix.begin(), prefix.end(), prefix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const std::int64_t latest = LargestNumber(root, prefix);
  const std::int64_t number = mode == OpenMode::kAppend ? std::max<std::int64_t>(latest, 1) : latest + 1;
  std::string folder = fmt::format("{}/{}{}", root, prefix, number);
  std::error_code error;
  std::filesystem::create_directories(ToPath(folder), error);
  if (error) return Status{StatusCode::kDataLoss, "cannot make the folder '" + folder + "': " + error.message()};
  return folder;
}

Result<std::unique_ptr<EventWriter>> EventWriter::Open(const std::string& folder, double wall_time) {
  // TensorBoard reads a folder's files in the order of their names, so a resume within a second still comes later.
  const std::string prefix = "events.out.tfevents.";
  const std::int64_t second =
      std::max(static_cast<std::int64_t>(std::floor(wall_time)), LargestNumber(folder, prefix) + 1);
  const std::string path = fmt::format("{}/{}{:010}.{}.{}.0", folder, prefix, second, HostInFileName(), ProcessId());
  Result<std::unique_ptr<OutputFile>> file = OutputFile::Open(path, OpenMode::kTruncate);
  if (!file.ok()) return file.status();
  (*file)->Append(FrameRecord(VersionEvent(wall_time)));
  (*file)->Flush();
  return std::unique_ptr<EventWriter>(new EventWriter(std::move(*file)));
}

EventWriter::~EventWriter() {
  const std::string path = file_->path();
  file_.reset();
  std::error_code ignored;
  if (empty_) std::filesystem::remove(ToPath(path), ignored);
}

void EventWriter::Restart(double wall_time, std::int64_t first_step) {
  file_->Append(FrameRecord(RestartEvent(wall_time, first_step)));
}

void EventWriter::Scalar(double wall_time, std::int64_t step, std::string_view tag, double value) {
  static_assert(kLongestTag + kFrameBytes + 64 < fmt::inline_buffer_size, "a record must fit without allocation");
  empty_ = false;
  ProtoText scalar, summary, event, head;
  scalar.BytesField(1, tag.substr(0, kLongestTag));
  scalar.FloatField(2, static_cast<float>(value));
  summary.BytesField(1, scalar.view());
  event.DoubleField(1, wall_time);
  event.VarintField(2, static_cast<std::uint64_t>(step));
  event.BytesField(5, summary.view());
  fmt::memory_buffer record;
  AppendFrame(event.view(), &head, &record);
  file_->Append({record.data(), record.size()});
}

}  // namespace consac::run
