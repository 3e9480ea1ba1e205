#pragma once
// bit-flipping-v0, bit-flipping-continuous-v0: flip bits until all are as wanted; what hindsight experience replay is
// for, because nothing pays but the goal. See README.md.

#include <algorithm>
#include <array>
#include <limits>

#include "worlds/batched.h"

namespace consac::worlds {

/// How bits are chosen: the world's id, what an element of an action is, and the space of actions.
struct FlipOneBit {
  using Action = std::int32_t;
  static constexpr const char* kId = "bit-flipping-v0";
  static Result<Space> MakeSpace(std::int64_t bits) { return Space::Discrete(bits); }
  static bool Flips(const Action* action, std::size_t bit) { return action[0] == static_cast<Action>(bit); }
};
struct FlipEveryPositiveBit {
  using Action = float;
  static constexpr const char* kId = "bit-flipping-continuous-v0";
  static Result<Space> MakeSpace(std::int64_t bits) { return Space::Box(-1, 1, {bits}); }
  static bool Flips(const Action* action, std::size_t bit) { return action[bit] > 0.0f; }
};

/// One copy. Goals are Gymnasium's: achieved_goal, desired_goal and observation, each kBits bits, in that order.
template <class Choice>
class BitFlipping {
 public:
  using Action = typename Choice::Action;
  using Observation = std::uint8_t;
  static constexpr std::size_t kBits = 10;

  /// What it offers. An episode is as long as there are bits.
  static EnvSpec Spec(std::int32_t copies) {
    const Space bits = *Space::MultiBinary(kBits);
    return SimpleSpec(Choice::kId,
                      Space::Dict({{"achieved_goal", bits}, {"desired_goal", bits}, {"observation", bits}}),
                      Choice::MakeSpace(kBits), copies, kBits, std::numeric_limits<double>::quiet_NaN());
  }
  /// Bits at random; wanted are ones.
  void Reset(Rng& rng, Observation* observation) {
    for (Observation& bit : bits_) bit = static_cast<Observation>(rng.Below(2));
    Observe(observation);
  }
  /// Flips what the action says: 0 and the end where all bits are as wanted, else -1.
  StepResult Step(const Action* action, Rng&, Observation* observation) {
    for (std::size_t bit = 0; bit < kBits; ++bit) bits_[bit] ^= Choice::Flips(action, bit) ? 1 : 0;
    Observe(observation);
    const float reward = Price(observation);
    return {reward, reward == 0.0f};
  }
  /// What a step pays that leads to `observation`: 0 where achieved and desired are the same, else -1.
  static float Price(const Observation* observation) {
    return std::equal(observation, observation + kBits, observation + kBits) ? 0.0f : -1.0f;
  }
  /// Exact state.
  void Visit(Archive& archive) {
    archive("bits", std::span<Observation>(bits_));
    for (const Observation bit : bits_) archive.Check("bits", bit <= 1);
  }

 private:
  void Observe(Observation* observation) const {
    std::copy_n(bits_.begin(), kBits, observation);
    std::fill_n(observation + kBits, kBits, Observation{1});
    std::copy_n(bits_.begin(), kBits, observation + 2 * kBits);
  }

  std::array<Observation, kBits> bits_{};
};

using BitFlippingDiscrete = BitFlipping<FlipOneBit>;
using BitFlippingContinuous = BitFlipping<FlipEveryPositiveBit>;

}  // namespace consac::worlds
