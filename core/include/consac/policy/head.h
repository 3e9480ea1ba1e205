#pragma once
// From network outputs to actions: one distribution per leaf of the action space. Used to act (here) and, for
// log-probabilities, entropies and their gradients, by learn/grad. No allocation.
// Discrete: categorical logits [n]. MultiDiscrete: concatenated logits [sum(nvec)]. MultiBinary: Bernoulli logits [n].
// Box: diagonal Gaussian, mean [count] from the network and a free log standard deviation [count] per action space.

#include <cstdint>
#include <span>

#include "consac/base/rng.h"
#include "consac/space/layout.h"

namespace consac {

/// Numbers that the network must put out for `action`.
std::int64_t HeadSize(const Layout& action);
/// Free log-std parameters for `action`: elements of its Box leaves.
std::int64_t LogStdSize(const Layout& action);
/// Elements of one action as the learner keeps it ("raw"): Box elements *unclipped*, indices for discrete leaves.
std::int64_t RawActionSize(const Layout& action);
/// Ok when a head exists for every leaf (Box leaves must be float32 and one-dimensional).
Status CheckHead(const Layout& action);

/// The logit of what a mask forbids; a forced bit has minus or plus this.
inline constexpr float kMaskedLogit = -1e8f;
/// log(2 pi), of the normal distribution's density.
inline constexpr float kLogTwoPi = 1.8378770664093453f;
/// log(1 + exp(x)) without overflow.
float Softplus(float x);
/// The logit of a bit given its two mask bytes (0 legal, 1 legal) or null.
float MaskedBitLogit(float logit, const std::uint8_t* mask);

/// How an action is drawn from its distribution.
enum class ActionMode : std::uint8_t { kSample, kDeterministic };

/// Draws (or takes the mode of) `rows` actions. head [rows, HeadSize], log_std [LogStdSize], masks [rows, mask_bytes]
/// or null, raw [rows, RawActionSize] out, log_probability [rows] out or null. Uses `rng` only for kSample, in row
/// order.
void SelectActions(const Layout& action, const float* head, const float* log_std, const std::uint8_t* masks,
                   std::int64_t rows, ActionMode mode, Rng& rng, float* raw, float* log_probability = nullptr);
/// Turns raw actions into what the world takes: adds Discrete's start, clips Box to its bounds. out [rows, row_bytes].
void WriteActions(const Layout& action, const float* raw, std::int64_t rows, std::byte* out);
/// log p(raw | head) per row, [rows]; legal masks as in SelectActions.
void LogProbability(const Layout& action, const float* head, const float* log_std, const std::uint8_t* masks,
                    const float* raw, std::int64_t rows, float* out);
/// Entropy per row, [rows].
void Entropy(const Layout& action, const float* head, const float* log_std, const std::uint8_t* masks,
             std::int64_t rows, float* out);

}  // namespace consac
