// Protocol 2 on any bytes: a stream gives the same frames in one piece and byte by byte; every control message that is
// accepted is written and read back the same; a RESULT of any bytes stays within its batches.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "consac/env/buffer.h"
#include "consac/protocol/protocol2.h"
#include "consac/protocol/relabel.h"
#include "consac/protocol/result_check.h"

namespace {

using namespace consac;

void Require(bool holds) {
  if (!holds) std::abort();
}

std::vector<std::string> Frames(std::span<const std::byte> bytes, std::size_t piece) {
  protocol2::FrameReader reader;
  std::vector<std::string> frames;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const auto part = bytes.subspan(at, std::min(piece, bytes.size() - at));
    std::memcpy(reader.Writable().data(), part.data(), part.size());
    reader.Commit(part.size());
    while (true) {
      protocol2::Frame frame;
      const Result<bool> whole = reader.Next(&frame);
      if (!whole.ok()) {
        frames.push_back("error " + std::string(protocol2::FaultName(whole.status())));
        return frames;
      }
      if (!*whole) break;
      frames.push_back(std::to_string(static_cast<int>(frame.header.type)) + "," +
                       std::to_string(frame.header.request) + "," +
                       std::string(reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size()));
    }
  }
  return frames;
}

template <class Parse, class Encode>
void TryMessage(std::span<const std::byte> payload, Parse&& parse, Encode&& encode) {
  const auto message = parse(payload);
  if (!message.ok()) return;
  const std::string once = encode(*message);
  const auto again = parse(std::as_bytes(std::span(once)));
  Require(again.ok() && encode(*again) == once);
}

void TryResult(std::span<const std::byte> payload) {
  static EnvSpec env = [] {
    EnvSpec spec;
    spec.behaviours.push_back(BehaviourSpec::Of("a", *Space::Box(-1, 1, {3}), *Space::Discrete(3), 2));
    spec.behaviours.push_back(BehaviourSpec::Of("b", *Space::Box(0, 255, {2, 3}, DType::kU8), *Space::Discrete(2), 2));
    spec.behaviours[1].masks_actions = true;
    spec.groups = {{"all", {{0, 0}, {1, 0}}}};
    return spec;
  }();
  static const protocol2::Blocks blocks(env);
  static BatchBuffer a(env.behaviours[0]), b(env.behaviours[1]);
  Batch batches[] = {a.batch(), b.batch()};
  const Status read = protocol2::ReadResult(env, blocks, payload, batches);
  static const std::vector<std::byte> all(static_cast<std::size_t>(env.environments()), std::byte{1});
  protocol2::ResultCheck check(env, protocol2::Autoreset::kSameStep);
  check.Ask(protocol2::FrameType::kReset, all);
  Require(!check.Judge(payload).ok() || read.ok());  // what the judge takes can be read
  protocol2::ResultCheck of_all(env, protocol2::Autoreset::kSameStep, protocol2::Numbers::kJudged, {true, true, true});
  of_all.Ask(protocol2::FrameType::kReset, all);
  if (!of_all.Judge(payload).ok()) return;
  const protocol2::ResultParts parts = protocol2::FindParts(env, blocks, payload);
  if (parts.statistics == 0) return;
  std::vector<Statistic> noted;
  const std::size_t begin = parts.statistics + sizeof(std::uint32_t);
  Require(protocol2::ReadStatistics(payload.subspan(begin, parts.statistics_end - begin), &noted).ok());
}

// What is taken is priced, and the prices are what the trainer takes.
void TryRelabel(std::span<const std::byte> payload) {
  static const EnvSpec env = [] {
    EnvSpec spec;
    const Space goal = *Space::Box(-1, 1, {2}), bits = *Space::MultiBinary(3);
    spec.behaviours.push_back(BehaviourSpec::Of("a", *Space::Box(-1, 1, {3}), *Space::Discrete(3), 1));
    spec.behaviours.push_back(
        BehaviourSpec::Of("b", *Space::Dict({{"achieved_goal", goal}, {"desired_goal", goal}, {"observation", bits}}),
                          *Space::Discrete(2), 1));
    return spec;
  }();
  const Result<protocol2::Relabel> asked = protocol2::ReadRelabel(env, payload, 4096);
  std::vector<float> rewards(asked.ok() ? static_cast<std::size_t>(asked->rows) : 1, 1.0f);
  if (!asked.ok()) return (void)protocol2::ReadRewards(payload, 1, rewards.data());
  Require(asked->behaviour == 1);
  std::vector<std::byte> again(payload.size()), paid(rewards.size() * sizeof(double));
  protocol2::WriteRelabel(env, *asked, again.data());
  const Result<protocol2::Relabel> same = protocol2::ReadRelabel(env, again, 4096);
  Require(same.ok() && same->rows == asked->rows);
  protocol2::WriteRewards(rewards, paid.data());
  Require(protocol2::ReadRewards(paid, asked->rows, rewards.data()).ok());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 8192) return 0;
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  Require(Frames(bytes, 1) == Frames(bytes, 8192));
  TryMessage(bytes, protocol2::ParseHello, protocol2::EncodeHello);
  TryMessage(bytes, protocol2::ParseWelcome, protocol2::EncodeWelcome);
  TryMessage(bytes, protocol2::ParseConfigure, protocol2::EncodeConfigure);
  for (const bool agreed : {false, true}) {
    TryMessage(
        bytes,
        [&](auto payload) {
          return protocol2::ParseSpec(payload, {agreed, agreed, agreed});
        },
        protocol2::EncodeSpec);
  }
  TryMessage(bytes, protocol2::ParseError, protocol2::EncodeError);
  (void)protocol2::ParseRender(bytes);
  TryResult(bytes);
  TryRelabel(bytes);
  return 0;
}
