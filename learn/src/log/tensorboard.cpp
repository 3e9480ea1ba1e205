#include "consac/learn/log/tensorboard.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <chrono>
#include <cstring>
#include <span>

#include "consac/base/file.h"
#include "consac/base/hash.h"
#include "consac/base/hooks.h"
#include "log/system.h"

namespace consac::learn {
namespace {

constexpr std::size_t kLongestTag = 200;
constexpr std::size_t kFrameBytes = 16;
constexpr std::size_t kRecordRoom = 512;

// Bytes in room that is enough for any record written here; what more comes is a mistake, and is left out.
class RecordBytes {
 public:
  void push_back(char byte) { append({&byte, 1}); }
  void append(std::string_view bytes) {
    CONSAC_ASSERT(bytes.size() <= kRecordRoom - size_);
    bytes = bytes.substr(0, kRecordRoom - size_);
    std::memcpy(bytes_ + size_, bytes.data(), bytes.size());
    size_ += bytes.size();
  }
  std::string_view view() const { return {bytes_, size_}; }

 private:
  char bytes_[kRecordRoom];
  std::size_t size_ = 0;
};

// Appends protobuf fields.
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
  std::string_view view() const { return bytes_.view(); }

 private:
  RecordBytes bytes_;
};

// The head of a frame; the tail is the masked checksum of the payload.
void AppendFrame(std::string_view payload, ProtoText* out, RecordBytes* record) {
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

}  // namespace

double WallTime() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::uint32_t MaskedCrc(std::string_view bytes) {
  return std::rotr(Crc32c(std::as_bytes(std::span(bytes))), 15) + 0xA282EAD8u;
}

std::string FrameRecord(std::string_view payload) {
  ProtoText head;
  RecordBytes record;
  AppendFrame(payload, &head, &record);
  return std::string(record.view());
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

std::string EventFileName(std::int64_t second) {
  const std::string digits = std::to_string(second);
  return std::string(kEventFile) + std::string(digits.size() < 10 ? 10 - digits.size() : 0, '0') + digits + "." +
         HostInFileName() + "." + std::to_string(ProcessId()) + ".0";
}

Result<std::unique_ptr<EventWriter>> EventWriter::Open(const std::string& path, double wall_time) {
  Result<std::unique_ptr<OutputFile>> file = OutputFile::Open(path, OpenMode::kTruncate);
  if (!file.ok()) return file.status();
  (*file)->Append(FrameRecord(VersionEvent(wall_time)));
  (*file)->Flush();
  return std::unique_ptr<EventWriter>(new EventWriter(std::move(*file)));
}

EventWriter::~EventWriter() {
  const std::string path = file_->path();
  file_.reset();
  if (empty_) RemoveFile(path);
}

void EventWriter::Restart(double wall_time, std::int64_t first_step) {
  file_->Append(FrameRecord(RestartEvent(wall_time, first_step)));
}

void EventWriter::Scalar(double wall_time, std::int64_t step, std::string_view tag, double value) {
  static_assert(kLongestTag + kFrameBytes + 64 < kRecordRoom, "a record must fit");
  empty_ = false;
  ProtoText scalar, summary, event, head;
  scalar.BytesField(1, tag.substr(0, kLongestTag));
  scalar.FloatField(2, static_cast<float>(value));
  summary.BytesField(1, scalar.view());
  event.DoubleField(1, wall_time);
  event.VarintField(2, static_cast<std::uint64_t>(step));
  event.BytesField(5, summary.view());
  RecordBytes record;
  AppendFrame(event.view(), &head, &record);
  file_->Append(record.view());
}

}  // namespace consac::learn
