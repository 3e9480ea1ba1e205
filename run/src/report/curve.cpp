#include "report/curve.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace consac::run {

EpisodeCurve::EpisodeCurve() {
  for (std::vector<double>* column : {&steps_, &rewards_, &means_}) column->reserve(kCapacity);
}

void EpisodeCurve::Add(std::int64_t step, double reward, double mean) {
  if (!std::isfinite(reward) || !std::isfinite(mean)) return;
  last_step_ = static_cast<double>(step);
  last_reward_ = reward;
  last_mean_ = mean;
  if (count_++ % stride_ != 0) return;
  if (steps_.size() == kCapacity) HalvePoints();
  steps_.push_back(last_step_);
  rewards_.push_back(reward);
  means_.push_back(mean);
}

void EpisodeCurve::HalvePoints() {
  for (std::vector<double>* column : {&steps_, &rewards_, &means_}) {
    for (std::size_t i = 0; 2 * i < column->size(); ++i) (*column)[i] = (*column)[2 * i];
    column->resize((column->size() + 1) / 2);
  }
  stride_ *= 2;
}

std::vector<CurvePoint> EpisodeCurve::Points() const {
  std::vector<CurvePoint> points;
  for (std::size_t i = 0; i < steps_.size(); ++i) points.push_back({steps_[i], rewards_[i], means_[i]});
  if (count_ > 0 && (count_ - 1) % stride_ != 0) points.push_back({last_step_, last_reward_, last_mean_});
  return points;
}

void EpisodeCurve::Visit(Archive& archive) {
  archive("steps", steps_);
  archive("rewards", rewards_);
  archive("means", means_);
  archive("last_step", last_step_);
  archive("last_reward", last_reward_);
  archive("last_mean", last_mean_);
  archive("count", count_);
  archive("stride", stride_);
  if (!archive.loading()) return;
  // Bytes from a file: whatever they hold, adding to the curve stays safe.
  const std::size_t kept = std::min({steps_.size(), rewards_.size(), means_.size(), kCapacity});
  for (std::vector<double>* column : {&steps_, &rewards_, &means_}) {
    column->resize(kept);
    column->reserve(kCapacity);
  }
  stride_ = std::max<std::int64_t>(stride_, 1);
}

void StepCurve::Add(std::int64_t step, double reward_sum, std::int64_t count) {
  if (step < 0 || count <= 0 || !std::isfinite(reward_sum)) return;
  while (step >> shift_ >= static_cast<std::int64_t>(kPieces)) MergePieces();
  latest_ = step >> shift_;
  const auto piece = static_cast<std::size_t>(latest_);
  sums_[piece] += reward_sum;
  counts_[piece] += static_cast<double>(count);
}

void StepCurve::MergePieces() {
  for (std::vector<double>* column : {&sums_, &counts_}) {
    const auto middle = column->begin() + kPieces / 2;
    for (std::size_t i = 0; i < kPieces / 2; ++i) (*column)[i] = (*column)[2 * i] + (*column)[2 * i + 1];
    std::fill(middle, column->end(), 0.0);
  }
  ++shift_;
}

std::vector<CurvePoint> StepCurve::Points() const {
  std::vector<CurvePoint> points;
  for (std::size_t i = 0; i < kPieces; ++i) {
    if (counts_[i] > 0.0)
      points.push_back({std::ldexp(static_cast<double>(i) + 0.5, shift_), sums_[i] / counts_[i], 0.0});
  }
  const std::size_t window = std::max<std::size_t>(1, points.size() / kWindowShare);
  double sum = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum += points[i].value - (i >= window ? points[i - window].value : 0.0);
    points[i].mean = sum / static_cast<double>(std::min(i + 1, window));
  }
  return points;
}

double StepCurve::RecentMean() const {
  double sum = 0.0, count = 0.0;
  for (std::int64_t i = std::max<std::int64_t>(0, latest_ - kRecentPieces + 1); i <= latest_; ++i) {
    sum += sums_[static_cast<std::size_t>(i)];
    count += counts_[static_cast<std::size_t>(i)];
  }
  return sum / count;
}

void StepCurve::Visit(Archive& archive) {
  archive("shift", shift_);
  archive("latest", latest_);
  archive("sums", std::span<double>(sums_));
  archive("counts", std::span<double>(counts_));
  shift_ = std::clamp(shift_, 0, 62);
  latest_ = std::clamp<std::int64_t>(latest_, 0, static_cast<std::int64_t>(kPieces) - 1);
}

}  // namespace consac::run
