#include "protocol/row_fault.h"

#include <cstring>

namespace consac::protocol2 {
namespace {

/// Whether one of `count` floating-point numbers is NaN or infinite: its exponent has every bit.
template <class Bits>
bool HasNonFinite(const std::byte* at, std::int64_t count, Bits exponent) {
  Bits found = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    Bits bits;
    std::memcpy(&bits, at + static_cast<std::size_t>(i) * sizeof(bits), sizeof(bits));
    found |= static_cast<Bits>((bits & exponent) == exponent);
  }
  return found != 0;
}

bool LeafHasNonFinite(const Leaf& leaf, const std::byte* row) {
  if (leaf.dtype == DType::kF32) return HasNonFinite<std::uint32_t>(row + leaf.offset, leaf.count, 0x7F800000u);
  if (leaf.dtype == DType::kF64) return HasNonFinite<std::uint64_t>(row + leaf.offset, leaf.count, 0x7FF0000000000000u);
  return false;
}

}  // namespace

RowFault FindLeafFault(const Leaf& leaf, const std::byte* row, Numbers numbers) {
  if (leaf.space.kind() == SpaceKind::kBox) {
    const bool wrong = numbers == Numbers::kJudged && LeafHasNonFinite(leaf, row);
    return wrong ? RowFault{&leaf, true} : RowFault{};
  }
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const double value = ReadElement(leaf, row, i);
    const auto [low, high] = ElementBounds(leaf, i);
    if (value < low || value > high) return {&leaf, false, i, value, low, high};
  }
  return {};
}

RowFault FindRowFault(const Layout& layout, const std::byte* row, Numbers numbers) {
  for (const Leaf& leaf : layout.leaves) {
    const RowFault fault = FindLeafFault(leaf, row, numbers);
    if (fault.leaf != nullptr) return fault;
  }
  return {};
}

}  // namespace consac::protocol2
