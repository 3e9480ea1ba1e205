#pragma once
// Text of files cut into lines, and at blanks; names put together. Private to twin.

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace consac::twin {

/// Takes the next line off `text`, without its end.
inline std::string_view NextLine(std::string_view* text) {
  const std::size_t end = std::min(text->find('\n'), text->size());
  const std::string_view line = text->substr(0, end);
  text->remove_prefix(std::min(end + 1, text->size()));
  return line;
}

/// Takes the next piece between blanks and ends of lines off `text`; "" at its end.
inline std::string_view NextPiece(std::string_view* text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  text->remove_prefix(std::min(text->find_first_not_of(kBlanks), text->size()));
  const std::string_view piece = text->substr(0, text->find_first_of(kBlanks));
  text->remove_prefix(piece.size());
  return piece;
}

/// "'a', 'b' and 7 more": the first five of what is quoted already.
inline std::string FirstFew(const std::vector<std::string>& quoted) {
  constexpr std::size_t kNamed = 5;
  std::string names;
  for (std::size_t i = 0; i < std::min(quoted.size(), kNamed); ++i) names += (i > 0 ? ", " : "") + quoted[i];
  if (quoted.size() > kNamed) names += " and " + std::to_string(quoted.size() - kNamed) + " more";
  return names;
}

}  // namespace consac::twin
