#pragma once
// What is wrong with a row of observations, whoever sent it: for RESULT's judge and RELABEL's reader. Private to core.

#include "consac/protocol/result_check.h"

namespace consac::protocol2 {

/// The first leaf that breaks R73 or R75; none where nothing is wrong.
struct RowFault {
  const Leaf* leaf = nullptr;
  bool non_finite = false;   ///< R75
  std::int64_t element = 0;  ///< R73: which, what it is, and what it may be
  double value = 0.0, low = 0.0, high = 0.0;
};

/// Of that leaf alone.
RowFault FindLeafFault(const Leaf& leaf, const std::byte* row, Numbers numbers);
/// Whole numbers are looked at, and where `numbers` are judged floating-point ones too.
RowFault FindRowFault(const Layout& layout, const std::byte* row, Numbers numbers);

}  // namespace consac::protocol2
