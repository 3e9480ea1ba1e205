#pragma once
// What the learning curve is drawn from, in bounded memory however long a run is. Drawing is curve_drawing.h.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "consac/base/archive.h"

namespace consac::run {

/// A point of a curve: a value as it came, and its mean over the latest ones.
struct CurvePoint {
  double step = 0.0;
  double value = 0.0;
  double mean = 0.0;
};

/// Every episode; once kCapacity are kept, every second, every fourth, ...
class EpisodeCurve {
 public:
  /// Points that are kept at most.
  static constexpr std::size_t kCapacity = 4096;
  EpisodeCurve();
  /// An episode ended at `step`; `mean` is over the last 100. Never allocates.
  void Add(std::int64_t step, double reward, double mean);
  /// In the order of their steps; the latest episode is always the last.
  std::vector<CurvePoint> Points() const;
  /// Everything.
  void Visit(Archive& archive);

 private:
  void HalvePoints();

  std::vector<double> steps_, rewards_, means_;  // capacity kCapacity from the start
  double last_step_ = 0.0, last_reward_ = 0.0, last_mean_ = 0.0;
  std::int64_t count_ = 0, stride_ = 1;
};

/// Mean reward of a step over equal pieces of a run, for worlds whose episodes do not end. When the pieces are used
/// up, neighbours are merged.
class StepCurve {
 public:
  /// Pieces; even.
  static constexpr std::size_t kPieces = 1024;
  StepCurve() : sums_(kPieces), counts_(kPieces) {}
  /// `count` steps up to `step` brought `reward_sum`. Never allocates.
  void Add(std::int64_t step, double reward_sum, std::int64_t count);
  /// One point for each piece that holds steps; the mean is over the last twentieth of them.
  std::vector<CurvePoint> Points() const;
  /// Mean over the latest pieces; NaN before the first step.
  double RecentMean() const;
  /// Everything.
  void Visit(Archive& archive);

 private:
  void MergePieces();

  static constexpr std::size_t kWindowShare = 20;  // the mean is over a twentieth of the curve
  static constexpr std::int64_t kRecentPieces = 32;

  std::int32_t shift_ = 0;             // a piece is 2^shift_ steps
  std::int64_t latest_ = 0;            // piece of the latest step
  std::vector<double> sums_, counts_;  // [kPieces]
};

}  // namespace consac::run
