#include "base/utf8.h"

#include <algorithm>
#include <array>

namespace consac {
namespace {

/// Code points from `first` to `last`.
struct CodeRange {
  char32_t first, last;
};

// Sources: Unicode 15.1, general category Cc; Bidi_Control (UAX 9); line and paragraph separator; what has no look and
// no part in a script's spelling (zero width space, word joiner to invisible plus, byte order mark, interlinear marks,
// tags). Joiners (200C, 200D) and variation selectors belong to scripts and stay.
constexpr std::array kHidden = {CodeRange{0x0000, 0x001F},  CodeRange{0x007F, 0x009F}, CodeRange{0x061C, 0x061C},
                                CodeRange{0x180E, 0x180E},  CodeRange{0x200B, 0x200B}, CodeRange{0x200E, 0x200F},
                                CodeRange{0x2028, 0x202E},  CodeRange{0x2060, 0x206F}, CodeRange{0xFEFF, 0xFEFF},
                                CodeRange{0xFFF9, 0xFFFB},  CodeRange{0xFDD0, 0xFDEF}, CodeRange{0xFFFE, 0xFFFF},
                                CodeRange{0xE0000, 0xE00FF}};

bool Shows(char32_t code) {
  return std::none_of(kHidden.begin(), kHidden.end(),
                      [code](const CodeRange& range) { return code >= range.first && code <= range.last; });
}

/// How many bytes follow a first byte, and its share of the code; false where it begins nothing.
bool ReadLead(unsigned char lead, std::size_t* following, char32_t* code) {
  if (lead >= 0xC2 && lead <= 0xDF) {
    *following = 1;
    *code = lead & 0x1Fu;
  } else if (lead >= 0xE0 && lead <= 0xEF) {
    *following = 2;
    *code = lead & 0x0Fu;
  } else if (lead >= 0xF0 && lead <= 0xF4) {
    *following = 3;
    *code = lead & 0x07u;
  } else {
    return false;
  }
  return true;
}

}  // namespace

Utf8Character FirstCharacter(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  if (lead < 0x80) return {1, lead, lead >= 0x20 && lead != 0x7F};
  std::size_t following = 0;
  char32_t code = 0;
  if (!ReadLead(lead, &following, &code) || text.size() <= following) return {};
  for (std::size_t i = 1; i <= following; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte & 0xC0) != 0x80) return {};
    code = code << 6 | (byte & 0x3Fu);
  }
  // Longer than need be, half of a UTF-16 pair, or beyond the last character.
  constexpr char32_t kLeast[] = {0, 0x80, 0x800, 0x10000};
  if (code < kLeast[following] || (code >= 0xD800 && code <= 0xDFFF) || code > 0x10FFFF) return {};
  return {following + 1, code, Shows(code)};
}

void AppendShown(std::string_view bytes, bool show, std::string* out) {
  static constexpr char kHexDigits[] = "0123456789abcdef";
  if (show) {
    *out += bytes;
    return;
  }
  for (const char byte : bytes) {
    const auto c = static_cast<unsigned char>(byte);
    *out += {'\\', 'x', kHexDigits[c >> 4], kHexDigits[c & 15]};
  }
}

}  // namespace consac
