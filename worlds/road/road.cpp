// Source: the CONSAC master thesis, Tallinn 2021, its worked example "Mario".
#include "worlds/road/road.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace consac::worlds {

EnvSpec Road::Spec(std::int32_t copies) {
  return SimpleSpec("road-v0", Space::Box(kFirst, kLast, {2}), Space::Discrete(3), copies, 0, 0.0);
}

// Anywhere but where the actor stands: there it would be collected before it was seen.
void Road::PlaceCoin(Rng& rng) {
  coin_ = static_cast<std::int32_t>(rng.Below(kLast - kFirst));
  coin_ += coin_ >= actor_ ? 1 : 0;
  since_coin_ = 0;
}

void Road::Observe(float* observation) const {
  observation[0] = static_cast<float>(actor_);
  observation[1] = static_cast<float>(coin_);
}

void Road::Reset(Rng& rng, float* observation) {
  actor_ = episodes_ == 0 ? kStart : static_cast<std::int32_t>(rng.Below(kLast - kFirst + 1));
  ++episodes_;
  PlaceCoin(rng);
  Observe(observation);
}

StepResult Road::Step(const Action* action, Rng& rng, float* observation) {
  const int before = std::abs(coin_ - actor_);
  actor_ += std::clamp(*action, 0, 2) - 1;
  StepResult result;
  result.reward = std::abs(coin_ - actor_) < before ? 1.0f : 0.0f;
  result.terminated = actor_ < kFirst || actor_ > kLast;
  actor_ = std::clamp(actor_, kFirst, kLast);  // the last observation lies in its space
  ++since_coin_;
  if (actor_ == coin_ || since_coin_ >= kCoinMoves) PlaceCoin(rng);
  Observe(observation);
  return result;
}

void Road::Visit(Archive& archive) {
  archive("actor", actor_);
  archive.CheckWithin("actor", actor_, kFirst, kLast);
  archive("coin", coin_);
  archive.CheckWithin("coin", coin_, kFirst, kLast);
  archive("since_coin", since_coin_);
  archive.CheckWithin("since_coin", since_coin_, 0, kCoinMoves - 1);
  archive("episodes", episodes_);
  archive.CheckWithin("episodes", episodes_, 0, std::numeric_limits<std::int32_t>::max() - 1);
}

}  // namespace consac::worlds
