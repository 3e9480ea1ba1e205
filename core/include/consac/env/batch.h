#pragma once
// The one batch that worlds, protocols, learners and plug-ins share: spans into buffers that their owner allocated
// once, written in place. A row is one agent in one world; its slot id stays with it for life.

#include <cstddef>
#include <cstdint>
#include <span>

namespace consac {

/// One transition of B rows: what was seen, what was done, what came of it. Owns nothing.
/// Life of a batch: the learner stages it (Learner::Stage) -> observations are already there or the driver writes
/// them -> Learner::Act writes `actions` -> the world's Step writes everything below -> Learner::Record reads it.
struct Batch {
  std::span<const std::int32_t> slots;      // [B]  ascending, unique; which agent each row is
  std::byte* observations = nullptr;        // [B, observation row_bytes]  what the action is chosen from
  std::uint8_t* action_masks = nullptr;     // [B, mask_bytes]  1 legal, 0 not; null when nothing is masked
  std::byte* actions = nullptr;             // [B, action row_bytes]  legal actions, as the world takes them
  float* rewards = nullptr;                 // [B]
  std::uint8_t* terminated = nullptr;       // [B]  1: the episode ended in a terminal state
  std::uint8_t* truncated = nullptr;        // [B]  1: the episode was cut (time limit), its state is not terminal
  std::byte* final_observations = nullptr;  // [B, observation row_bytes]  last observation, only where an episode ended
  std::byte* next_observations = nullptr;   // [B, observation row_bytes]  first of the new episode where one ended
  std::uint8_t* next_action_masks = nullptr;  // [B, mask_bytes]  for next_observations; null when nothing is masked

  /// Number of rows, B.
  std::int64_t rows() const { return static_cast<std::int64_t>(slots.size()); }
};

}  // namespace consac
