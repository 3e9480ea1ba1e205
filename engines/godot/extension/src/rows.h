#pragma once
// How a row of an agent lies in a script's arrays: numbers in a PackedFloat32Array, entry after entry as the script has
// listed them; entries of uint8 (images) apart from these in a PackedByteArray; legal-action masks in one, too.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "consac/space/layout.h"

namespace consac::godot {

/// The way from a script's order of entries to a layout's, and back.
class RowMap {
 public:
  /// `entries` are leaves of `layout`, all of them, in the script's order.
  RowMap(const Layout& layout, const std::vector<Leaf>& entries);

  /// Numbers of a row, without those of uint8 entries.
  std::size_t numbers() const { return numbers_; }
  /// Bytes of a row's uint8 entries.
  std::size_t bytes() const { return bytes_; }
  /// Bytes of a row's masks.
  std::size_t masks() const { return masks_; }

  /// Writes `rows` rows, which lie one after the other; numbers [rows, numbers()]. What a choice cannot be is an error
  /// that names entry and row; then nothing of that row's choice is written.
  Status Write(std::span<const float> numbers, std::int64_t rows, std::byte* to) const;
  /// Reads `rows` rows.
  void Read(const std::byte* from, std::int64_t rows, std::span<float> numbers) const;
  /// Writes the uint8 entries of `rows` rows, [rows, bytes()].
  void WriteBytes(std::span<const std::uint8_t> bytes, std::int64_t rows, std::byte* to) const;
  /// Writes the masks of `rows` rows, [rows, masks()]; anything but 0 is legal.
  void WriteMasks(std::span<const std::uint8_t> masks, std::int64_t rows, std::uint8_t* to) const;
  /// Makes every choice of `rows` rows its first, all else 0: something that can be sent and learned from.
  void Clear(std::int64_t rows, std::byte* to) const;

 private:
  Status WriteRow(const float* numbers, std::int64_t row, std::byte* to) const;

  std::vector<Leaf> leaves_;  // in the script's order
  std::size_t row_bytes_ = 0, numbers_ = 0, bytes_ = 0, masks_ = 0;
  bool straight_ = false;  // the script's row is the layout's, byte by byte
};

}  // namespace consac::godot
