#include "base/shortest.h"

#include <fast_float/fast_float.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string_view>

namespace consac {
namespace {

/// A positive number as its digits, the first of which is not 0: d.ddd times 10 to the exponent.
struct Decimal {
  char digits[std::numeric_limits<double>::max_digits10] = {};
  int count = 0;
  int exponent = 0;
};

/// `value` rounded to `count` digits. Of what snprintf writes ("1.25e-07") only digits are read: a locale may put
/// anything in the place of the point.
Decimal RoundedTo(int count, double value) {
  char text[64];
  const int length = std::snprintf(text, sizeof(text), "%.*e", count - 1, value);
  const std::string_view written(text, static_cast<std::size_t>(length));
  const std::size_t e = written.rfind('e');
  Decimal rounded;
  for (const char c : written.substr(0, e)) {
    if (c >= '0' && c <= '9') rounded.digits[rounded.count++] = c;
  }
  const std::size_t sign = written[e + 1] == '+' ? 1 : 0;  // which from_chars does not read
  std::from_chars(text + e + 1 + sign, text + length, rounded.exponent);
  return rounded;
}

/// As exponents are written: +07, -324.
char* PutExponent(int exponent, char* at) {
  *at++ = exponent < 0 ? '-' : '+';
  const int size = std::abs(exponent);
  if (size < 10) *at++ = '0';
  return std::to_chars(at, at + 3, size).ptr;
}

char* PutScientific(const Decimal& number, char* at) {
  *at++ = number.digits[0];
  if (number.count > 1) *at++ = '.';
  at = std::copy(number.digits + 1, number.digits + number.count, at);
  *at++ = 'e';
  return PutExponent(number.exponent, at);
}

template <class Number>
bool ReadsBackAs(Number value, const Decimal& number) {
  char text[32];
  const char* const end = PutScientific(number, text);
  Number back{};
  fast_float::from_chars(text, end, back);
  return back == value;
}

/// The fewest digits that read back as `value`, and of those the nearest. The nearest is what snprintf rounds to, but
/// for powers of two, whose neighbour below is nearer than the one above: there the next decimal above may read back
/// where the nearest, below, does not. (It does not end in 0: then one digit less would have done.)
template <class Number>
Decimal ShortestDigits(Number value) {
  Decimal number;
  for (int count = 1; count <= std::numeric_limits<Number>::max_digits10; ++count) {
    number = RoundedTo(count, static_cast<double>(value));
    if (ReadsBackAs(value, number)) break;
    if (++number.digits[count - 1] <= '9' && ReadsBackAs(value, number)) break;
  }
  return number;
}

/// Without an exponent: 0.00125, 1.25, 125. A whole number's digits are all its own, also those beyond what is needed
/// to read it back, as the standard wants it.
char* PutFixed(const Decimal& number, double value, char* at, char* end) {
  const int before_point = number.exponent + 1;
  if (before_point >= number.count) {
    return at + std::snprintf(at, static_cast<std::size_t>(end - at), "%.0f", value);
  }
  const char* digit = number.digits;
  if (before_point <= 0) *at++ = '0';
  for (int i = 0; i < before_point; ++i) *at++ = *digit++;
  *at++ = '.';
  for (int i = before_point; i < 0; ++i) *at++ = '0';
  return std::copy(digit, number.digits + number.count, at);
}

int FixedLength(const Decimal& number) {
  if (number.exponent + 1 >= number.count) return number.exponent + 1;
  return number.count + 1 + std::max(0, -number.exponent);
}

int ScientificLength(const Decimal& number) {
  return number.count + (number.count > 1 ? 1 : 0) + (std::abs(number.exponent) < 100 ? 4 : 5);
}

template <class Number>
std::size_t Format(Number value, std::span<char, 32> out) {
  char* at = out.data();
  if (std::signbit(value)) *at++ = '-';
  const Number size = std::fabs(value);
  if (!std::isfinite(size) || size == 0) {
    const std::string_view word = size == 0 ? "0" : std::isnan(size) ? "nan" : "inf";
    at = std::copy(word.begin(), word.end(), at);
  } else {
    const Decimal number = ShortestDigits(size);
    at = FixedLength(number) <= ScientificLength(number)
             ? PutFixed(number, static_cast<double>(size), at, out.data() + out.size())
             : PutScientific(number, at);
  }
  return static_cast<std::size_t>(at - out.data());
}

}  // namespace

std::size_t FormatWithoutToChars(float value, std::span<char, 32> out) {
  return Format(value, out);
}
std::size_t FormatWithoutToChars(double value, std::span<char, 32> out) {
  return Format(value, out);
}

}  // namespace consac
