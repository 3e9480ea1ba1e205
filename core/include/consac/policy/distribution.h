#pragma once
// The table of distributions: how a leaf of the action space follows from the numbers that a network puts out for it.
// A new one is a file in core/src/policy with these functions, its gradient in learn/src/grad, and a row in each
// table. Used by policy/head.h, which puts the leaves of an action together, and by learn/grad.

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "consac/base/rng.h"
#include "consac/policy/state_noise.h"
#include "consac/space/layout.h"

namespace consac {

/// The logit of what a mask forbids; a forced bit has minus or plus this.
inline constexpr float kMaskedLogit = -1e8f;
/// log(2 pi), of the normal distribution's density.
inline constexpr float kLogTwoPi = 1.8378770664093453f;
/// Of the squashed Gaussian: what keeps log(1 - action^2) finite, and the log standard deviations that the network's
/// numbers are brought to.
inline constexpr float kSquashEpsilon = 1e-6f, kLeastLogStd = -20.0f, kMostLogStd = 2.0f;
/// log(1 + exp(x)) without overflow.
float Softplus(float x);
/// The number before tanh, of a squashed one; finite.
float Unsquashed(float raw);
/// log(1 - raw^2 + kSquashEpsilon): what the density of a squashed number is less than that of the one before.
float LogSquashSlope(float raw);
/// The logit of a bit given its two mask bytes (0 legal, 1 legal) or null.
float MaskedBitLogit(float logit, const std::uint8_t* mask);

/// How an action is drawn from its distribution.
enum class ActionMode : std::uint8_t { kSample, kDeterministic };

/// What one leaf's distribution is made of, in one row.
struct HeadRow {
  const float* head = nullptr;         ///< [head_size] from the network
  const float* log_std = nullptr;      ///< [log_std_size] free parameters
  const std::uint8_t* mask = nullptr;  ///< [leaf.mask_count] or null: everything is legal
  const StateNoise* noise = nullptr;   ///< where the distribution follows the state: how
  const float* features = nullptr;     ///< [noise->features] phi(s)
  const float* exploration = nullptr;  ///< [noise->features, leaf.count] the slot's matrix, or null: any, drawn anew
};

/// One kind of distribution. `raw` is a leaf's action as the learner keeps it: [leaf.count] indices from 0 of discrete
/// leaves, bits, numbers of Box leaves before `world_value`. None of these allocates.
struct Distribution {
  std::string_view name;           ///< as the model file says it: "categorical"
  bool (*fits)(const Leaf& leaf);  ///< whether it can be the leaf's
  bool follows_state = false;      ///< HeadRow's noise and features are there: exploration by a matrix of each slot
  /// Free log standard deviations that go with it; null: none.
  std::int64_t (*log_std_size)(const Leaf& leaf, const StateNoise& noise) = nullptr;
  /// Numbers that the network puts out for the leaf.
  std::int64_t (*head_size)(const Leaf& leaf);
  /// Draws an action or takes the mode; `rng` only for kSample.
  void (*select)(const Leaf& leaf, const HeadRow& row, ActionMode mode, Rng& rng, float* raw);
  /// log p(raw).
  float (*log_probability)(const Leaf& leaf, const HeadRow& row, const float* raw);
  /// Entropy.
  float (*entropy)(const Leaf& leaf, const HeadRow& row);
  /// KL(from || to); both under the mask of `from`.
  float (*kl)(const Leaf& leaf, const HeadRow& from, const HeadRow& to);
  /// Element `index` as the world takes it.
  double (*world_value)(const Leaf& leaf, std::int64_t index, float raw);
};

/// The row of that name, or null.
const Distribution* FindDistribution(std::string_view name);
/// All names, for messages.
std::vector<std::string_view> DistributionNames();
/// The distribution that a leaf has where nothing else is said: categorical, bernoulli or gaussian.
const Distribution& DefaultDistribution(const Leaf& leaf);

}  // namespace consac
