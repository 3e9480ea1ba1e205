#pragma once
// The learner behind `ppo2` and `ppo`. ppo_acting.cpp acts and records, ppo_learning.cpp learns, ppo_state.cpp tells
// and keeps what there is. Private to learn.

#include <string>
#include <vector>

#include "algo/head_gradient.h"
#include "algo/ppo.h"
#include "consac/learn/buffer/rollout.h"
#include "consac/learn/grad/backpropagation.h"

namespace consac::learn {

/// Sums over the rows of one block, and over the minibatches of an update.
struct LossSums {
  double policy = 0, value = 0, entropy = 0, kl = 0, clipped = 0;
  void Add(const LossSums& other, double weight) {
    policy += weight * other.policy;
    value += weight * other.value;
    entropy += weight * other.entropy;
    kl += weight * other.kl;
    clipped += weight * other.clipped;
  }
  void Visit(Archive& archive) {
    archive("policy", policy);
    archive("value", value);
    archive("entropy", entropy);
    archive("kl", kl);
    archive("clipped", clipped);
  }
};

/// Rows of the largest minibatch that `ppo` cuts from the rollouts of `slots` agents.
std::int64_t LargestMinibatch(const PpoOptions& ppo, std::int64_t slots);

/// See learner.h. An update may be learned in pieces and saved between them.
class Ppo final : public Learner, private BlockLoss {
 public:
  Ppo(const LearnerOptions& options, const PpoOptions& ppo, nn::Network network, std::string hyperparameters);

  Batch Stage(std::span<const std::int32_t> slots) override;
  void Begin(const Batch& batch) override;
  void Act(Batch& batch) override;
  void Record(const Batch& batch) override;
  bool LearningDue() const override { return rollout_.full(); }
  bool Learn(const LearnBudget& budget) override;
  std::int64_t steps() const override { return steps_; }
  std::int64_t updates() const override { return updates_; }
  std::int64_t steps_per_update() const override { return ppo_.n_steps * behaviour_.slots; }
  void SetTotalSteps(std::int64_t total_steps) override { total_steps_ = total_steps; }
  std::span<const Metric> metrics() const override { return metrics_; }
  Status health() const override { return health_; }
  PolicyData Snapshot() const override;
  void Visit(Archive& archive) override;

 private:
  // Acting and collecting.
  void Encode(const std::byte* observations, std::int64_t rows, float* features);
  void EncodeNormalised(const std::byte* observations, std::int64_t rows, float* features);
  void RefreshNormaliser();
  void NormaliseRewards(const Batch& batch);
  void BootstrapTruncated(const Batch& batch);
  void ValuesOf(const float* features, std::int64_t rows, float* values);

  // Learning.
  void BeginUpdate();
  void BeginEpoch();
  void BeginMinibatch();
  bool OptimiserStep();
  void FinishUpdate();
  void Gather(const LossBlock& block) override;
  void Loss(const LossBlock& block) override;
  double Remaining() const;
  void WriteMetrics();
  void WriteMetricsOf2(const LossSums& means, double explained_variance);
  void WriteMetricsOf3(const LossSums& means, double explained_variance);

  std::span<const std::int32_t> minibatch() const {
    return std::span(order_).subspan(static_cast<std::size_t>(minibatch_begin_),
                                     static_cast<std::size_t>(minibatch_rows_));
  }
  std::span<float> log_std() {
    return std::span(parameters_).subspan(static_cast<std::size_t>(network_.parameter_count()));
  }

  const BehaviourSpec behaviour_;
  const PpoOptions ppo_;
  const nn::Network network_;
  const std::string hyperparameters_;  // JSON, for the model file
  const Executor executor_;
  const std::int64_t features_, raw_size_, mask_bytes_;
  std::int64_t total_steps_;

  std::vector<float> parameters_;  // network, then log_std
  nn::Evaluator evaluator_;        // packed copy that acts
  Backpropagation backpropagation_;
  Adam adam_;
  Rollout rollout_;
  Rng action_rng_, shuffle_rng_;

  RunningMoments observation_moments_, return_moments_;
  ObservationNormaliser normaliser_;
  std::vector<float> discounted_;  // [N] running discounted return per slot, for reward scaling

  // The step that each slot is taking, from Act to Record.
  std::vector<float> step_features_;               // [N, F] network inputs
  std::vector<float> step_raw_;                    // [N, raw]
  std::vector<float> step_values_, step_neglogp_;  // [N]

  // Work space, row by row of a batch.
  std::vector<float> part_raw_, part_neglogp_;  // [N, raw], [N] where a part of the slots acts
  std::vector<float> step_rewards_;             // [N]
  std::vector<float> work_features_;            // [N, F]
  std::vector<float> last_values_;              // [N] of each slot's latest observation

  std::vector<float> slab_features_;  // [T * N, F] network inputs as they were acted upon

  // The update under way.
  bool updating_ = false, stopped_ = false;
  std::int64_t epoch_ = 0, minibatch_begin_ = 0, minibatch_rows_ = 0, rows_ = 0;
  std::int64_t gradient_steps_ = 0, skipped_steps_ = 0, epoch_gradient_steps_ = 0;
  float learning_rate_ = 0, clip_range_ = 0, clip_range_vf_ = 0;  // of this update; negative clip_range_vf: off
  std::vector<std::int32_t> order_;                               // [T * N] slab rows, shuffled each epoch
  LossSums update_sums_, epoch_sums_, last_sums_;  // sums of minibatch means; epoch: of the one under way

  // The minibatch under way, gathered.
  std::vector<float> mb_advantages_, mb_returns_, mb_values_, mb_neglogp_;  // [B]
  std::vector<float> mb_raw_;                                               // [B, raw]
  std::vector<std::uint8_t> mb_masks_;                                      // [B, mask_bytes]
  std::vector<HeadGradient> heads_;                                         // [blocks]
  std::vector<LossSums> block_sums_;                                        // [blocks]

  std::int64_t steps_ = 0, updates_ = 0, epochs_ = 0;  // in all
  Status health_;
  std::vector<Metric> metrics_;
};

}  // namespace consac::learn
