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

}  // namespace
}  // namespace consac::protocol2
