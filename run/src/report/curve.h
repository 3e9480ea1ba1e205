#pragma once
// The picture of the learning curve: reward over agent steps, as SVG and PNG. Private to run.

#include <cstdint>
#include <string>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/status.h"

namespace consac::run {

/// Means of a value over equal pieces of the steps. When it is full, neighbours are merged and pieces double, so
/// memory stays bounded however long a run is.
class CurvePoints {
 public:
  /// `pieces` is even.
  explicit CurvePoints(std::size_t pieces = 1024);
  /// `weight` values with this sum, that came at `step`.
  void Add(std::int64_t step, double sum, double weight);
  /// Points (step, mean) of the pieces that hold any.
  std::vector<std::pair<double, double>> Points() const;
  /// Everything.
  void Visit(Archive& archive);

 private:
  std::int64_t width_ = 1;                    // steps of one piece
  std::vector<double> sums_, weights_;        // [pieces]
};

/// What stands around the curve.
struct CurveLabels {
  std::string title;    ///< above
  std::string y_axis;   ///< beside
};

/// Draws points and their moving mean to `path`.svg and `path`.png.
Status DrawCurve(const std::string& path, const CurveLabels& labels, const std::vector<std::pair<double, double>>& points);

}  // namespace consac::run
