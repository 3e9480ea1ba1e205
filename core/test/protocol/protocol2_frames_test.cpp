// Runs spec/conformance/protocol2/frames.json through the reader: whole, and cut at every byte.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "consac/protocol/protocol2.h"

namespace consac::protocol2 {
namespace {

using nlohmann::json;

std::string Bytes(const std::string& hex) {
  std::string bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2) bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return bytes;
}

std::string Hex(std::span<const std::byte> bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (const std::byte byte : bytes) {
    hex += kDigits[std::to_integer<int>(byte) >> 4];
    hex += kDigits[std::to_integer<int>(byte) & 15];
  }
  return hex;
}

json Read(const std::string& stream, std::size_t cut, std::size_t limit) {
  FrameReader reader(limit);
  json events = json::array();
  for (const std::string_view piece : {std::string_view(stream).substr(0, cut), std::string_view(stream).substr(cut)}) {
    std::copy_n(reinterpret_cast<const std::byte*>(piece.data()), piece.size(), reader.Writable().data());
    reader.Commit(piece.size());
    while (true) {
      Frame frame;
      const Result<bool> whole = reader.Next(&frame);
      if (!whole.ok()) {
        events.push_back({{"error", FaultName(whole.status())}});
        return events;
      }
      if (!*whole) break;
      events.push_back({{"type", static_cast<int>(frame.header.type)},
                        {"request", frame.header.request},
                        {"session", frame.header.session},
                        {"payload", Hex(frame.payload)}});
    }
  }
  return events;
}

TEST(Protocol2Frames, ConformanceCasesHoldWhereverTheStreamIsCut) {
  std::ifstream file(std::string(CONSAC_SOURCE_DIR) + "/spec/conformance/protocol2/frames.json");
  ASSERT_TRUE(file.good());
  const json cases = json::parse(file);
  ASSERT_GE(cases.size(), 15u);
  for (const json& entry : cases) {
    const std::string stream = Bytes(entry["hex"]);
    for (std::size_t cut = 0; cut <= stream.size(); ++cut)
      ASSERT_EQ(Read(stream, cut, entry["limit"]), entry["expect"]) << entry["name"] << ", cut at " << cut;
  }
}

/// Feeds `bytes` of a frame of `whole` bytes; the most that the reader held.
std::size_t Feed(FrameReader& reader, std::size_t whole, std::size_t bytes) {
  std::vector<std::byte> stream(bytes);
  WriteHeader({FrameType::kStep, false, static_cast<std::uint32_t>(whole - kHeaderBytes), 0, 1, 0}, stream.data());
  std::size_t most = 0;
  for (std::size_t at = 0; at < bytes;) {
    const std::span<std::byte> room = reader.Writable();
    const std::size_t count = std::min(room.size(), bytes - at);
    EXPECT_GT(count, 0u);
    std::copy_n(stream.data() + at, count, room.data());
    reader.Commit(count);
    at += count;
    Frame frame;
    for (auto next = reader.Next(&frame); next.ok() && *next; next = reader.Next(&frame)) {
    }
    most = std::max(most, reader.capacity());
  }
  return most;
}

TEST(Protocol2Frames, HoldWhatHasComeAndGiveItBack) {
  constexpr std::size_t kKibi = 1024, kLong = kLargestFrame, kShort = 100;
  FrameReader reader(kLargestFrame);
  EXPECT_EQ(Feed(reader, kShort, kShort), 64 * kKibi);
  for (const std::size_t come : {kHeaderBytes, 64 * kKibi, 1024 * kKibi, kLong / 2, kLong - 1}) {
    FrameReader greedy(kLargestFrame);
    const std::size_t held = Feed(greedy, kLong, come);
    EXPECT_LE(held, std::max(64 * kKibi, std::min(2 * come, kLong) + 16 * kKibi)) << come;
  }
  EXPECT_LE(Feed(reader, kLong, kLong), kLong + 16 * kKibi);
  for (int i = 0; i < 64; ++i) (void)Feed(reader, kShort, kShort);
  EXPECT_LE(reader.capacity(), 128 * kKibi) << "after short frames nothing is left of the long one";
}

TEST(Protocol2Frames, LongFramesInARowTakeMemoryOnce) {
  constexpr std::size_t kLong = std::size_t{1} << 20;
  FrameReader reader(kLargestFrame);
  (void)Feed(reader, kLong, kLong);
  const std::byte* at = reader.Writable().data();
  for (int i = 0; i < 10; ++i) {
    (void)Feed(reader, kLong, kLong);
    EXPECT_EQ(reader.Writable().data(), at);
  }
}

}  // namespace
}  // namespace consac::protocol2
