#pragma once
// Mean and variance of some rows of a column, on one rank or on all. Private to learn.

#include <cstdint>
#include <span>

#include "consac/base/communicator.h"

namespace consac::learn {

/// Mean and variance of the numbers at `rows` of every rank, population form, in float64.
struct Moments {
  double count = 0, mean = 0, variance = 0;
  template <class Read>
  Moments(std::span<const std::int32_t> rows, Read&& read, const Communicator& ranks = {}) {
    count = ranks.Sum(static_cast<double>(rows.size()));
    for (const std::int32_t row : rows) mean += read(static_cast<std::size_t>(row));
    mean = ranks.Sum(mean) / count;
    for (const std::int32_t row : rows) {
      const double deviation = read(static_cast<std::size_t>(row)) - mean;
      variance += deviation * deviation;
    }
    variance = ranks.Sum(variance) / count;
  }
};

}  // namespace consac::learn
