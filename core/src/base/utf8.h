#pragma once
// Characters of UTF-8, one by one, and whether a person sees them. Private to core/base: everybody else asks names.h
// or Quote.

#include <cstddef>
#include <string>
#include <string_view>

namespace consac {

/// The character at the front of a text.
struct Utf8Character {
  std::size_t bytes = 1;  ///< that it takes; 1 where these are no UTF-8
  char32_t code = 0;      ///< 0 where these are no UTF-8
  bool shows = false;     ///< a person sees it, and it does nothing to what stands around it
};

/// Of `text`, which is not empty.
Utf8Character FirstCharacter(std::string_view text);
/// Appends `bytes` as they are where they `show`, else as \xNN each.
void AppendShown(std::string_view bytes, bool show, std::string* out);

}  // namespace consac
