#include "consac/base/names.h"

#include <algorithm>
#include <map>
#include <vector>

#include "base/utf8.h"
#include "consac/base/text.h"

namespace consac {
namespace {

// Of a file's 255 bytes some are for ".tmp-" and a process id (WriteFileAtomically) and for the extension.
constexpr std::size_t kLongestFile = 224;

bool IsPlain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
}

std::string WithoutCapitals(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

// What Windows takes for a device, whatever follows behind a dot or blanks.
bool IsDevice(std::string_view name) {
  std::string stem = WithoutCapitals(std::string(name.substr(0, name.find('.'))));
  stem.erase(stem.find_last_not_of(' ') + 1);
  if (stem.size() == 4 && (stem.starts_with("com") || stem.starts_with("lpt"))) return stem[3] >= '0' && stem[3] <= '9';
  return stem == "con" || stem == "nul" || stem == "aux" || stem == "prn";
}

bool IsFolderName(std::string_view name) {
  const bool plain = !name.empty() && name.front() != '.' && std::all_of(name.begin(), name.end(), IsPlain);
  return plain && name.size() <= kLongestFolder && name.back() != '.' && !IsDevice(name);
}

std::string Printable(std::string text, bool keep_line_ends) {
  const auto shows = [keep_line_ends](const Utf8Character& c) { return c.shows || (keep_line_ends && c.code == '\n'); };
  std::size_t clean = 0;
  while (clean < text.size()) {
    const Utf8Character character = FirstCharacter(std::string_view(text).substr(clean));
    if (!shows(character)) break;
    clean += character.bytes;
  }
  if (clean == text.size()) return text;
  std::string out = text.substr(0, clean);
  for (std::string_view rest = std::string_view(text).substr(clean); !rest.empty();) {
    const Utf8Character character = FirstCharacter(rest);
    AppendShown(rest.substr(0, character.bytes), shows(character), &out);
    rest.remove_prefix(character.bytes);
  }
  return out;
}

}  // namespace

Status CheckName(std::string_view what, std::string_view name) {
  const auto wrong = [&](const std::string& why) {
    return Status{StatusCode::kInvalidArgument, std::string(what) + " name " + Quote(name) + " " + why};
  };
  if (name.empty()) return wrong("is empty; give it a name");
  if (name.size() > kLongestName)
    return wrong("is longer than the " + std::to_string(kLongestName) + " bytes that a name may have; shorten it");
  for (std::string_view rest = name; !rest.empty();) {
    const Utf8Character character = FirstCharacter(rest);
    if (!character.shows)
      return wrong("holds a character that does not show, or is no UTF-8; write it with characters that show");
    rest.remove_prefix(character.bytes);
  }
  return Status::Ok();
}

Status CheckOptionalName(std::string_view what, std::string_view name) {
  return name.empty() ? Status::Ok() : CheckName(what, name);
}

Status CheckNamesApart(std::string_view what, std::span<const std::string> names) {
  std::vector<std::string_view> sorted;
  for (const std::string& name : names) {
    CONSAC_RETURN_IF_ERROR(CheckName(what, name));
    sorted.emplace_back(name);
  }
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice == sorted.end()) return Status::Ok();
  return {StatusCode::kInvalidArgument, std::string(what) + " name " + Quote(*twice) + " is there twice; rename one"};
}

Status CheckNamesTogether(std::string_view what, std::span<const std::string_view> names) {
  std::map<std::string, std::string_view> files;
  for (const std::string_view name : names) {
    CONSAC_RETURN_IF_ERROR(CheckName(what, name));
    const std::string file = FileNameOf(name, "");
    if (names.size() > 1 && file.size() > kLongestFile) {
      return {StatusCode::kInvalidArgument, std::string(what) + " name " + Quote(name) + " makes a file name of " +
                                                std::to_string(file.size()) + " bytes, at most " +
                                                std::to_string(kLongestFile) + " are possible; shorten it"};
    }
    const auto [at, is_new] = files.emplace(WithoutCapitals(file), name);
    if (is_new) continue;
    return {StatusCode::kInvalidArgument,
            std::string(what) + " name " + Quote(name) +
                (at->second == name ? " is there twice" : " differs from " + Quote(at->second) + " in capitals alone") +
                "; rename one"};
  }
  return Status::Ok();
}

Status CheckFolderName(std::string_view what, std::string_view name) {
  if (IsFolderName(name)) return Status::Ok();
  if (name.size() > kLongestFolder) {
    return {StatusCode::kInvalidArgument, std::string(what) + " name " + Quote(name) + " has " +
                                              std::to_string(name.size()) + " bytes, a folder at most " +
                                              std::to_string(kLongestFolder) + "; shorten it"};
  }
  return {StatusCode::kInvalidArgument, std::string(what) + " name " + Quote(name) +
                                            " cannot be a folder; use letters, digits, '_', '-' and '.', none of the "
                                            "last at an end, and no name of a device (con, nul)"};
}

std::string AsFolderName(std::string_view text, std::size_t most) {
  std::string name(text.substr(0, most));
  for (char& c : name) c = IsPlain(c) ? c : '_';
  if (name.empty() || name.front() == '.' || IsDevice(name)) name.insert(name.begin(), '_');
  if (name.size() > most) name.pop_back();
  if (name.back() == '.') name.back() = '_';
  return name;
}

std::string FileNameOf(std::string_view name, std::string_view extension) {
  static constexpr char kHexDigits[] = "0123456789ABCDEF";
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[i]);
    const bool end = i == 0 || i + 1 == name.size();
    const bool plain = end && (c == '.' || c == ' ') ? false : c == ' ' || IsPlain(name[i]);
    if (plain && !(i == 0 && IsDevice(name))) {
      out += name[i];
    } else {
      out += {'%', kHexDigits[c >> 4], kHexDigits[c & 15]};
    }
  }
  return out + std::string(extension);
}

std::string_view CutAtCharacter(std::string_view text, std::size_t most) {
  if (text.size() <= most) return text;
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xC0) == 0x80) --most;
  return text.substr(0, most);
}

std::string PrintableLine(std::string text) {
  return Printable(std::move(text), false);
}

std::string PrintableText(std::string text) {
  return Printable(std::move(text), true);
}

}  // namespace consac
