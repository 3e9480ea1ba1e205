#pragma once
// Transitions drawn from a replay, side by side, as a loss over a minibatch reads them. Gather may be called for
// different blocks from different threads. Private to learn.

#include <vector>

#include "collect/replay_collector.h"
#include "consac/learn/grad/backpropagation.h"

namespace consac::learn {

/// Room for one minibatch.
class ReplayMinibatch {
 public:
  /// Of `rows` transitions of `behaviour` on each of `ranks`, each looking `n_steps` ahead.
  ReplayMinibatch(const BehaviourSpec& behaviour, std::int64_t rows, std::int64_t n_steps,
                  const Communicator& ranks = {});

  /// Draws anew and fills the columns below; `beta` is the exponent of the weights where the replay is prioritised.
  /// Where the collector says so, the first rows have another goal than was meant. False where the world does not say
  /// what those would have paid (the collector's health): then nothing has been drawn.
  [[nodiscard]] bool Draw(ReplayCollector& collector, double beta);
  /// Copies the observations that the block's rows were acted upon into its first input.
  void Gather(const LossBlock& block) const;
  /// The observations that all rows were acted upon, [B, F].
  void Encode(float* features) const;
  /// What was done in row `i`, [raw].
  const float* raw_action(std::size_t i) const { return collector_->replay().raw_action(places_[i]); }
  /// Tells the replay's priorities of `errors`.
  void SetPriorities();

  /// Rows of the minibatch here.
  std::int64_t size() const { return static_cast<std::int64_t>(places_.size()); }
  /// Rows of the minibatch on all ranks: what its means divide by.
  std::int64_t total() const { return ranks_ * size(); }

  std::vector<float> rewards;                   // [B] of n steps, discounted
  std::vector<double> discounts;                // [B] of what follows them; 0: nothing does
  std::vector<float> weights;                   // [B] of the loss; 1 without priorities
  std::vector<float> next_features;             // [B, F] what they led to
  std::vector<const std::uint8_t*> next_masks;  // [B] legal there, or null: everything
  std::vector<float> errors;                    // [B] how wrong the values were, for SetPriorities: the loss's to fill

 private:
  void GiveOtherGoals(std::int64_t rows);

  ReplayCollector* collector_ = nullptr;
  std::int64_t ranks_;
  std::size_t features_;
  std::int64_t n_steps_;
  std::vector<std::int64_t> places_;            // [B]
  std::vector<const std::byte*> observations_;  // [B] what they were acted upon
};

}  // namespace consac::learn
