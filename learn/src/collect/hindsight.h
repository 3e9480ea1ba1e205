#pragma once
// Hindsight experience replay: transitions as if a goal that was reached had been the one that was wanted, made when
// they are drawn. Which goal is the strategy's, what it would have paid the world's. Source: Andrychowicz et al. 2017,
// arXiv:1707.01495; Stable Baselines 2.10.2, her/replay_buffer.py, and Stable Baselines3, her_replay_buffer.py, for
// the rest. Private to learn.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "buffer/replay.h"

namespace consac::learn {

/// Whether what is remembered is drawn as it was, or also with other goals.
enum class ReplayBufferClass : std::uint8_t { kReplay, kHindsight };
/// Whose goal: of a later transition of the episode, of its last one, of any of it, of any of all episodes.
enum class GoalStrategy : std::uint8_t { kFuture, kFinal, kEpisode, kRandom };
/// What was achieved before a transition, and ends are forgotten (SB2); or after it, and ends stay (SB3).
enum class GoalForm : std::uint8_t { kBefore, kAfter };

/// How goals are put in the place of others.
struct HindsightOptions {
  ReplayBufferClass buffer = ReplayBufferClass::kReplay;  ///< at all
  std::int64_t rows = 0;                                  ///< of a minibatch
  std::int64_t n_sampled_goal = 4;                        ///< transitions with another goal for each with its own
  GoalStrategy strategy = GoalStrategy::kFuture;          ///< whose
  GoalForm form = GoalForm::kAfter;                       ///< when the goal was achieved
  /// VectorEnv::PriceGoals
  std::function<Status(const std::byte* observations, std::int64_t rows, float* rewards)> price;
};

/// Room for the relabelled rows of one minibatch. Never allocates after creation.
class Hindsight {
 public:
  /// For `behaviour`, which GoalsFit.
  Hindsight(const BehaviourSpec& behaviour, const HindsightOptions& options);

  /// Ok where every leaf under "achieved_goal" has its like under "desired_goal"; the error says what is missing.
  static Status GoalsFit(const BehaviourSpec& behaviour);
  /// Bytes that it takes.
  static std::int64_t Bytes(const BehaviourSpec& behaviour, std::int64_t rows);

  /// Whether those that have another goal go on behind a terminal state.
  bool forgets_ends() const { return options_.form == GoalForm::kBefore; }

  /// A transition of a finished episode, as probable as any other; where few or none have finished, any transition.
  std::int64_t Sample(const Replay& replay, Rng& rng) const;
  /// Draws the minibatch's transitions that are to have other goals, k of k + 1 of its rows, and puts those in. Returns
  /// how many there are, and the places of those: fewer where no goal is known for one.
  std::int64_t Draw(const Replay& replay, Rng& rng, std::span<std::int64_t> places);
  /// What was seen in the `i`th of them, [row_bytes], with its goal.
  const std::byte* observation(std::int64_t i) const { return Row(observations_, i); }
  /// What it led to.
  const std::byte* next_observation(std::int64_t i) const { return Row(next_observations_, i); }
  /// Asks the world what they would have paid: false where it does not say, and health why.
  [[nodiscard]] bool Price();
  /// That, [drawn].
  std::span<const float> paid() const { return {rewards_.data(), static_cast<std::size_t>(count_)}; }
  /// How the world was last asked.
  const Status& health() const { return health_; }

 private:
  /// A leaf of the goal.
  struct Part {
    std::size_t achieved, desired, bytes;  // offsets in a row
  };
  static std::vector<Part> PartsOf(const BehaviourSpec& behaviour);
  const std::byte* Row(const std::vector<std::byte>& rows, std::int64_t i) const {
    return rows.data() + static_cast<std::size_t>(i) * row_bytes_;
  }
  bool Relabel(const Replay& replay, std::int64_t place, Rng& rng);
  const std::byte* GoalOf(const Replay& replay, std::int64_t place, Rng& rng) const;
  void Put(const std::byte* observation, const std::byte* goal, std::vector<std::byte>& rows) const;

  const HindsightOptions options_;
  const std::size_t row_bytes_;
  const std::int64_t wanted_;
  const std::vector<Part> parts_;
  Status health_;
  std::int64_t count_ = 0;                                   // drawn
  std::vector<std::byte> observations_, next_observations_;  // [wanted, row_bytes]
  std::vector<float> rewards_;                               // [wanted]
};

}  // namespace consac::learn
