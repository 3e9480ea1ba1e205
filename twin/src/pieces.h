#pragma once
// Text of files cut into lines, and at blanks. Private to twin.

#include <algorithm>
#include <string_view>

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

}  // namespace consac::twin
