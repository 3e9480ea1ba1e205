#pragma once
// A minibatch of transitions with continuous actions, laid out as networks of observation and action read it. Private
// to learn.

#include <algorithm>
#include <span>
#include <vector>

#include "collect/replay_minibatch.h"

namespace consac::learn {

/// How it is drawn.
struct ActionMinibatchOptions {
  std::int64_t rows = 256;   ///< transitions, B
  std::int64_t n_steps = 1;  ///< that each looks ahead
  std::int64_t raw = 1;      ///< numbers of a raw action
};

/// Room for one minibatch.
class ActionMinibatch {
 public:
  /// Of transitions of `behaviour` on each of `ranks`.
  ActionMinibatch(const BehaviourSpec& behaviour, const ActionMinibatchOptions& options, const Communicator& ranks = {})
      : drawn_(behaviour, options.rows, options.n_steps, ranks),
        feature_count_(static_cast<std::size_t>(behaviour.observation_layout.feature_count)),
        raw_(static_cast<std::size_t>(options.raw)),
        features_(static_cast<std::size_t>(options.rows) * feature_count_),
        actions_(static_cast<std::size_t>(options.rows) * raw_) {}

  /// Draws anew; false as ReplayMinibatch::Draw.
  [[nodiscard]] bool Draw(ReplayCollector& collector) {
    if (!drawn_.Draw(collector, 0.0)) return false;
    drawn_.Encode(features_.data());
    for (std::size_t i = 0; i < static_cast<std::size_t>(size()); ++i)
      std::copy_n(drawn_.raw_action(i), raw_, actions_.data() + i * raw_);
    return true;
  }

  /// Rows here.
  std::int64_t size() const { return drawn_.size(); }
  /// Rows on all ranks: what means divide by.
  std::int64_t total() const { return drawn_.total(); }
  /// [B, F] what was seen
  std::span<const float> features() const { return features_; }
  /// [B, raw] what was done
  std::span<const float> actions() const { return actions_; }
  /// [B, F] what it led to after n steps
  std::span<const float> next_features() const { return drawn_.next_features; }
  /// [B] what those brought, discounted
  std::span<const float> rewards() const { return drawn_.rewards; }
  /// [B] of what follows them; 0: nothing does
  std::span<const double> discounts() const { return drawn_.discounts; }

  /// Copies the block's rows of what was seen into its first input.
  void Gather(const LossBlock& block) const { Copy(block, features_, feature_count_, 0); }
  /// The same, and those of `actions` [B, raw] into its second.
  void Gather(const LossBlock& block, std::span<const float> actions) const {
    Gather(block);
    Copy(block, actions, raw_, 1);
  }

 private:
  static void Copy(const LossBlock& block, std::span<const float> rows, std::size_t size, std::size_t input) {
    std::copy_n(rows.data() + static_cast<std::size_t>(block.first_row) * size,
                static_cast<std::size_t>(block.rows) * size, block.inputs[input]);
  }

  ReplayMinibatch drawn_;
  std::size_t feature_count_, raw_;
  std::vector<float> features_;  // [B, F]
  std::vector<float> actions_;   // [B, raw]
};

}  // namespace consac::learn
