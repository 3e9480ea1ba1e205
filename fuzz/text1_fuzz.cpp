// Text protocol 1 on any bytes: the framer gives the same messages for one piece and for single bytes, and what is
// accepted is written and read back the same.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "consac/protocol/text1.h"

namespace {

using namespace consac;

void Require(bool holds) {
  if (!holds) std::abort();
}

std::vector<std::string> Messages(std::string_view bytes, std::size_t piece, text1::Framer::Expect expect) {
  text1::Framer framer;
  framer.SetExpect(expect, true);
  std::vector<std::string> messages;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const std::string_view part = bytes.substr(at, piece);
    const auto room = framer.Writable();
    if (room.size() < part.size()) return {};
    std::memcpy(room.data(), part.data(), part.size());
    if (!framer.Commit(part.size()).ok()) return {};
    for (std::string_view message = framer.Next(); !message.empty(); message = framer.Next())
      messages.emplace_back(message);
  }
  messages.emplace_back(framer.Quiet());
  return messages;
}

void TryMessages(std::string_view text) {
  const Layout box = Layout::Of(*Space::Box(-10, 10, {2})), discrete = Layout::Of(*Space::Discrete(5));
  for (const Layout* layout : {&box, &discrete}) {
    float row[2] = {}, back[2] = {}, reward = 0, reward_back = 0;
    bool done = false, done_back = false;
    std::vector<char> out(text1::MaxText(*layout));
    auto* bytes = reinterpret_cast<std::byte*>(row);
    if (text1::ParseObservation(text, *layout, false, bytes, &reward, &done).ok()) {
      const std::size_t length = text1::EncodeObservation(*layout, bytes, reward, done, text1::Terminator::kNone, out);
      Require(text1::ParseObservation({out.data(), length}, *layout, false, reinterpret_cast<std::byte*>(back),
                                      &reward_back, &done_back)
                  .ok());
      Require(std::memcmp(row, back, layout->row_bytes) == 0 &&
              std::memcmp(&reward, &reward_back, sizeof(reward)) == 0 && done == done_back);
    }
    if (text1::ParseAction(text, *layout, bytes).ok()) Require(CheckRow(*layout, bytes).ok());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 4096) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const Result<text1::Setup> setup = text1::ParseSetup(text);
  if (setup.ok()) {
    std::string written;
    if (text1::EncodeSetup(*setup, &written).ok()) {
      const Result<text1::Setup> again = text1::ParseSetup(written);
      Require(again.ok() && again->observation_space == setup->observation_space &&
              again->action_space == setup->action_space);
    }
  }
  TryMessages(text);
  for (const auto expect :
       {text1::Framer::Expect::kSetup, text1::Framer::Expect::kObservation, text1::Framer::Expect::kAction}) {
    Require(Messages(text, 1, expect) == Messages(text, size + 1, expect));
  }
  return 0;
}
