#include "consac/learn/log/row.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "consac/base/text.h"

namespace consac::learn {
namespace {

constexpr double kAllWholeNumbers = 16777216.0;  // 2^24: a float32 has each, and its own digits are the shortest
constexpr int kMostDigits = 17;

/// The shortest digits of a finite number: 0.DIGITS times 10 to the power of `point`.
struct ShortestDigits {
  char digits[kMostDigits + 1] = {};
  int count = 0, point = 0;
};

/// Of "12.5", "0.001" or "1.25e-07".
ShortestDigits DigitsOf(std::string_view text) {
  ShortestDigits found;
  std::int64_t exponent = 0;
  const std::size_t e = text.find('e');
  if (e != std::string_view::npos) (void)ParseNumber(text.substr(text[e + 1] == '+' ? e + 2 : e + 1), &exponent);
  bool fraction = false;
  for (const char c : text.substr(0, e)) {
    fraction = fraction || c == '.';
    if (c < '0' || c > '9') continue;
    if (c == '0' && found.count == 0) {
      found.point -= fraction ? 1 : 0;
      continue;
    }
    found.point += fraction ? 0 : 1;
    if (found.count < kMostDigits) found.digits[found.count++] = c;
  }
  found.point += static_cast<int>(exponent);
  while (found.count > 1 && found.digits[found.count - 1] == '0') --found.count;
  return found;
}

template <class Float>
ShortestDigits Shortest(Float value) {
  char text[32];
  if (std::fabs(static_cast<double>(value)) < kAllWholeNumbers)
    return DigitsOf({text, FormatNumber(value, std::span<char, 32>(text))});
  // Above, the shortest text may be that of the whole number, whose digits are more than tell it from others.
  for (int precision = 0; precision < kMostDigits; ++precision) {
    const int length = std::snprintf(text, sizeof(text), "%.*e", precision, static_cast<double>(value));
    std::replace(text, text + length, ',', '.');  // of a locale
    Float back = 0;
    if (ParseNumber(std::string_view(text, static_cast<std::size_t>(length)), &back) && back == value) break;
  }
  return DigitsOf(text);
}

/// Source: Python's repr of a float: by exponent below 1e-4 and from 1e16 on.
template <class Float>
std::string_view PythonText(Float value, std::span<char, 32> out) {
  char* end = out.data();
  const auto put = [&end](std::string_view text) {
    std::memcpy(end, text.data(), text.size());
    end += text.size();
  };
  const auto zeros = [&end](int count) {
    for (; count > 0; --count) *end++ = '0';
  };
  if (std::signbit(value) && !std::isnan(value)) put("-");
  const ShortestDigits number = std::isfinite(value) ? Shortest(std::fabs(value)) : ShortestDigits();
  const auto count = static_cast<std::size_t>(number.count);
  const std::string_view digits(number.digits, count);
  if (!std::isfinite(value)) {
    put(std::isnan(value) ? "nan" : "inf");
  } else if (count == 0) {
    put("0.0");
  } else if (number.point > 16 || number.point < -3) {
    put(digits.substr(0, 1));
    if (count > 1) put(".");
    put(digits.substr(1));
    end += std::snprintf(end, 8, "e%c%02d", number.point > 0 ? '+' : '-', std::abs(number.point - 1));
  } else if (number.point <= 0) {
    put("0.");
    zeros(-number.point);
    put(digits);
  } else {
    const auto whole = static_cast<std::size_t>(number.point);
    put(digits.substr(0, whole));
    zeros(number.point - number.count);
    put(".");
    put(whole < count ? digits.substr(whole) : "0");
  }
  return {out.data(), static_cast<std::size_t>(end - out.data())};
}

}  // namespace

void SortByKey(Row* row) {
  const auto place = [](const Cell& cell) { return std::pair(cell.key.find('/') != cell.key.npos, cell.key); };
  std::sort(row->begin(), row->end(), [&](const Cell& a, const Cell& b) { return place(a) < place(b); });
}

std::string_view ExactText(double value, std::span<char, 32> out) {
  return PythonText(value, out);
}

std::string ExactText(const Cell& cell) {
  char text[32];
  if (cell.kind == CellKind::kSingle) return std::string(PythonText(static_cast<float>(cell.value), text));
  std::string whole(PythonText(cell.value, text));
  if (cell.kind != CellKind::kInteger || !std::isfinite(cell.value)) return whole;
  // Of a count, exact in a double.
  return std::to_string(static_cast<std::int64_t>(std::clamp(cell.value, -9e18, 9e18)));
}

}  // namespace consac::learn
