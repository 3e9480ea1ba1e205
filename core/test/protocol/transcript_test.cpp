// Runs the golden transcripts of spec/conformance/text1 through the framer: in their pieces, cut at every byte, joined.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "consac/protocol/text1.h"

namespace consac::text1 {
namespace {

using nlohmann::json;

Framer MakeFramer(const json& entry) {
  Framer framer;
  const std::string expect = entry["expect"];
  framer.SetExpect(expect == "setup"    ? Framer::Expect::kSetup
                   : expect == "action" ? Framer::Expect::kAction
                                        : Framer::Expect::kObservation,
                   entry.value("single_character", false));
  return framer;
}

void Drain(Framer& framer, std::vector<std::string>& messages) {
  for (std::string_view message = framer.Next(); !message.empty(); message = framer.Next())
    messages.emplace_back(message);
}

void Feed(Framer& framer, std::string_view bytes, std::size_t piece, std::vector<std::string>& messages) {
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const std::string_view part = bytes.substr(at, piece);
    std::memcpy(framer.Writable().data(), part.data(), part.size());
    ASSERT_TRUE(framer.Commit(part.size()).ok());
    Drain(framer, messages);
  }
}

std::vector<std::string> RunInPieces(const json& entry, std::size_t piece) {
  Framer framer = MakeFramer(entry);
  std::vector<std::string> messages;
  for (const std::string chunk : entry["chunks"]) {
    if (chunk == "quiet") {
      const std::string_view message = framer.Quiet();
      if (!message.empty()) messages.emplace_back(message);
    } else {
      Feed(framer, chunk, piece, messages);
    }
  }
  return messages;
}

std::vector<std::string> RunJoined(const json& entry) {
  std::string all;
  for (const std::string chunk : entry["chunks"]) all += chunk;
  Framer framer = MakeFramer(entry);
  std::vector<std::string> messages;
  Feed(framer, all, all.size(), messages);
  return messages;
}

TEST(Transcripts, EveryCaseInEverySplit) {
  std::ifstream file(std::string(CONSAC_SOURCE_DIR) + "/spec/conformance/text1/transcripts.json");
  const json cases = json::parse(file);
  ASSERT_GE(cases.size(), 12u);
  for (const json& entry : cases) {
    const std::vector<std::string> expected = entry["messages"];
    for (const std::size_t piece : {1, 2, 3, 5, 7, 1000})
      EXPECT_EQ(RunInPieces(entry, piece), expected) << entry["name"] << " in pieces of " << piece;
    const auto& chunks = entry["chunks"];
    const bool silent = std::find(chunks.begin(), chunks.end(), "quiet") != chunks.end();
    if (silent) continue;
    EXPECT_EQ(RunJoined(entry), expected) << entry["name"];
  }
}

}  // namespace
}  // namespace consac::text1
