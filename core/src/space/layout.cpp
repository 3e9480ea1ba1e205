#include "consac/space/layout.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "consac/base/text.h"

namespace consac {
namespace {

std::size_t AlignUp(std::size_t offset, std::size_t alignment) {
  return (offset + alignment - 1) / alignment * alignment;
}

// Discrete values are small and read every step: 32 bits; bits are bytes.
DType RowType(const Space& space) {
  switch (space.kind()) {
    case SpaceKind::kDiscrete:
    case SpaceKind::kMultiDiscrete:
      return DType::kI32;
    case SpaceKind::kMultiBinary:
      return DType::kU8;
    default:
      return space.dtype();
  }
}

std::int64_t RowCount(const Space& space) {
  switch (space.kind()) {
    case SpaceKind::kDiscrete:
      return 1;
    case SpaceKind::kMultiDiscrete:
      return static_cast<std::int64_t>(space.nvec().size());
    default:
      return space.flat_size();
  }
}

std::int64_t MaskCount(const Space& space) {
  switch (space.kind()) {
    case SpaceKind::kDiscrete:
    case SpaceKind::kMultiDiscrete:
      return space.flat_size();
    case SpaceKind::kMultiBinary:
      return 2 * space.n();
    default:
      return 0;
  }
}

void AppendLeaves(const Space& space, const std::string& name, Layout& layout) {
  if (space.kind() == SpaceKind::kDict || space.kind() == SpaceKind::kTuple) {
    for (const auto& [child_name, child] : space.children()) {
      AppendLeaves(child, name.empty() ? child_name : name + "/" + child_name, layout);
    }
    return;
  }
  Leaf leaf;
  leaf.name = name;
  leaf.space = space;
  leaf.dtype = RowType(space);
  leaf.count = RowCount(space);
  leaf.offset = AlignUp(layout.row_bytes, SizeOf(leaf.dtype));
  leaf.feature_offset = layout.feature_count;
  leaf.feature_count = space.flat_size();
  leaf.mask_offset = layout.mask_bytes;
  leaf.mask_count = MaskCount(space);
  layout.row_bytes = leaf.offset + static_cast<std::size_t>(leaf.count) * SizeOf(leaf.dtype);
  layout.feature_count += leaf.feature_count;
  layout.mask_bytes += leaf.mask_count;
  layout.leaves.push_back(std::move(leaf));
}

/// Calls body(T{}) with the C++ type of a DType.
template <class Body>
auto WithRowType(DType dtype, Body&& body) {
  switch (dtype) {
    case DType::kF32:
      return body(float{});
    case DType::kF64:
      return body(double{});
    case DType::kU8:
      return body(std::uint8_t{});
    case DType::kI8:
      return body(std::int8_t{});
    case DType::kI16:
      return body(std::int16_t{});
    case DType::kI32:
      return body(std::int32_t{});
    case DType::kI64:
      return body(std::int64_t{});
    case DType::kU16:
      return body(std::uint16_t{});
    case DType::kU32:
      return body(std::uint32_t{});
    case DType::kU64:
      return body(std::uint64_t{});
    case DType::kBool:
      break;
  }
  return body(std::uint8_t{});
}

void EncodeLeaf(const Leaf& leaf, const std::byte* row, float* features) {
  switch (leaf.space.kind()) {
    case SpaceKind::kDiscrete: {
      std::fill_n(features, leaf.feature_count, 0.0f);
      const auto choice = static_cast<std::int64_t>(ReadElement(leaf, row, 0)) - leaf.space.start();
      if (choice >= 0 && choice < leaf.feature_count) features[choice] = 1.0f;
      return;
    }
    case SpaceKind::kMultiDiscrete: {
      std::fill_n(features, leaf.feature_count, 0.0f);
      for (std::int64_t i = 0; i < leaf.count; ++i) {
        const auto choice = static_cast<std::int64_t>(ReadElement(leaf, row, i));
        const std::int64_t n = leaf.space.nvec()[static_cast<std::size_t>(i)];
        if (choice >= 0 && choice < n) features[choice] = 1.0f;
        features += n;
      }
      return;
    }
    default:
      break;
  }
  WithRowType(leaf.dtype, [&](auto zero) {
    using T = decltype(zero);
    const std::byte* from = row + leaf.offset;
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      T value;
      std::memcpy(&value, from + static_cast<std::size_t>(i) * sizeof(T), sizeof(T));
      features[i] = static_cast<float>(value);
    }
  });
}

// Source: gymnasium.spaces.Box.sample: uniform where bounded, exponential where half bounded, normal where not.
double SampleBox(double low, double high, bool integer, Rng& rng) {
  const bool below = std::isfinite(low), above = std::isfinite(high);
  if (integer) return std::min(high, std::floor(rng.Between(low, high + 1.0)));
  if (below && above) return rng.Between(low, high);
  if (!below && !above) return rng.Normal();
  const double step = -std::log(1.0 - rng.UniformDouble());
  return below ? low + step : high - step;
}

double SampleElement(const Leaf& leaf, std::int64_t index, Rng& rng) {
  const auto i = static_cast<std::size_t>(index);
  switch (leaf.space.kind()) {
    case SpaceKind::kDiscrete:
      return static_cast<double>(leaf.space.start() + rng.Below(static_cast<std::uint32_t>(leaf.space.n())));
    case SpaceKind::kMultiDiscrete:
      return rng.Below(static_cast<std::uint32_t>(leaf.space.nvec()[i]));
    case SpaceKind::kMultiBinary:
      return rng.Below(2);
    default:
      break;
  }
  const bool integer = leaf.dtype != DType::kF32 && leaf.dtype != DType::kF64;
  return SampleBox(leaf.space.low()[i], leaf.space.high()[i], integer, rng);
}

}  // namespace

std::pair<double, double> ElementBounds(const Leaf& leaf, std::int64_t index) {
  const auto i = static_cast<std::size_t>(index);
  const auto start = static_cast<double>(leaf.space.start());
  switch (leaf.space.kind()) {
    case SpaceKind::kDiscrete:
      return {start, start + static_cast<double>(leaf.space.n()) - 1.0};
    case SpaceKind::kMultiDiscrete:
      return {0.0, static_cast<double>(leaf.space.nvec()[i]) - 1.0};
    case SpaceKind::kMultiBinary:
      return {0.0, 1.0};
    default:
      break;
  }
  return {leaf.space.low()[i], leaf.space.high()[i]};
}

std::vector<std::int64_t> MaskedChoices(const Layout& action) {
  std::vector<std::int64_t> choices;
  for (const Leaf& leaf : action.leaves) {
    switch (leaf.space.kind()) {
      case SpaceKind::kDiscrete:
        choices.push_back(leaf.space.n());
        break;
      case SpaceKind::kMultiDiscrete:
        choices.insert(choices.end(), leaf.space.nvec().begin(), leaf.space.nvec().end());
        break;
      case SpaceKind::kMultiBinary:
        choices.insert(choices.end(), static_cast<std::size_t>(leaf.count), 2);
        break;
      default:
        break;
    }
  }
  return choices;
}

std::int64_t ChoiceWithNothingLegal(std::span<const std::int64_t> choices, const std::uint8_t* mask) {
  for (std::size_t choice = 0; choice < choices.size(); ++choice) {
    std::uint8_t any = 0;
    for (std::int64_t i = 0; i < choices[choice]; ++i) any |= *mask++;
    if (any == 0) return static_cast<std::int64_t>(choice);
  }
  return -1;
}

Layout Layout::Of(const Space& space) {
  Layout layout;
  AppendLeaves(space, "", layout);
  std::size_t alignment = 1;
  layout.plain_floats = true;
  for (const Leaf& leaf : layout.leaves) {
    alignment = std::max(alignment, SizeOf(leaf.dtype));
    layout.plain_floats = layout.plain_floats && leaf.dtype == DType::kF32 && leaf.space.kind() == SpaceKind::kBox;
  }
  layout.row_bytes = AlignUp(layout.row_bytes, alignment);
  return layout;
}

std::optional<std::string_view> PathBelow(std::string_view part, const Leaf& leaf) {
  std::string_view rest = leaf.name;
  if (!rest.starts_with(part)) return std::nullopt;
  rest.remove_prefix(part.size());
  if (!rest.empty() && rest[0] != '/') return std::nullopt;
  return rest;
}

const Leaf* FindLeafBelow(const Layout& layout, std::string_view part, std::string_view rest) {
  for (const Leaf& leaf : layout.leaves) {
    if (PathBelow(part, leaf) == rest) return &leaf;
  }
  return nullptr;
}

void EncodeFeatures(const Layout& layout, const std::byte* data, std::int64_t rows, float* features) {
  if (layout.plain_floats) {
    std::memcpy(features, data, static_cast<std::size_t>(rows) * layout.row_bytes);
    return;
  }
  for (std::int64_t r = 0; r < rows; ++r) {
    const std::byte* row = data + static_cast<std::size_t>(r) * layout.row_bytes;
    for (const Leaf& leaf : layout.leaves)
      EncodeLeaf(leaf, row, features + r * layout.feature_count + leaf.feature_offset);
  }
}

double ReadElement(const Leaf& leaf, const std::byte* row, std::int64_t index) {
  return WithRowType(leaf.dtype, [&](auto zero) {
    decltype(zero) value;
    std::memcpy(&value, row + leaf.offset + static_cast<std::size_t>(index) * sizeof(value), sizeof(value));
    return static_cast<double>(value);
  });
}

void WriteElement(const Leaf& leaf, std::byte* row, std::int64_t index, double value) {
  WithRowType(leaf.dtype, [&](auto zero) {
    using T = decltype(zero);
    T stored;
    if constexpr (std::is_integral_v<T>) {
      constexpr T kLowest = std::numeric_limits<T>::min(), kHighest = std::numeric_limits<T>::max();
      const double whole = std::nearbyint(value);
      stored = !(whole > static_cast<double>(kLowest))  ? kLowest
               : whole >= static_cast<double>(kHighest) ? kHighest
                                                        : static_cast<T>(whole);
    } else {
      stored = static_cast<T>(value);
    }
    std::memcpy(row + leaf.offset + static_cast<std::size_t>(index) * sizeof(stored), &stored, sizeof(stored));
  });
}

void SampleRow(const Layout& layout, Rng& rng, std::byte* row) {
  for (const Leaf& leaf : layout.leaves) {
    for (std::int64_t i = 0; i < leaf.count; ++i) WriteElement(leaf, row, i, SampleElement(leaf, i, rng));
  }
}

Status CheckRow(const Layout& layout, const std::byte* row) {
  for (const Leaf& leaf : layout.leaves) {
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const double value = ReadElement(leaf, row, i);
      const auto [low, high] = ElementBounds(leaf, i);
      if (value >= low && value <= high) continue;
      const std::string where = "element " + std::to_string(i) + (leaf.name.empty() ? "" : " of '" + leaf.name + "'");
      if (!std::isfinite(value))
        return {StatusCode::kNonFinite, where + " is " + NumberText(value) + "; it must be a number"};
      return {StatusCode::kInvalidArgument,
              where + " is " + NumberText(value) + ", outside " + NumberText(low) + " to " + NumberText(high)};
    }
  }
  return Status::Ok();
}

void ClipRow(const Layout& layout, std::byte* row) {
  for (const Leaf& leaf : layout.leaves) {
    if (leaf.space.kind() != SpaceKind::kBox) continue;
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const auto [low, high] = ElementBounds(leaf, i);
      WriteElement(leaf, row, i, std::clamp(ReadElement(leaf, row, i), low, high));
    }
  }
}

}  // namespace consac
