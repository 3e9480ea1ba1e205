#pragma once
// Rows of a rollout side by side, as a loss over a minibatch reads them, and the policy's head for each of its blocks.
// Gather and Head may be called for different blocks from different threads. Private to learn.

#include <vector>

#include "collect/rollout_collector.h"
#include "consac/learn/grad/backpropagation.h"
#include "grad/head_gradient.h"

namespace consac::learn {

/// Room for one minibatch.
class RolloutMinibatch {
 public:
  /// For minibatches of at most `max_rows` rows of `behaviour` on each of `ranks`, learned by `head`.
  RolloutMinibatch(const BehaviourSpec& behaviour, const HeadGradient& head, std::int64_t max_rows,
                   const Communicator& ranks = {});

  /// The minibatch is `rows` of the slab from now on; they must stay until the next Begin. Fills `advantages`.
  void Begin(const RolloutCollector& collector, std::span<const std::int32_t> rows);
  /// How advantages are standardised: with n or n - 1 in the deviation.
  enum class Deviation : std::uint8_t { kPopulation, kSample };
  /// Takes mean and deviation out of `advantages`; leaves a single row alone.
  /// Source: Stable Baselines, ppo2.py (n) and ppo.py of 3 (n - 1).
  void StandardiseAdvantages(Deviation deviation);
  /// Copies the block's rows into its network inputs and into the columns below.
  void Gather(const LossBlock& block);
  /// Runs the policy's head over the block's first output.
  HeadGradient& Head(const LossBlock& block, const float* log_std);

  /// Rows of the minibatch here.
  std::int64_t size() const { return static_cast<std::int64_t>(rows_.size()); }
  /// Rows of the minibatch on all ranks: what its means divide by.
  std::int64_t total() const { return total_; }

  std::vector<float> advantages, returns, values, neglogp;  // [B]

 private:
  const RolloutCollector* collector_ = nullptr;
  std::span<const std::int32_t> rows_;
  Communicator ranks_;
  std::int64_t total_ = 0;
  std::size_t feature_count_, raw_size_, mask_bytes_;
  std::vector<float> raw_;           // [B, raw]
  std::vector<std::uint8_t> masks_;  // [B, mask_bytes]
  std::vector<HeadGradient> heads_;  // [blocks]
};

}  // namespace consac::learn
