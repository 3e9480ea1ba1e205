#pragma once
// Actions that are outside their space, for the conformance cases.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "consac/space/layout.h"

namespace consac::cli {

/// What the bytes of a number in a row can hold.
inline std::pair<double, double> EndsOf(DType dtype) {
  if (dtype == DType::kF32) return {std::numeric_limits<float>::lowest(), std::numeric_limits<float>::max()};
  if (dtype == DType::kF64) return {std::numeric_limits<double>::lowest(), std::numeric_limits<double>::max()};
  const bool with_sign = dtype == DType::kI8 || dtype == DType::kI16 || dtype == DType::kI32 || dtype == DType::kI64;
  const double half = std::ldexp(1.0, static_cast<int>(8 * SizeOf(dtype)) - 1);
  return with_sign ? std::pair(-half, half - 1.0) : std::pair(0.0, 2.0 * half - 1.0);
}

/// Whether a leaf is of the kind that a case names: a space's type, or BOOL; "" is any.
inline bool IsOfKind(const Leaf& leaf, const std::string& kind) {
  switch (leaf.space.kind()) {
    case SpaceKind::kDiscrete:
      return kind.empty() || kind == "discrete";
    case SpaceKind::kMultiDiscrete:
      return kind.empty() || kind == "multi_discrete";
    case SpaceKind::kMultiBinary:
      return kind.empty() || kind == "multi_binary";
    default:
      return kind.empty() || kind == (leaf.dtype == DType::kBool ? "BOOL" : "box");
  }
}

/// On which side of its space a number is.
enum class Side : std::uint8_t { kAny, kBelow };

inline bool IsFloat(const Leaf& leaf) {
  return leaf.dtype == DType::kF32 || leaf.dtype == DType::kF64;
}

/// The last number of a leaf is above what its space has, or below it where `side` says so or its type holds none
/// above; false where its type holds no such number.
inline bool LeaveSpace(const Leaf& leaf, Side side, std::byte* row) {
  const auto [least, most] = EndsOf(leaf.dtype);
  const auto [low, high] = ElementBounds(leaf, leaf.count - 1);
  const double over = leaf.dtype == DType::kBool ? 2.0 : high + std::max(1.0, IsFloat(leaf) ? std::fabs(high) : 1.0);
  const double under = low - std::max(1.0, IsFloat(leaf) ? std::fabs(low) : 1.0);
  const bool above = side == Side::kAny && over <= most, below = under >= least;
  if (above || below) WriteElement(leaf, row, leaf.count - 1, above ? over : under);
  return above || below;
}

/// The last leaf of that kind that can leaves its space ("..., below": below it), or is NaN where any kind will do;
/// false where none can.
inline bool MakeIllegal(const Layout& layout, const std::string& what, std::byte* row) {
  constexpr std::string_view kBelow = ", below";
  const Side side = what.ends_with(kBelow) ? Side::kBelow : Side::kAny;
  const std::string kind = what.substr(0, what.size() - (side == Side::kBelow ? kBelow.size() : 0));
  for (std::size_t i = layout.leaves.size(); i-- > 0;) {
    if (IsOfKind(layout.leaves[i], kind) && LeaveSpace(layout.leaves[i], side, row)) return true;
  }
  for (const Leaf& leaf : layout.leaves) {
    if (!kind.empty() || !IsFloat(leaf)) continue;
    WriteElement(leaf, row, 0, std::numeric_limits<double>::quiet_NaN());
    return true;
  }
  return false;
}

/// The last number of every floating-point leaf is `value`; false where there is none.
inline bool MakeNonFinite(const Layout& layout, double value, std::byte* row) {
  bool written = false;
  for (const Leaf& leaf : layout.leaves) {
    if (!IsFloat(leaf)) continue;
    WriteElement(leaf, row, leaf.count - 1, value);
    written = true;
  }
  return written;
}

}  // namespace consac::cli
