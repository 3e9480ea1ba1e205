// Where the blocks of RESET, STEP and RESULT lie, and reading a RESULT into batches.
#include <algorithm>
#include <cstring>

#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"

namespace consac::protocol2 {

Blocks::Blocks(const EnvSpec& env) : environments(static_cast<std::size_t>(env.environments())) {
  seeds = AlignBlock(kActiveOffset + environments);
  options = seeds + environments * sizeof(std::int64_t);
  std::size_t step = seeds, result = 8, finals = 0;
  for (const BehaviourSpec& behaviour : env.behaviours) {
    const auto slots = static_cast<std::size_t>(behaviour.slots);
    const std::size_t observation_bytes = slots * behaviour.observation_layout.row_bytes;
    BehaviourBlocks& at = behaviours.emplace_back();
    at.actions = step;
    step = AlignBlock(step + slots * behaviour.action_layout.row_bytes);
    at.observations = result;
    at.rewards = AlignBlock(at.observations + observation_bytes);
    at.states = at.rewards + slots * sizeof(double);
    at.masks = AlignBlock(at.states + slots);
    const std::size_t mask_bytes =
        behaviour.masks_actions ? slots * static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : 0;
    result = AlignBlock(at.masks + mask_bytes);
    finals += AlignBlock(observation_bytes);
  }
  parameters = env.parameters.size();
  groups = env.groups.size();
  step_bytes = step;
  result_bytes = result;
  largest_result = result + finals + group_bytes();
}

ResultParts FindParts(const EnvSpec& env, const Blocks& blocks, std::span<const std::byte> payload) {
  std::uint32_t parts = 0;
  std::memcpy(&parts, payload.data(), sizeof(parts));
  ResultParts at;
  at.end = at.finals = blocks.result_bytes;
  for (std::size_t b = 0; b < env.behaviours.size(); ++b) {
    const std::byte* states = payload.data() + blocks.behaviours[b].states;
    std::size_t rows = 0;
    for (std::int32_t i = 0; i < env.behaviours[b].slots; ++i)
      rows += (states[i] & std::byte{kFinal}) != std::byte{0} ? 1 : 0;
    at.end = AlignBlock(at.end + rows * env.behaviours[b].observation_layout.row_bytes);
    at.rows_with_final += rows;
  }
  at.finals_end = at.end;
  if ((parts & kPartGroups) != 0) {
    at.groups = at.end;
    at.end += blocks.group_bytes();
  }
  const auto text = [&](std::uint32_t part, std::size_t* begin, std::size_t* end) {
    if ((parts & part) == 0) return;
    *begin = at.end;
    std::uint32_t length = 0;
    if (payload.size() >= at.end + sizeof(length)) std::memcpy(&length, payload.data() + at.end, sizeof(length));
    *end = at.end + sizeof(length) + length;
    at.end = AlignBlock(*end);
  };
  text(kPartStatistics, &at.statistics, &at.statistics_end);
  text(kPartInfos, &at.infos, &at.infos_end);
  return at;
}

namespace {

constexpr double kEngineTick = 1e-7;          // s
constexpr std::size_t kEngineTimeOffset = 4;  // in RESULT

Status WrongSize(std::size_t found, std::size_t expected) {
  return Fault("MALFORMED", "a RESULT has " + std::to_string(found) + " bytes, too few for its " +
                                std::to_string(expected) + " of rows, rewards and states");
}

}  // namespace

void WriteEngineTime(double seconds, std::byte* payload) {
  constexpr double kLongest = 4294967295.0;
  const auto ticks = static_cast<std::uint32_t>(std::clamp(seconds / kEngineTick, 0.0, kLongest));
  std::memcpy(payload + kEngineTimeOffset, &ticks, sizeof(ticks));
}

double ReadEngineTime(const std::byte* payload) {
  std::uint32_t ticks = 0;
  std::memcpy(&ticks, payload + kEngineTimeOffset, sizeof(ticks));
  return ticks * kEngineTick;
}

Status ReadResult(const EnvSpec& env, const Blocks& blocks, std::span<const std::byte> payload,
                  std::span<Batch> batches) {
  if (payload.size() < blocks.result_bytes) return WrongSize(payload.size(), blocks.result_bytes);
  std::uint32_t parts = 0;
  std::memcpy(&parts, payload.data(), sizeof(parts));
  std::size_t final_at = blocks.result_bytes;
  for (std::size_t b = 0; b < env.behaviours.size(); ++b) {
    const BehaviourSpec& behaviour = env.behaviours[b];
    const BehaviourBlocks& at = blocks.behaviours[b];
    const auto slots = static_cast<std::size_t>(behaviour.slots);
    const std::size_t row_bytes = behaviour.observation_layout.row_bytes;
    Batch& batch = batches[b];
    std::memcpy(batch.next_observations, payload.data() + at.observations, slots * row_bytes);
    for (std::size_t i = 0; i < slots; ++i) {
      double reward = 0.0;
      std::memcpy(&reward, payload.data() + at.rewards + i * sizeof(reward), sizeof(reward));
      const auto state = std::to_integer<std::uint8_t>(payload[at.states + i]);
      batch.rewards[i] = static_cast<float>(reward);
      batch.terminated[i] = (state & kTerminated) != 0 ? 1 : 0;
      batch.truncated[i] = (state & kTruncated) != 0 ? 1 : 0;
      if ((state & (kTerminated | kTruncated)) != 0 && (state & kFinal) == 0) {
        // It vanished: what it saw last is where it stands.
        std::memcpy(batch.final_observations + i * row_bytes, payload.data() + at.observations + i * row_bytes,
                    row_bytes);
      }
      if ((parts & kPartFinals) != 0 && (state & kFinal) != 0) {
        if (payload.size() < final_at + row_bytes) return WrongSize(payload.size(), final_at + row_bytes);
        std::memcpy(batch.final_observations + i * row_bytes, payload.data() + final_at, row_bytes);
        final_at += row_bytes;
      }
    }
    final_at = AlignBlock(final_at);
    if (behaviour.masks_actions && batch.next_action_masks != nullptr) {
      std::memcpy(batch.next_action_masks, payload.data() + at.masks,
                  slots * static_cast<std::size_t>(behaviour.action_layout.mask_bytes));
    }
  }
  return Status::Ok();
}

}  // namespace consac::protocol2
