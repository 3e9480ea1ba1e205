#pragma once
// Running mean and variance, and what VecNormalize does with them. Statistics are float64; a frozen copy travels in
// the model so that the game sees the numbers that the trainer saw. Source: Stable Baselines, VecNormalize.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/base/archive.h"

namespace consac {

/// Running moments of D numbers by Chan's parallel formula; starts at mean 0, variance 1, count 1e-4.
struct RunningMoments {
  std::vector<double> mean;      // [D]
  std::vector<double> variance;  // [D] population variance
  double count = 1e-4;           ///< samples seen

  /// Moments of `size` numbers.
  explicit RunningMoments(std::int64_t size = 0);
  /// Takes `rows` samples, [rows, D] row-major. Never allocates.
  void Update(const float* samples, std::int64_t rows);
  /// Takes samples of which only the moments are known; `other` may have seen none.
  void Merge(const RunningMoments& other);
  /// Lists mean, variance and count.
  void Visit(Archive& archive);
};

/// Observation normalisation as a policy applies it: clip((x - mean) / sqrt(variance + epsilon), +-clip).
struct ObservationNormaliser {
  std::vector<float> mean;   // [D]; empty: no normalisation
  std::vector<float> scale;  // [D] 1 / sqrt(variance + epsilon)
  float clip = 10.0f;        ///< largest absolute value after scaling

  /// Freezes the statistics.
  static ObservationNormaliser Of(const RunningMoments& moments, double epsilon, double clip);
  /// True when there is something to do.
  bool active() const { return !mean.empty(); }
  /// Normalises [rows, D] in place.
  void Apply(float* features, std::int64_t rows) const;
};

}  // namespace consac
