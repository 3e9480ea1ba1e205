#include "algo/off_policy.h"

#include <algorithm>

#include "algo/progress.h"

namespace consac::learn {

float RateAt(const Schedule& rate, std::int64_t steps, std::int64_t total_steps) {
  return static_cast<float>(rate.At(RemainingShare(steps, total_steps)));
}

// Source: Stable Baselines 2.10.2, LinearSchedule.
double OffPolicyOptions::BetaAt(std::int64_t steps, std::int64_t total_steps) const {
  const double over =
      std::min(1.0, ElapsedShare(steps, prioritized_beta_steps > 0 ? prioritized_beta_steps : total_steps));
  return prioritized_beta0 + over * (1.0 - prioritized_beta0);
}

Status TakeHindsight(const LearnerOptions& options, OffPolicyOptions* own) {
  HindsightOptions& hindsight = own->collect.hindsight;
  if (hindsight.buffer == ReplayBufferClass::kReplay) return Status::Ok();
  CONSAC_RETURN_IF_ERROR(Hindsight::GoalsFit(options.behaviour));
  if (!options.price_goals) {
    return {StatusCode::kInvalidArgument,
            "HerReplayBuffer needs a world that can say what other goals would have paid; choose ReplayBuffer"};
  }
  own->collect.replay.episodes = true;
  hindsight.rows = own->batch_size;
  hindsight.price = options.price_goals;
  return Status::Ok();
}

Status CheckOffPolicyMemory(const LearnerOptions& options, const OffPolicyOptions& own, const OffPolicySizes& sizes) {
  const BehaviourSpec& behaviour = options.behaviour;
  CONSAC_RETURN_IF_ERROR(Replay::CheckFits(behaviour, sizes.raw_action, own.collect.replay, options.max_bytes));
  std::int64_t left = options.max_bytes - Replay::Bytes(behaviour, sizes.raw_action, own.collect.replay);
  const std::int64_t row = behaviour.observation_layout.feature_count * static_cast<std::int64_t>(sizeof(float));
  if (own.batch_size > left / row) {
    return {StatusCode::kResourceExhausted, "minibatches of " + std::to_string(own.batch_size) +
                                                " transitions take more memory than is allowed here; lower batch_size"};
  }
  left -= own.batch_size * row + sizes.activations;
  if (own.collect.replay.episodes) left -= Hindsight::Bytes(behaviour, own.batch_size);
  const std::int64_t columns = sizes.copies * static_cast<std::int64_t>(sizeof(float));
  if (left >= 0 && sizes.parameters <= left / columns) return Status::Ok();
  return {StatusCode::kResourceExhausted,
          "net_arch makes " + std::to_string(sizes.parameters) +
              " parameters, and learning them takes more memory than is allowed here; choose smaller layers"};
}

}  // namespace consac::learn
