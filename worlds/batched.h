#pragma once
// Turns one plain world into N copies that step as one batch: one loop, no virtual call inside, results written
// straight into the batch. Every built-in world is made by it; a world only says how one copy resets and steps.
//
// A world W has:
//   using Action = std::int32_t or float;            what one element of an action is
//   using Observation = std::uint8_t;                what one element of an observation is; without it float
//   static EnvSpec Spec(std::int32_t copies);        what it offers
//   void Reset(Rng& rng, Observation* observation);  starts an episode
//   StepResult Step(const Action* action, Rng& rng, Observation* observation);
//   void Visit(Archive& archive);                    its exact state
// and may have:
//   void SetParameters(std::span<const double>);     before Reset, all that Spec has of them
//   float Price(const Observation*) const;           what a step to it pays, static or not: it prices goals
//   bool Succeeds(const Observation*) const;         whether it is where it should be: it has the info is_success
//   static constexpr std::size_t kTogether;          how many copies are stepped by one call of
//   static void StepTogether(const Together<W>&);    with the bits that Step gives each

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "consac/env/success.h"
#include "consac/env/vector_env.h"

namespace consac::worlds {

/// What one step of one copy came to.
struct StepResult {
  float reward = 0.0f;      ///< of this step
  bool terminated = false;  ///< the episode ended in a terminal state
};

/// What one element of W's observations is.
template <class W>
struct ObservationElement {
  using Type = float;
};
template <class W>
requires requires {
  typename W::Observation;
}
struct ObservationElement<W> {
  using Type = typename W::Observation;
};

/// W::kTogether copies that step at once.
template <class W>
struct Together {
  std::array<W*, W::kTogether> worlds;                 ///< no two the same
  const typename W::Action* actions;                   ///< [kTogether, elements of an action]
  typename ObservationElement<W>::Type* observations;  ///< [kTogether, elements of an observation] written
  std::array<StepResult, W::kTogether>* results;       ///< written
};

/// N copies of W. Copy i draws from stream "world" of seed + i.
template <class W>
class Batched final : public VectorEnv {
 public:
  /// `copies` >= 1.
  explicit Batched(std::int32_t copies) : spec_(W::Spec(copies)), worlds_(static_cast<std::size_t>(copies)) {
    TellSuccess();
    TakeDefaults();
  }
  /// Copies of `world`, which offers `spec`.
  Batched(EnvSpec spec, const W& world, std::int32_t copies)
      : spec_(std::move(spec)), worlds_(static_cast<std::size_t>(copies), Copy{world, Rng(), 0}) {
    TellSuccess();
    TakeDefaults();
  }

  const EnvSpec& spec() const override { return spec_; }

  void Reset(std::uint64_t seed, std::span<Batch> batches) override {
    for (std::size_t i = 0; i < worlds_.size(); ++i) (void)ResetWorld(static_cast<std::int32_t>(i), seed + i, batches);
  }

  bool ResetWorld(std::int32_t world, std::optional<std::uint64_t> seed, std::span<Batch> batches) override {
    const auto i = static_cast<std::size_t>(world);
    Copy& copy = worlds_[i];
    if (seed.has_value()) copy.rng = Rng(*seed, StreamId("world"));
    Begin(i, Row(batches[0].next_observations, i));
    return true;
  }

  bool steps_some() const override { return true; }

  void Step(std::span<Batch> batches) override {
    Batch& batch = batches[0];
    const auto* actions = reinterpret_cast<const typename W::Action*>(batch.actions);
    const std::size_t action_size = spec_.behaviours[0].action_layout.row_bytes / sizeof(typename W::Action);
    const std::size_t row_bytes = spec_.behaviours[0].observation_layout.row_bytes;
    const auto observation = [&](std::size_t i) {
      return reinterpret_cast<Observation*>(batch.next_observations + i * row_bytes);
    };
    std::size_t i = 0;
    if constexpr (kStepsTogether) {
      for (Together<W> some; i + W::kTogether <= batch.slots.size(); i += W::kTogether) {
        std::array<StepResult, W::kTogether> results;
        for (std::size_t k = 0; k < W::kTogether; ++k) some.worlds[k] = &CopyOf(batch, i + k).world;
        some.actions = actions + i * action_size;
        some.observations = observation(i);
        some.results = &results;
        W::StepTogether(some);
        for (std::size_t k = 0; k < W::kTogether; ++k) Finish(batch, i + k, results[k], observation(i + k), row_bytes);
      }
    }
    for (; i < batch.slots.size(); ++i) {
      Copy& copy = CopyOf(batch, i);
      Finish(batch, i, copy.world.Step(actions + i * action_size, copy.rng, observation(i)), observation(i), row_bytes);
    }
  }

  std::span<const InfoColumn> infos() const override { return infos_; }

  void SetParameters(std::int32_t world, std::span<const double> values) override {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!std::isnan(values[i])) parameters_[static_cast<std::size_t>(world) * values.size() + i] = values[i];
    }
  }

  bool prices_goals() const override { return kPrices; }

  void PriceGoals(std::size_t, const std::byte* observations, std::int64_t rows, float* rewards) const override {
    if constexpr (kPrices) {
      const std::size_t row_bytes = spec_.behaviours[0].observation_layout.row_bytes;
      for (std::size_t i = 0; i < static_cast<std::size_t>(rows); ++i)
        rewards[i] = worlds_[0].world.Price(reinterpret_cast<const Observation*>(observations + i * row_bytes));
    }
    (void)observations, (void)rows, (void)rewards;
  }

  void Visit(Archive& archive) override {
    archive("worlds", worlds_);
    if constexpr (kSets) {
      archive("parameters", std::span<double>(parameters_));
      for (std::size_t i = 0; i < parameters_.size(); ++i)
        archive.Check("parameters", CheckValue(spec_.parameters[i % spec_.parameters.size()], parameters_[i]).ok());
    }
    if (!archive.loading()) return;
    const std::int64_t longest = spec_.max_episode_steps;
    for (std::size_t i = 0; i < worlds_.size(); ++i) {
      archive.CheckWithin("worlds/" + std::to_string(i) + "/steps", worlds_[i].steps, 0,
                          longest > 0 ? longest - 1 : std::numeric_limits<std::int64_t>::max());
    }
  }

  /// Copy `index`, for descriptions and tests.
  W& world(std::size_t index) { return worlds_[index].world; }
  /// Copy `index`, for descriptions and tests.
  const W& world(std::size_t index) const { return worlds_[index].world; }

 private:
  using Observation = typename ObservationElement<W>::Type;
  static constexpr bool kStepsTogether = requires { W::kTogether; };
  static constexpr bool kSets = requires(W & world, std::span<const double> values) { world.SetParameters(values); };
  static constexpr bool kPrices = requires(const W& world, const Observation* seen) { world.Price(seen); };
  static constexpr bool kSucceeds = requires(const W& world, const Observation* seen) { world.Succeeds(seen); };
  struct Copy {
    W world;
    Rng rng;
    std::int64_t steps = 0;
    void Visit(Archive& archive) {
      archive("world", world);
      archive("rng", rng);
      archive("steps", steps);
    }
  };

  Copy& CopyOf(const Batch& batch, std::size_t i) { return worlds_[static_cast<std::size_t>(batch.slots[i])]; }

  /// The column of infos that a world has which says where it succeeds.
  void TellSuccess() {
    if constexpr (kSucceeds) {
      succeeds_.assign(worlds_.size(), 0.0f);
      infos_.push_back({kSuccessInfo, succeeds_});
    }
  }

  /// Writes what row `i` came to, and begins anew where its episode ended.
  void Finish(Batch& batch, std::size_t i, StepResult result, Observation* observation, std::size_t row_bytes) {
    Copy& copy = CopyOf(batch, i);
    ++copy.steps;
    if constexpr (kSucceeds)
      succeeds_[static_cast<std::size_t>(batch.slots[i])] = copy.world.Succeeds(observation) ? 1.0f : 0.0f;
    const bool cut = !result.terminated && spec_.max_episode_steps > 0 && copy.steps >= spec_.max_episode_steps;
    batch.rewards[i] = result.reward;
    batch.terminated[i] = result.terminated ? 1 : 0;
    batch.truncated[i] = cut ? 1 : 0;
    if (!result.terminated && !cut) return;
    std::memcpy(batch.final_observations + i * row_bytes, observation, row_bytes);
    Begin(static_cast<std::size_t>(batch.slots[i]), observation);
  }

  void TakeDefaults() {
    const std::vector<double> defaults = DefaultsOf(spec_.parameters);
    for (std::size_t i = 0; i < worlds_.size(); ++i)
      parameters_.insert(parameters_.end(), defaults.begin(), defaults.end());
  }

  /// An episode of copy `i`, with the parameters that are set by now.
  void Begin(std::size_t i, Observation* observation) {
    Copy& copy = worlds_[i];
    copy.steps = 0;
    if constexpr (kSets) {
      const std::size_t count = spec_.parameters.size();
      copy.world.SetParameters(std::span<const double>(parameters_).subspan(i * count, count));
    }
    copy.world.Reset(copy.rng, observation);
  }

  Observation* Row(std::byte* observations, std::size_t i) const {
    return reinterpret_cast<Observation*>(observations + i * spec_.behaviours[0].observation_layout.row_bytes);
  }

  EnvSpec spec_;
  std::vector<Copy> worlds_;
  std::vector<float> succeeds_;     // [copies] of the latest step
  std::vector<InfoColumn> infos_;   // of them
  std::vector<double> parameters_;  // [copies, parameters] as they were set
};

/// Makes N copies of W: a row's `create` in the table of worlds.
template <class W>
std::unique_ptr<VectorEnv> MakeBatched(std::int32_t copies) {
  return std::make_unique<Batched<W>>(copies);
}

/// The spec of a simple world: one behaviour with these spaces, which must be legal.
inline EnvSpec SimpleSpec(const char* id, Result<Space> observation, Result<Space> action, std::int32_t copies,
                          std::int64_t max_episode_steps, double reward_threshold) {
  EnvSpec spec;
  spec.id = id;
  spec.behaviours.push_back(BehaviourSpec::Of("default", std::move(*observation), std::move(*action), copies));
  spec.max_episode_steps = max_episode_steps;
  spec.reward_threshold = reward_threshold;
  return spec;
}

}  // namespace consac::worlds
