#include "consac/policy/normaliser.h"

#include <algorithm>
#include <cmath>

namespace consac {

RunningMoments::RunningMoments(std::int64_t size)
    : mean(static_cast<std::size_t>(size), 0.0), variance(static_cast<std::size_t>(size), 1.0) {}

// Source: Chan, Golub and LeVeque 1979, the update of two samples' moments, as in Stable Baselines' RunningMeanStd.
void RunningMoments::Update(const float* samples, std::int64_t rows) {
  if (rows <= 0) return;
  const std::size_t size = mean.size();
  const auto batch_count = static_cast<double>(rows);
  const double total = count + batch_count;
  for (std::size_t d = 0; d < size; ++d) {
    double sum = 0.0;
    for (std::int64_t r = 0; r < rows; ++r) sum += samples[static_cast<std::size_t>(r) * size + d];
    const double batch_mean = sum / batch_count;
    double squares = 0.0;
    for (std::int64_t r = 0; r < rows; ++r) {
      const double deviation = samples[static_cast<std::size_t>(r) * size + d] - batch_mean;
      squares += deviation * deviation;
    }
    const double delta = batch_mean - mean[d];
    mean[d] += delta * batch_count / total;
    variance[d] = (variance[d] * count + squares + delta * delta * count * batch_count / total) / total;
  }
  count = total;
}

void RunningMoments::Merge(const RunningMoments& other) {
  if (other.count <= 0.0) return;
  const double total = count + other.count;
  for (std::size_t d = 0; d < mean.size(); ++d) {
    const double delta = other.mean[d] - mean[d];
    mean[d] += delta * other.count / total;
    variance[d] =
        (variance[d] * count + other.variance[d] * other.count + delta * delta * count * other.count / total) / total;
  }
  count = total;
}

void RunningMoments::Visit(Archive& archive) {
  archive("mean", std::span<double>(mean));
  archive("variance", std::span<double>(variance));
  archive("count", count);
}

ObservationNormaliser ObservationNormaliser::Of(const RunningMoments& moments, double epsilon, double clip) {
  ObservationNormaliser normaliser;
  normaliser.clip = static_cast<float>(clip);
  for (std::size_t d = 0; d < moments.mean.size(); ++d) {
    normaliser.mean.push_back(static_cast<float>(moments.mean[d]));
    normaliser.scale.push_back(static_cast<float>(1.0 / std::sqrt(moments.variance[d] + epsilon)));
  }
  return normaliser;
}

void ObservationNormaliser::Apply(float* features, std::int64_t rows) const {
  const std::size_t size = mean.size();
  for (std::int64_t r = 0; r < rows; ++r) {
    float* row = features + static_cast<std::size_t>(r) * size;
    for (std::size_t d = 0; d < size; ++d) row[d] = std::clamp((row[d] - mean[d]) * scale[d], -clip, clip);
  }
}

}  // namespace consac
