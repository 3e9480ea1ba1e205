#include "report/axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace consac::run {
namespace {

double RoundStep(double rough) {
  const double power = std::pow(10.0, std::floor(std::log10(rough))), digit = rough / power;
  return power * (digit < 1.5 ? 1.0 : digit < 3.5 ? 2.0 : digit < 7.5 ? 5.0 : 10.0);
}

// Fixed notation with the digits that a multiple of `step` needs.
std::string Fixed(double value, double step) {
  const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  return fmt::format("{:.{}f}", value, digits);
}

}  // namespace

Axis MakeAxis(double low, double high, int wanted) {
  const double widest = std::max({std::fabs(low), std::fabs(high), 1e-6});
  if (high - low < 1e-9 * widest) {
    low -= 0.05 * widest;
    high += 0.05 * widest;
  }
  Axis axis{low, high, {}, RoundStep((high - low) / wanted)};
  const double first = std::ceil(low / axis.step - 1e-9), last = std::floor(high / axis.step + 1e-9);
  for (double i = first; i <= last; ++i) axis.ticks.push_back(i * axis.step);
  return axis;
}

std::string TickText(double value, const Axis& axis) {
  if (std::fabs(value) < axis.step * 1e-6) return "0";
  const double widest = std::max(std::fabs(axis.low), std::fabs(axis.high));
  if (widest >= 1e12 || widest < 1e-4) return fmt::format("{:.6g}", value);
  if (widest >= 1e9) return Fixed(value / 1e9, axis.step / 1e9) + "G";
  if (widest >= 1e6) return Fixed(value / 1e6, axis.step / 1e6) + "M";
  if (widest >= 1e4) return Fixed(value / 1e3, axis.step / 1e3) + "k";
  return Fixed(value, axis.step);
}

}  // namespace consac::run
