#include "consac/base/text.h"

#include <fast_float/fast_float.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/shortest.h"
#include "base/utf8.h"

namespace consac {
namespace {

template <class Number>
std::size_t FormatShortest(Number value, std::span<char, 32> out) {
// A program that is to start on macOS before 13.3, as Unreal 5.3's and 5.4's, may not call to_chars for floats; libc++
// before 14 has none.
#if (defined(__ENVIRONMENT_MAC_OS_X_VERSION_MIN_REQUIRED__) &&  \
     __ENVIRONMENT_MAC_OS_X_VERSION_MIN_REQUIRED__ < 130300) || \
    (defined(_LIBCPP_VERSION) && _LIBCPP_VERSION < 14000)
  return FormatWithoutToChars(value, out);
#else
  const std::to_chars_result result = std::to_chars(out.data(), out.data() + out.size(), value);
  return static_cast<std::size_t>(result.ptr - out.data());
#endif
}

// fast_float reads "nan" and "inf" too; both are refused by their value.
template <class Number>
bool ParseFinite(std::string_view text, Number* value) {
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (!text.empty() && text.front() == '-') return false;
  }
  Number parsed{};
  const auto result = fast_float::from_chars(text.data(), text.data() + text.size(), parsed);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size() || !std::isfinite(parsed)) return false;
  *value = parsed;
  return true;
}

/// "1_000_000" as "1000000"; an underscore that does not stand between digits stays, and spoils the number.
std::string WithoutSeparators(std::string_view text) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool separator =
        text[i] == '_' && i > 0 && i + 1 < text.size() && is_digit(text[i - 1]) && is_digit(text[i + 1]);
    if (!separator) out += text[i];
  }
  return out;
}

/// The words between '_', in alphabetical order.
std::vector<std::string_view> SortedWords(std::string_view name) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t end = std::min(name.find('_'), name.size());
    words.push_back(name.substr(0, end));
    if (end == name.size()) break;
    name.remove_prefix(end + 1);
  }
  std::sort(words.begin(), words.end());
  return words;
}

std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitute = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({substitute, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace

std::size_t FormatNumber(float value, std::span<char, 32> out) {
  return FormatShortest(value, out);
}
std::size_t FormatNumber(double value, std::span<char, 32> out) {
  return FormatShortest(value, out);
}

std::string NumberText(double value) {
  char buffer[32];
  return std::string(buffer, FormatNumber(value, std::span<char, 32>(buffer)));
}

bool ParseNumber(std::string_view text, float* value) {
  return ParseFinite(text, value);
}
bool ParseNumber(std::string_view text, double* value) {
  return ParseFinite(text, value);
}

bool ParseNumber(std::string_view text, std::int64_t* value) {
  std::int64_t parsed = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), parsed);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) return false;
  *value = parsed;
  return true;
}

bool ParseHumanNumber(std::string_view text, double* value) {
  return ParseNumber(WithoutSeparators(text), value);
}

bool ParseHumanNumber(std::string_view text, std::int64_t* value) {
  constexpr double kMost = 9.2e18;  // that an int64 holds
  const std::string plain = WithoutSeparators(text);
  if (ParseNumber(plain, value)) return true;
  double real = 0.0;
  if (!ParseNumber(plain, &real) || real != std::floor(real) || std::fabs(real) > kMost) return false;
  *value = static_cast<std::int64_t>(real);
  return true;
}

std::string Quote(std::string_view text, std::size_t limit) {
  std::string out = "'";
  for (std::size_t at = 0; at < text.size();) {
    const Utf8Character character = FirstCharacter(text.substr(at));
    if (at + character.bytes > limit) return out + "'... (" + std::to_string(text.size()) + " bytes)";
    AppendShown(text.substr(at, character.bytes), character.shows, &out);
    at += character.bytes;
  }
  return out + "'";
}

std::string_view NearestName(std::string_view name, std::span<const std::string_view> known) {
  const std::vector<std::string_view> words = SortedWords(name);
  for (const std::string_view candidate : known) {
    if (words.size() > 1 && SortedWords(candidate) == words) return candidate;
  }
  std::string_view nearest;
  std::size_t best = std::max<std::size_t>(2, name.size() / 2) + 1;
  for (const std::string_view candidate : known) {
    const std::size_t distance = EditDistance(name, candidate);
    if (distance < best) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

std::string Suggestion(std::string_view name, std::span<const std::string_view> known) {
  const std::string_view nearest = NearestName(name, known);
  if (!nearest.empty()) return " (did you mean '" + std::string(nearest) + "'?)";
  return known.empty() ? "" : " (known: " + Join(known) + ")";
}

std::string Join(std::span<const std::string_view> names) {
  std::string out;
  for (const std::string_view name : names) {
    if (!out.empty()) out += ", ";
    out += name;
  }
  return out;
}

}  // namespace consac
