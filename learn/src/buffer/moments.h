#pragma once
// Mean and variance of some rows of a column. Private to learn.

#include <cstdint>
#include <span>

namespace consac::learn {

/// Mean and variance of the numbers at `rows`, population form, in float64.
struct Moments {
  double mean = 0, variance = 0;
  template <class Read>
  Moments(std::span<const std::int32_t> rows, Read&& read) {
    const auto n = static_cast<double>(rows.size());
    for (const std::int32_t row : rows) mean += read(static_cast<std::size_t>(row));
    mean /= n;
    for (const std::int32_t row : rows) {
      const double deviation = read(static_cast<std::size_t>(row)) - mean;
      variance += deviation * deviation;
    }
    variance /= n;
  }
};

}  // namespace consac::learn
