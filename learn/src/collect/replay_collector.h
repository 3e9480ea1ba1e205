#pragma once
// What every off-policy algorithm does around its networks: it remembers what came of each step, normalises, says when
// how much learning is due, runs the rounds of it, and lets agents come and go. How actions are chosen and what a
// gradient step is are the algorithm's. Private to learn.

#include <optional>
#include <string>
#include <vector>

#include "buffer/replay.h"
#include "collect/episode_window.h"
#include "collect/hindsight.h"
#include "collect/learned_network.h"
#include "collect/rollout_collector.h"
#include "collect/vec_normalise.h"
#include "consac/policy/head.h"
#include "consac/policy/policy.h"

namespace consac::learn {

/// What train_freq counts.
enum class TrainUnit : std::uint8_t { kStep, kEpisode };

/// How an off-policy algorithm collects.
struct ReplayCollectorOptions {
  ReplayOptions replay;                          ///< what is remembered
  std::int64_t learning_starts = 100;            ///< agent steps before the first gradient
  std::int64_t train_freq = 4;                   ///< steps of an agent, or episodes of all, between rounds of learning
  TrainUnit train_freq_unit = TrainUnit::kStep;  ///< which
  std::int64_t gradient_steps = 1;               ///< of a round; -1: as many as transitions came since the last
  double gamma = 0.99;                           ///< discount per step
  Truncation truncation = Truncation::kBootstrap;  ///< of episodes that were cut
  std::int64_t report_every = 4;                   ///< episodes between reports; Stable Baselines' log_interval
  VecNormaliseOptions normalise;                   ///< its gamma is this one's
  HindsightOptions hindsight;                      ///< of what is drawn; replay.episodes with it
};

/// Steps go in, rows to learn from come out. `Stage`, `Begin` and `Record` are a Learner's.
class ReplayCollector {
 public:
  /// Collects for `behaviour`; a world's agents act one after another or at once.
  ReplayCollector(const BehaviourSpec& behaviour, ActionHead head, const ReplayCollectorOptions& options,
                  std::uint64_t seed, const Communicator& ranks = {});

  /// How actions follow from the network.
  const ActionHead& action_head() const { return action_head_; }

  /// As Learner::StartFrom, of one that acts by `acts`: that begins with the parameters of `model`, whose network must
  /// be the same, and this with its statistics of observations.
  Status StartFrom(const PolicyData& model, LearnedNetwork* acts);
  /// As Learner::Snapshot, of one that acts by `acts`; `training_json` is told to people.
  PolicyData Snapshot(const LearnedNetwork& acts, std::string training_json) const;
  /// As Learner::Stage.
  Batch Stage(std::span<const std::int32_t> slots) {
    CONSAC_ASSERT(due_ == 0);
    return replay_.Stage(slots);
  }
  /// As Learner::Begin.
  void Begin(const Batch& batch);
  /// The network inputs of what a batch is to act upon, [B, F], and where its raw actions go, [B, raw]; until the next.
  struct Acting {
    const float* features;
    float* raw;
  };
  Acting BeginAct(const Batch& batch);
  /// The raw actions are there: writes batch.actions, and files them under their slots until they are recorded.
  void FinishAct(Batch& batch);
  /// As Learner::Record; true when a report is to be made.
  [[nodiscard]] bool Record(const Batch& batch);

  /// Gradient steps that are due.
  std::int64_t due() const { return due_; }
  /// As Learner::Learn with a budget of `gradient_steps`: `step`() is a gradient step, false where it could not be
  /// done, `finish`() comes after the last of a round, whose losses `log` sums. A round begins with what the other
  /// ranks know of observations and rewards.
  template <class Log, class Step, class Finish>
  bool Learn(std::int64_t gradient_steps, Log& log, Step&& step, Finish&& finish) {
    for (std::int64_t i = 0; i < gradient_steps && due_ > 0; ++i) {
      if (round_ == 0) {
        round_ = due_;
        normalise_.Share();
        log.BeginUpdate();
      }
      if (!step()) return true;
      --due_;
      if (--round_ == 0) finish();
    }
    return due_ > 0;
  }
  /// Agent steps recorded so far.
  std::int64_t steps() const { return steps_; }
  /// Steps that a slot has taken since learning was due last.
  std::int64_t round_steps(std::int32_t slot) const { return round_slot_steps_[static_cast<std::size_t>(slot)]; }
  /// Whether actions are still to be drawn at random.
  bool warming_up() const { return steps_ < options_.learning_starts; }
  /// Episodes and their returns.
  const EpisodeWindow& episodes() const { return episodes_; }
  /// Episodes that have ended, for each agent.
  std::int64_t episodes_each() const { return episodes_.count() / behaviour_.slots; }
  /// As Learner::reports.
  std::int64_t reports() const { return episodes_.count() / options_.report_every; }
  /// Bytes of what is remembered, once full.
  std::int64_t memory_bytes() const { return Replay::Bytes(behaviour_, action_head_.raw_size(), options_.replay); }
  /// The normaliser that acts.
  const ObservationNormaliser& normaliser() const { return normalise_.frozen(); }

  /// What is remembered.
  Replay& replay() { return replay_; }
  /// A transition of the memory.
  std::int64_t Sample() {
    return hindsight_ ? hindsight_->Sample(replay_, sampling_rng_) : replay_.Sample(sampling_rng_);
  }
  /// What gives transitions other goals; null where they keep their own.
  Hindsight* hindsight() { return hindsight_ ? &*hindsight_ : nullptr; }
  /// Transitions with other goals, as many as there shall be of `places`, and their prices; returns how many there are.
  /// Nothing where the world does not say what they would have paid: they are drawn as if for the first time when it is
  /// asked again.
  std::optional<std::int64_t> DrawWithOtherGoals(std::span<std::int64_t> places) {
    if (!hindsight_) return 0;
    const Rng before = sampling_rng_;
    const std::int64_t count = hindsight_->Draw(replay_, sampling_rng_, places);
    if (hindsight_->Price()) return count;
    sampling_rng_ = before;
    return std::nullopt;
  }
  /// Ok unless the world did not say what other goals would have paid.
  Status health() const { return hindsight_ ? hindsight_->health() : Status::Ok(); }
  /// Discount per step.
  double gamma() const { return options_.gamma; }
  /// `n` steps from `place` on as one, rewards as they are learned from.
  Lookahead Look(std::int64_t place, std::int64_t n) const {
    return replay_.Look(place, n, options_.gamma, [this](float reward) { return normalise_.Reward(reward); });
  }
  /// A reward as it is learned from.
  float Reward(float reward) const { return normalise_.Reward(reward); }
  /// One observation as network inputs, [F]. For any thread.
  void Encode(const std::byte* observation, float* features) const { normalise_.Encode(observation, 1, features); }

  /// Everything.
  void Visit(Archive& archive);

 private:
  std::int64_t MostDue() const;

  const BehaviourSpec behaviour_;
  const ReplayCollectorOptions options_;
  const ActionHead action_head_;
  const std::size_t raw_size_;
  VecNormalise normalise_;
  Replay replay_;
  std::optional<Hindsight> hindsight_;
  EpisodeWindow episodes_;
  Rng sampling_rng_;
  std::int64_t steps_ = 0, due_ = 0;
  std::int64_t round_ = 0;                             // gradient steps that are left of the round under way
  std::int64_t round_steps_ = 0, round_episodes_ = 0;  // since learning was due last
  std::vector<std::int64_t> round_slot_steps_;         // [N] of each slot since then
  std::vector<float> features_;                        // [N, F] of a batch
  std::vector<float> raw_, kept_raw_;                  // [N, raw] of a batch; by slot, of those that act
  std::vector<std::uint8_t> terminated_;               // [N] of a batch
};

}  // namespace consac::learn
