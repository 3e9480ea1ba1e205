#include "consac/protocol/relabel.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

#include "consac/base/text.h"
#include "protocol/protocol2_json.h"
#include "protocol/row_fault.h"

namespace consac::protocol2 {
namespace {

constexpr std::size_t kRowsOffset = 8;  // in RELABEL

/// R93, of `rows` rows.
Status CheckGoals(const Layout& layout, const std::byte* observations, std::int64_t rows) {
  for (const Leaf& leaf : layout.leaves) {
    if (!PathBelow(kAchievedGoal, leaf) && !PathBelow(kDesiredGoal, leaf)) continue;
    for (std::int64_t i = 0; i < rows; ++i) {
      const RowFault fault =
          FindLeafFault(leaf, observations + static_cast<std::size_t>(i) * layout.row_bytes, Numbers::kJudged);
      if (fault.leaf == nullptr) continue;
      const std::string what = "'" + leaf.name + "' in row " + std::to_string(i) + " of RELABEL is ";
      if (fault.non_finite) return Fault("NON_FINITE", what + "NaN or infinite");
      return Fault("OUT_OF_RANGE", what + NumberText(fault.value) + ", outside " + NumberText(fault.low) + " to " +
                                       NumberText(fault.high));
    }
  }
  return Status::Ok();
}

}  // namespace

bool HasGoals(const Layout& observation) {
  std::int64_t achieved = 0, desired = 0;
  for (const Leaf& leaf : observation.leaves) {
    desired += PathBelow(kDesiredGoal, leaf).has_value();
    const auto below = PathBelow(kAchievedGoal, leaf);
    if (!below.has_value()) continue;
    ++achieved;
    const Leaf* like = FindLeafBelow(observation, kDesiredGoal, *below);
    if (like == nullptr || !(like->space == leaf.space)) return false;
  }
  return achieved > 0 && achieved == desired;
}

std::size_t RelabelBytes(const BehaviourSpec& behaviour, std::int64_t rows) {
  return AlignBlock(kRowsOffset + static_cast<std::size_t>(rows) * behaviour.observation_layout.row_bytes);
}

std::int64_t MostRelabelledRows(const BehaviourSpec& behaviour, std::size_t max_frame) {
  const std::size_t room = std::min(max_frame, kMostRelabelled) / 8 * 8;
  const std::size_t each = std::max(behaviour.observation_layout.row_bytes, sizeof(double));
  return std::max<std::int64_t>(1, static_cast<std::int64_t>((room - kRowsOffset) / each));
}

void WriteRelabel(const EnvSpec& env, const Relabel& relabel, std::byte* payload) {
  const std::uint32_t words[2] = {static_cast<std::uint32_t>(relabel.behaviour),
                                  static_cast<std::uint32_t>(relabel.rows)};
  std::memcpy(payload, words, sizeof(words));
  const std::size_t row_bytes = env.behaviours[relabel.behaviour].observation_layout.row_bytes;
  std::copy_n(relabel.observations, static_cast<std::size_t>(relabel.rows) * row_bytes, payload + kRowsOffset);
}

Result<Relabel> ReadRelabel(const EnvSpec& env, std::span<const std::byte> payload, std::size_t max_frame) {
  const auto wrong_size = [&](std::uint64_t expected) {
    return Fault("WRONG_SIZE",
                 "RELABEL has " + std::to_string(payload.size()) + " bytes, expected " + std::to_string(expected));
  };
  if (payload.size() < kRowsOffset) return wrong_size(kRowsOffset);
  const std::uint32_t place = WordAt(payload, 0), rows = WordAt(payload, 4);
  if (place >= env.behaviours.size())
    return Fault("OUT_OF_RANGE", "RELABEL is of behaviour " + std::to_string(place) + "; there are " +
                                     std::to_string(env.behaviours.size()));
  const BehaviourSpec& behaviour = env.behaviours[place];
  if (!HasGoals(behaviour.observation_layout))
    return Fault("UNSUPPORTED",
                 "observations of '" + behaviour.name + "' have no achieved_goal and desired_goal that are alike");
  // Widened: 2^32 rows of 2^32 bytes are more than a payload has anyway.
  const std::uint64_t row_bytes = behaviour.observation_layout.row_bytes;
  if (rows > payload.size() / std::max<std::uint64_t>(row_bytes, 1) || payload.size() != RelabelBytes(behaviour, rows))
    return wrong_size((kRowsOffset + rows * row_bytes + 7) / 8 * 8);
  if (rows * sizeof(double) > max_frame)
    return Fault("UNSUPPORTED", "the REWARDS of " + std::to_string(rows) + " rows are more than max_frame, " +
                                    std::to_string(max_frame) + " bytes; ask for fewer at a time");
  const Relabel relabel{place, rows, payload.data() + kRowsOffset};
  CONSAC_RETURN_IF_ERROR(CheckGoals(behaviour.observation_layout, relabel.observations, relabel.rows));
  return relabel;
}

Status CheckRewards(std::span<const float> rewards) {
  for (std::size_t i = 0; i < rewards.size(); ++i) {
    if (std::isfinite(rewards[i])) continue;
    return Fault("NON_FINITE", "row " + std::to_string(i) + " of RELABEL would have paid " +
                                   NumberText(static_cast<double>(rewards[i])) + "; its goals may be too far apart");
  }
  return Status::Ok();
}

void WriteRewards(std::span<const float> rewards, std::byte* payload) {
  for (std::size_t i = 0; i < rewards.size(); ++i) {
    const double reward = rewards[i];
    std::memcpy(payload + i * sizeof(reward), &reward, sizeof(reward));
  }
}

Status ReadRewards(std::span<const std::byte> payload, std::int64_t rows, float* rewards) {
  const std::size_t expected = static_cast<std::size_t>(rows) * sizeof(double);
  if (payload.size() != expected) {
    return {StatusCode::kProtocol, "REWARDS has " + std::to_string(payload.size()) + " bytes, expected " +
                                       std::to_string(expected) + ": 8 for each row of RELABEL (R94)"};
  }
  for (std::int64_t i = 0; i < rows; ++i) {
    double reward = 0.0;
    std::memcpy(&reward, payload.data() + static_cast<std::size_t>(i) * sizeof(reward), sizeof(reward));
    if (!(std::fabs(reward) <= static_cast<double>(std::numeric_limits<float>::max()))) {
      return {StatusCode::kNonFinite, "the price of row " + std::to_string(i) + " of RELABEL is " + NumberText(reward) +
                                          ", which float32 does not have; mend it in the world (R95)"};
    }
    rewards[i] = static_cast<float>(reward);
  }
  return Status::Ok();
}

}  // namespace consac::protocol2
