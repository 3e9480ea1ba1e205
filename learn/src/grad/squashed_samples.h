#pragma once
// Actions drawn from squashed Gaussian heads through their noise, a = tanh(mu + sigma xi), with their log-probability,
// and the way back: from what a loss says of action and log-probability to the head's numbers. Heads that follow the
// state are drawn by one matrix for all rows, a = tanh(mu + phi W). Source: Haarnoja et al. 2018, arXiv:1801.01290,
// appendix C; Raffin et al. 2020, arXiv:2005.05719; Stable Baselines3, SquashedDiagGaussianDistribution and
// StateDependentNoiseDistribution. Private to learn.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/base/rng.h"
#include "consac/policy/head.h"
#include "grad/state_matrices.h"

namespace consac::learn {

/// A minibatch of samples. Never allocates after creation.
class SquashedSamples {
 public:
  /// At most `max_rows` rows for `head`, whose leaves are all squashed Gaussian, or all of them with a deviation that
  /// follows the state: then by `matrices`, which must stay, as they are at a Draw and the Backward after it.
  SquashedSamples(const ActionHead& head, std::int64_t max_rows, const StateMatrices* matrices = nullptr);

  /// Draws for head numbers [rows, ActionHead::size], row by row:
  /// log p(a) = sum -xi^2/2 - log sigma - log(2 pi)/2 - log(1 - a^2 + 1e-6), where sigma is the deviation over all
  /// matrices, and xi = phi W / sigma, where it follows the state. Takes of `rng` only where it does not.
  void Draw(const float* head, std::int64_t rows, Rng& rng);
  /// [rows, raw] actions from -1 to 1.
  std::span<const float> actions() const { return actions_; }
  /// [rows] log p of those.
  std::span<const float> log_probabilities() const { return log_probabilities_; }
  /// Entropy of row `row` before it is squashed, as Stable Baselines 2 reports it.
  double NormalEntropy(std::int64_t row) const;

  /// Chain rule for row `row`: d loss / d action [raw] and d loss / d log p -> d loss / d head [ActionHead::size], and
  /// d loss / d log_std [log_std_size], which is added to, where the deviation follows the state. What was clipped (log
  /// sigma, or the mean where that is asked for) has no gradient.
  void Backward(std::int64_t row, const float* d_action, float d_log_probability, float* d_head,
                float* d_log_std) const;

 private:
  struct Place {
    std::int64_t mean, log_std;  // of an element, among the head's numbers
  };
  void DrawByElements(const float* head, std::int64_t rows, Rng& rng);
  void DrawByState(const float* head, std::int64_t rows);
  void BackwardByState(std::int64_t row, const ActionHead::Part& part, std::int64_t element, float d_before,
                       float d_log_probability, float* d_head, float* d_log_std) const;

  const ActionHead head_;
  const StateMatrices* matrices_;
  std::vector<Place> places_;             // [raw]
  std::vector<float> noise_, log_stds_;   // [rows, raw] xi, log sigma
  std::vector<float> deviations_;         // [rows, raw]
  std::vector<float> actions_;            // [rows, raw]
  std::vector<std::uint8_t> clipped_;     // [rows, raw]
  std::vector<float> log_probabilities_;  // [rows]
  std::vector<float> features_;           // [rows, ActionHead::features] phi
};

}  // namespace consac::learn
