#include "rows.h"

#include <cmath>
#include <cstring>

#include "consac/base/text.h"

namespace consac::godot {
namespace {

bool IsBytes(const Leaf& leaf) {
  return leaf.space.kind() == SpaceKind::kBox && leaf.dtype == DType::kU8;
}
bool IsFloats(const Leaf& leaf) {
  return leaf.dtype == DType::kF32;
}

}  // namespace

RowMap::RowMap(const Layout& layout, const std::vector<Leaf>& entries)
    : leaves_(entries), row_bytes_(layout.row_bytes), masks_(static_cast<std::size_t>(layout.mask_bytes)) {
  straight_ = true;
  for (const Leaf& leaf : leaves_) {
    straight_ = straight_ && IsFloats(leaf) && leaf.offset == numbers_ * sizeof(float);
    (IsBytes(leaf) ? bytes_ : numbers_) += static_cast<std::size_t>(leaf.count);
  }
  straight_ = straight_ && row_bytes_ == numbers_ * sizeof(float);
}

Status RowMap::WriteRow(const float* numbers, std::int64_t row, std::byte* to) const {
  Status status;
  for (const Leaf& leaf : leaves_) {
    if (IsBytes(leaf)) continue;
    if (IsFloats(leaf)) {
      std::memcpy(to + leaf.offset, numbers, static_cast<std::size_t>(leaf.count) * sizeof(float));
      numbers += leaf.count;
      continue;
    }
    for (std::int64_t i = 0; i < leaf.count; ++i, ++numbers) {
      const auto [low, high] = ElementBounds(leaf, i);
      const double value = *numbers;
      if (value >= low && value <= high && value == std::floor(value)) {
        WriteElement(leaf, to, i, value);
      } else if (status.ok()) {
        status = {StatusCode::kInvalidArgument, "row " + std::to_string(row) + ": '" + leaf.name + "' is " +
                                                    NumberText(value) + "; expected a whole number from " +
                                                    NumberText(low) + " to " + NumberText(high)};
      }
    }
  }
  return status;
}

Status RowMap::Write(std::span<const float> numbers, std::int64_t rows, std::byte* to) const {
  if (straight_) {
    if (!numbers.empty()) std::memcpy(to, numbers.data(), numbers.size_bytes());
    return Status::Ok();
  }
  Status first;
  for (std::int64_t row = 0; row < rows; ++row) {
    const auto r = static_cast<std::size_t>(row);
    const Status status = WriteRow(numbers.data() + r * numbers_, row, to + r * row_bytes_);
    if (first.ok()) first = status;
  }
  return first;
}

void RowMap::Read(const std::byte* from, std::int64_t rows, std::span<float> numbers) const {
  float* out = numbers.data();
  for (std::int64_t row = 0; row < rows; ++row, from += row_bytes_) {
    for (const Leaf& leaf : leaves_) {
      if (IsBytes(leaf)) continue;
      for (std::int64_t i = 0; i < leaf.count; ++i) *out++ = static_cast<float>(ReadElement(leaf, from, i));
    }
  }
}

void RowMap::WriteBytes(std::span<const std::uint8_t> bytes, std::int64_t rows, std::byte* to) const {
  const std::uint8_t* in = bytes.data();
  for (std::int64_t row = 0; row < rows; ++row, to += row_bytes_) {
    for (const Leaf& leaf : leaves_) {
      if (!IsBytes(leaf)) continue;
      std::memcpy(to + leaf.offset, in, static_cast<std::size_t>(leaf.count));
      in += leaf.count;
    }
  }
}

void RowMap::WriteMasks(std::span<const std::uint8_t> masks, std::int64_t rows, std::uint8_t* to) const {
  const std::uint8_t* in = masks.data();
  for (std::int64_t row = 0; row < rows; ++row, to += masks_) {
    for (const Leaf& leaf : leaves_) {
      for (std::int64_t i = 0; i < leaf.mask_count; ++i) to[leaf.mask_offset + i] = *in++ != 0 ? 1 : 0;
    }
  }
}

void RowMap::Clear(std::int64_t rows, std::byte* to) const {
  std::memset(to, 0, static_cast<std::size_t>(rows) * row_bytes_);
  for (std::int64_t row = 0; row < rows; ++row, to += row_bytes_) {
    for (const Leaf& leaf : leaves_) {
      if (leaf.space.kind() != SpaceKind::kDiscrete) continue;
      WriteElement(leaf, to, 0, ElementBounds(leaf, 0).first);
    }
  }
}

}  // namespace consac::godot
