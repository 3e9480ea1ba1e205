#include "report/tensorboard.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <cstring>
#include <filesystem>

#include "consac/base/hash.h"

namespace consac::run {
namespace {

// Protobuf wire types.
constexpr unsigned kVarint = 0, kFixed64 = 1, kLengthDelimited = 2, kFixed32 = 5;

void PutVarint(std::uint64_t value, std::string& out) {
  for (; value >= 0x80; value >>= 7) out += static_cast<char>((value & 0x7f) | 0x80);
  out += static_cast<char>(value);
}

void PutTag(unsigned field, unsigned wire_type, std::string& out) { PutVarint(field << 3 | wire_type, out); }

template <class T>
void PutFixed(T value, std::string& out) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out.append(bytes, sizeof(T));
}

void PutText(unsigned field, std::string_view text, std::string& out) {
  PutTag(field, kLengthDelimited, out);
  PutVarint(text.size(), out);
  out += text;
}

std::uint32_t MaskedCrc(std::string_view bytes) {
  return std::rotr(Crc32c(std::as_bytes(std::span(bytes))), 15) + 0xA282EAD8u;
}

double WallTime() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

std::string EventHeader(double wall_time) {
  std::string event;
  PutTag(1, kFixed64, event);
  PutFixed(wall_time, event);
  return event;
}

}  // namespace

std::string FrameRecord(std::string_view payload) {
  std::string out;
  PutFixed(static_cast<std::uint64_t>(payload.size()), out);
  PutFixed(MaskedCrc(out), out);
  out += payload;
  PutFixed(MaskedCrc(payload), out);
  return out;
}

std::string VersionEvent(double wall_time) {
  std::string event = EventHeader(wall_time);
  PutText(3, "brain.Event:2", event);
  return event;
}

std::string ScalarEvent(double wall_time, std::int64_t step, std::string_view tag, float value) {
  std::string entry;
  PutText(1, tag, entry);
  PutTag(2, kFixed32, entry);
  PutFixed(value, entry);
  std::string summary;
  PutText(1, entry, summary);
  std::string event = EventHeader(wall_time);
  PutTag(2, kVarint, event);
  PutVarint(static_cast<std::uint64_t>(step), event);
  PutText(5, summary, event);
  return event;
}

Status TensorBoardFile::Open(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return {StatusCode::kUnavailable, "cannot make folder '" + folder + "': " + error.message()};
  char host[256] = "localhost";
  (void)gethostname(host, sizeof(host) - 1);
  static std::atomic<int> number{0};
  const double now = WallTime();
  CONSAC_RETURN_IF_ERROR(file_.Open(fmt::format("{}/events.out.tfevents.{:010d}.{}.{}.{}", folder, static_cast<std::int64_t>(now), host, getpid(), number++), false));
  file_.Write(FrameRecord(VersionEvent(now)));
  return Status::Ok();
}

void TensorBoardFile::Scalar(std::int64_t step, std::string_view tag, double value) {
  if (!file_.is_open()) return;
  file_.Write(FrameRecord(ScalarEvent(WallTime(), step, tag, static_cast<float>(value))));
}

std::string TensorBoardFolder(const std::string& parent, const std::string& algorithm, bool again) {
  std::string name;
  for (const char c : algorithm) name += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  std::error_code ignored;
  int number = 1;
  while (std::filesystem::exists(fmt::format("{}/{}_{}", parent, name, number), ignored)) ++number;
  return fmt::format("{}/{}_{}", parent, name, again && number > 1 ? number - 1 : number);
}

}  // namespace consac::run
