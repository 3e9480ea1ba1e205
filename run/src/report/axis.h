#pragma once
// Round numbers for the axes of a picture.

#include <string>
#include <vector>

namespace consac::run {

/// A range of numbers with ticks at round ones (1, 2 or 5 times a power of ten apart).
struct Axis {
  double low = 0.0;           ///< where the axis begins
  double high = 1.0;          ///< where it ends
  std::vector<double> ticks;  ///< ascending, within the range
  double step = 1.0;          ///< between two ticks
};

/// An axis over [low, high] with about `wanted` ticks. A range without width is widened.
Axis MakeAxis(double low, double high, int wanted);
/// "0", "2500", "20k", "1.5M", "-0.25": a tick's text, in the axis' unit and with no more digits than its step has.
std::string TickText(double value, const Axis& axis);

}  // namespace consac::run
