#pragma once
// Formatting as Unreal's, and strict: a conversion that does not fit its argument ends the test.

#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

namespace Shim {

/// One argument of Printf or UE_LOG.
struct Argument {
  enum Kind { kWide, kNarrow, kSigned, kUnsigned, kReal } kind;
  const char16_t* wide = nullptr;
  const char* narrow = nullptr;
  long long number = 0;
  double real = 0.0;
  std::size_t bytes = 0;
};

template <class T>
Argument ArgumentOf(T value) {
  Argument argument;
  argument.bytes = sizeof(T);
  if constexpr (std::is_same_v<T, const char16_t*> || std::is_same_v<T, char16_t*>) {
    argument.kind = Argument::kWide;
    argument.wide = value;
  } else if constexpr (std::is_same_v<T, const char*> || std::is_same_v<T, char*>) {
    argument.kind = Argument::kNarrow;
    argument.narrow = value;
  } else if constexpr (std::is_floating_point_v<T>) {
    argument.kind = Argument::kReal;
    argument.real = static_cast<double>(value);
  } else {
    static_assert(std::is_integral_v<T>, "only numbers and texts can be formatted");
    argument.kind = std::is_signed_v<T> ? Argument::kSigned : Argument::kUnsigned;
    argument.number = static_cast<long long>(value);
  }
  return argument;
}

/// The text; aborts where format and arguments disagree.
std::u16string Format(const char16_t* format, const std::vector<Argument>& arguments);
/// UTF-16 as UTF-8.
std::string Narrow(std::u16string_view text);
/// UTF-8 as UTF-16.
std::u16string Wide(std::string_view text);

}  // namespace Shim
