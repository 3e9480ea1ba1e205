#pragma once
// identity-*-v0: the observation is the action that pays, for each kind of space. See README.md.

#include <array>

#include "worlds/batched.h"

namespace consac::worlds {

/// One kind of space: its id, how many numbers of which range it has, how one is drawn and when one is met.
struct IdentityDiscreteKind {
  using Element = std::int32_t;
  static constexpr const char* kId = "identity-discrete-v0";
  static constexpr std::size_t kCount = 1;
  static constexpr Element kLow = 0, kHigh = 9;
  static Result<Space> MakeSpace() { return Space::Discrete(10); }
  static Element Draw(Rng& rng) { return static_cast<Element>(rng.Below(10)); }
  static bool Meets(Element wanted, Element done) { return wanted == done; }
};
struct IdentityBoxKind {
  using Element = float;
  static constexpr const char* kId = "identity-box-v0";
  static constexpr std::size_t kCount = 1;
  static constexpr Element kLow = -1, kHigh = 1;
  static Result<Space> MakeSpace() { return Space::Box(kLow, kHigh, {1}); }
  static Element Draw(Rng& rng) { return static_cast<Element>(rng.Between(kLow, kHigh)); }
  static bool Meets(Element wanted, Element done) { return wanted - done <= 0.5f && done - wanted <= 0.5f; }
};
struct IdentityMultiDiscreteKind {
  using Element = std::int32_t;
  static constexpr const char* kId = "identity-multidiscrete-v0";
  static constexpr std::size_t kCount = 2;
  static constexpr Element kLow = 0, kHigh = 3;
  static Result<Space> MakeSpace() { return Space::MultiDiscrete({4, 4}); }
  static Element Draw(Rng& rng) { return static_cast<Element>(rng.Below(4)); }
  static bool Meets(Element wanted, Element done) { return wanted == done; }
};
struct IdentityMultiBinaryKind {
  using Element = std::uint8_t;
  static constexpr const char* kId = "identity-multibinary-v0";
  static constexpr std::size_t kCount = 4;
  static constexpr Element kLow = 0, kHigh = 1;
  static Result<Space> MakeSpace() { return Space::MultiBinary(4); }
  static Element Draw(Rng& rng) { return static_cast<Element>(rng.Below(2)); }
  static bool Meets(Element wanted, Element done) { return wanted == done; }
};

/// One copy.
template <class Kind>
class Identity {
 public:
  using Action = typename Kind::Element;
  using Observation = typename Kind::Element;

  /// What it offers: the same space to see and to do.
  static EnvSpec Spec(std::int32_t copies) {
    return SimpleSpec(Kind::kId, Kind::MakeSpace(), Kind::MakeSpace(), copies, 100, 100.0);
  }
  /// Draws what is wanted.
  void Reset(Rng& rng, Observation* observation) {
    for (std::size_t i = 0; i < Kind::kCount; ++i) observation[i] = wanted_[i] = Kind::Draw(rng);
  }
  /// 1 where all of it was done, then the next.
  StepResult Step(const Action* action, Rng& rng, Observation* observation) {
    bool met = true;
    for (std::size_t i = 0; i < Kind::kCount; ++i) met = met && Kind::Meets(wanted_[i], action[i]);
    Reset(rng, observation);
    return {met ? 1.0f : 0.0f, false};
  }
  /// Exact state.
  void Visit(Archive& archive) {
    archive("wanted", std::span<Observation>(wanted_));
    for (const Observation number : wanted_) archive.Check("wanted", number >= Kind::kLow && number <= Kind::kHigh);
  }

 private:
  std::array<Observation, Kind::kCount> wanted_{};
};

using IdentityDiscrete = Identity<IdentityDiscreteKind>;
using IdentityBox = Identity<IdentityBoxKind>;
using IdentityMultiDiscrete = Identity<IdentityMultiDiscreteKind>;
using IdentityMultiBinary = Identity<IdentityMultiBinaryKind>;

}  // namespace consac::worlds
