#pragma once
// The shortest text that reads back as a number, without std::to_chars: for macOS before 13.3, whose C++ library has
// none for floats. Private to core/base: everybody else asks FormatNumber in text.h.

#include <cstddef>
#include <span>

namespace consac {

/// What std::to_chars(value) writes, byte for byte; returns its length. Slower: a call of snprintf per digit. Any
/// locale.
std::size_t FormatWithoutToChars(float value, std::span<char, 32> out);
/// The same for a double.
std::size_t FormatWithoutToChars(double value, std::span<char, 32> out);

}  // namespace consac
