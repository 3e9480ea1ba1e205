#pragma once
// From network outputs to actions: one distribution (policy/distribution.h) per leaf of the action space. Used to act
// (here) and, for log-probabilities, entropies and their gradients, by learn/grad. No allocation per action.
// By default: Discrete categorical logits [n], MultiDiscrete concatenated logits [sum(nvec)], MultiBinary Bernoulli
// logits [n], Box diagonal Gaussian, mean [count] from the network and a free log standard deviation [count]. Behind
// the numbers of all leaves stand those of the last hidden layer where a head follows the state.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "consac/policy/distribution.h"

namespace consac {

/// Which distribution a leaf of the action has, as the model file names it.
struct HeadSpec {
  std::string leaf;       ///< path of the leaf, "" when the action is one leaf
  std::string type;       ///< a name of the table: "categorical", "q_values"
  StateNoise noise = {};  ///< where the distribution follows the state: how
  friend bool operator==(const HeadSpec&, const HeadSpec&) = default;
};

/// The exploration matrices of slots, for heads that follow the state.
struct SlotNoise {
  const float* matrices = nullptr;      ///< [slots, ActionHead::exploration_size]; null: nobody keeps any
  const std::int32_t* slots = nullptr;  ///< [rows] whose each row is; null: row r is slot r
};

/// The heads that an action has where nothing else is said.
std::vector<HeadSpec> DefaultHeads(const Layout& action);

/// An action's leaves with their distributions: what acts, and what a learner differentiates.
class ActionHead {
 public:
  /// One leaf's part.
  struct Part {
    Leaf leaf;                                   ///< of the action
    const Distribution* distribution = nullptr;  ///< how it follows from the network
    std::int64_t head_offset = 0;                ///< its first number among the network's
    std::int64_t head_size = 0;                  ///< how many
    std::int64_t log_std_offset = 0;             ///< its first free log standard deviation
    std::int64_t raw_offset = 0;                 ///< its first element of a raw action
    StateNoise noise = {};                       ///< how it follows the state, where it does
    std::int64_t exploration_offset = 0;         ///< its matrix among a slot's
  };

  /// One head per leaf in the leaves' order; without heads, the defaults. The error names the leaf and what it may be.
  static Result<ActionHead> Create(const Layout& action, std::span<const HeadSpec> heads = {});

  /// Numbers that the network must put out.
  std::int64_t size() const { return size_; }
  /// Free log standard deviations.
  std::int64_t log_std_size() const { return log_std_size_; }
  /// Elements of one action as the learner keeps it ("raw"): Box elements as they were drawn, indices from 0 of
  /// discrete leaves.
  std::int64_t raw_size() const { return raw_size_; }
  /// Numbers of the last hidden layer that heads which follow the state read; they stand behind all heads, once.
  std::int64_t features() const { return features_; }
  /// Where those begin in a row.
  std::int64_t features_offset() const { return size_ - features_; }
  /// Floats of a slot's exploration matrices; 0: no head follows the state.
  std::int64_t exploration_size() const { return exploration_size_; }
  /// Actions for which a slot's matrices last, StateNoise::sample_freq.
  std::int64_t sample_freq() const { return sample_freq_; }
  /// Draws a slot's matrices, [exploration_size].
  void DrawExploration(const float* log_std, Rng& rng, float* matrices) const;
  /// Leaf by leaf.
  std::span<const Part> parts() const { return parts_; }
  /// Names, for the model.
  std::vector<HeadSpec> specs() const;

  /// Draws (or takes the mode of) `rows` actions. head [rows, size], log_std [log_std_size], masks [rows, mask_bytes]
  /// or null, raw [rows, raw_size] out, log_probability [rows] out or null. Uses `rng` only for kSample, in row order;
  /// heads that follow the state draw by `noise` instead where it has matrices.
  void Select(const float* head, const float* log_std, const std::uint8_t* masks, std::int64_t rows, ActionMode mode,
              Rng& rng, float* raw, float* log_probability = nullptr, const SlotNoise& noise = {}) const;
  /// Turns raw actions into what the world takes: adds Discrete's start, brings Box into its bounds. out
  /// [rows, row_bytes].
  void Write(const float* raw, std::int64_t rows, std::byte* out) const;
  /// log p(raw | head) per row, [rows]; legal masks as in Select.
  void LogProbability(const float* head, const float* log_std, const std::uint8_t* masks, const float* raw,
                      std::int64_t rows, float* out) const;
  /// Entropy per row, [rows].
  void Entropy(const float* head, const float* log_std, const std::uint8_t* masks, std::int64_t rows, float* out) const;
  /// KL(from || to) per row, [rows]; heads [rows, size], both under the same masks.
  void Kl(const float* from, const float* from_log_std, const float* to, const float* to_log_std,
          const std::uint8_t* masks, std::int64_t rows, float* out) const;

 private:
  HeadRow RowOf(const Part& part, std::int64_t row, const float* head, const float* log_std,
                const std::uint8_t* masks) const;

  std::vector<Part> parts_;
  std::size_t row_bytes_ = 0;
  std::int64_t size_ = 0, log_std_size_ = 0, raw_size_ = 0, mask_bytes_ = 0;
  std::int64_t features_ = 0, exploration_size_ = 0, sample_freq_ = -1;
};

}  // namespace consac
