// Texts of the shim: formatting, UTF-8, the log.
#include <cstdio>
#include <map>
#include <mutex>
#include <string_view>

#include "CoreGlobals.h"
#include "Logging/LogMacros.h"
#include "Misc/OutputDeviceRedirector.h"
#include "Shim/Runtime.h"

static FOutputDeviceRedirector shim_log;
FOutputDeviceRedirector* GLog = &shim_log;

namespace Shim {
namespace {

[[noreturn]] void Wrong(const char* what, std::u16string_view format) {
  std::fprintf(stderr, "format '%s': %s\n", Narrow(format).c_str(), what);
  std::abort();
}

std::string Number(std::string spec, char conversion, const Argument& argument, std::u16string_view format) {
  char text[64];
  const bool real = std::string_view("fgeE").find(conversion) != std::string_view::npos;
  const bool whole = argument.kind == Argument::kSigned || argument.kind == Argument::kUnsigned;
  if (real != (argument.kind == Argument::kReal) || (!real && !whole))
    Wrong("a conversion has another kind of argument", format);
  const bool wide = spec.find("ll") != std::string::npos;
  if (!real && (argument.bytes == 8) != wide) Wrong("a number has another width than its conversion", format);
  spec.resize(spec.find_last_not_of('l') + 1);
  spec = "%" + spec + (real ? "" : "ll") + conversion;
  if (real) {
    std::snprintf(text, sizeof(text), spec.c_str(), argument.real);
  } else {
    std::snprintf(text, sizeof(text), spec.c_str(), argument.number);
  }
  return text;
}

std::vector<std::string>& Lines() {
  static std::vector<std::string> lines;
  return lines;
}

}  // namespace

std::u16string Format(const char16_t* format, const std::vector<Argument>& arguments) {
  const std::u16string_view all(format);
  std::u16string out;
  std::size_t next = 0;
  for (std::size_t at = 0; at < all.size(); ++at) {
    if (all[at] != u'%') {
      out += all[at];
      continue;
    }
    if (at + 1 < all.size() && all[at + 1] == u'%') {
      out += all[++at];
      continue;
    }
    std::string spec;
    while (++at < all.size() && std::u16string_view(u"-+ #0123456789.lh").find(all[at]) != std::u16string_view::npos) {
      spec += static_cast<char>(all[at]);
    }
    if (at >= all.size() || next >= arguments.size()) Wrong("too few arguments", all);
    const Argument& argument = arguments[next++];
    const char conversion = static_cast<char>(all[at]);
    if (conversion != 's') {
      out += Wide(Number(spec, conversion, argument, all));
    } else if (argument.kind != (spec == "h" ? Argument::kNarrow : Argument::kWide)) {
      Wrong("%s takes TCHAR*, %hs takes char*", all);
    } else {
      out += argument.kind == Argument::kWide ? std::u16string(argument.wide) : Wide(argument.narrow);
    }
  }
  if (next != arguments.size()) Wrong("too many arguments", all);
  return out;
}

std::string Narrow(std::u16string_view text) {
  std::string out;
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::uint32_t code = text[at];
    if (code >= 0xD800 && code < 0xDC00 && at + 1 < text.size())
      code = 0x10000 + ((code - 0xD800) << 10) + (text[++at] - 0xDC00u);
    if (code < 0x80) {
      out += static_cast<char>(code);
      continue;
    }
    const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
    out += static_cast<char>((0xF0 << (3 - more)) | static_cast<int>(code >> (6 * more)));
    for (int k = more - 1; k >= 0; --k) out += static_cast<char>(0x80 | ((code >> (6 * k)) & 0x3F));
  }
  return out;
}

std::u16string Wide(std::string_view text) {
  std::u16string out;
  for (std::size_t at = 0; at < text.size();) {
    const auto first = static_cast<unsigned char>(text[at++]);
    const int more = first < 0xC0 ? 0 : first < 0xE0 ? 1 : first < 0xF0 ? 2 : 3;
    std::uint32_t code = more == 0 ? first : first & (0x3Fu >> more);
    for (int k = 0; k < more && at < text.size(); ++k)
      code = (code << 6) | (static_cast<unsigned char>(text[at++]) & 0x3Fu);
    if (code >= 0x10000) {
      out += static_cast<char16_t>(0xD800 + ((code - 0x10000) >> 10));
      out += static_cast<char16_t>(0xDC00 + ((code - 0x10000) & 0x3FF));
    } else {
      out += static_cast<char16_t>(code);
    }
  }
  return out;
}

const std::u16string* SpellingOf(std::u16string_view text) {
  static std::map<std::u16string, std::u16string> spellings;
  static std::mutex mutex;  // names are made on every thread
  const std::lock_guard lock(mutex);
  return text.empty() ? nullptr : &spellings.try_emplace(Lower(text), text).first->second;
}

void LogLine(const LogCategory& category, Verbosity verbosity, std::u16string line) {
  static const char* const kNames[] = {"Fatal", "Error", "Warning", "Display", "Log", "Verbose", "VeryVerbose"};
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  std::vector<std::string>& lines = Lines();
  if (lines.size() > 1000) lines.erase(lines.begin(), lines.begin() + 500);
  lines.push_back(std::string(category.name) + ": " + kNames[static_cast<int>(verbosity)] + ": " + Narrow(line));
  const auto matters = static_cast<ELogVerbosity::Type>(static_cast<int>(verbosity) + ELogVerbosity::Fatal);
  GLog->ShimTell(line.c_str(), matters, FName(Wide(category.name).c_str()));
}

const std::vector<std::string>& Log() {
  return Lines();
}
std::vector<std::string> LogLines(const std::string& part) {
  std::vector<std::string> found;
  for (const std::string& line : Lines())
    if (line.find(part) != std::string::npos) found.push_back(line);
  return found;
}
void ForgetLog() {
  Lines().clear();
}

}  // namespace Shim
