// Text from outside on any bytes: a line is safe and stays as it is, a file's name is no path and gives the name back,
// and what the reader of JSON takes is within its limits.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/text.h"

namespace {

using namespace consac;

void Require(bool holds) {
  if (!holds) std::abort();
}

bool IsSafe(const std::string& line) {
  for (const char c : line) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) return false;
  }
  return true;
}

int HexDigit(char c) {
  return c <= '9' ? c - '0' : c - 'A' + 10;
}

std::string NameOfFile(const std::string& file) {
  std::string name;
  for (std::size_t i = 0; i < file.size(); ++i) {
    if (file[i] != '%') {
      name += file[i];
      continue;
    }
    Require(i + 2 < file.size());
    name += static_cast<char>(HexDigit(file[i + 1]) * 16 + HexDigit(file[i + 2]));
    i += 2;
  }
  return name;
}

int DeepestOf(std::string_view text) {
  int depth = 0, deepest = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (quoted && text[i] == '\\') {
      ++i;
    } else if (text[i] == '"') {
      quoted = !quoted;
    } else if (!quoted && (text[i] == '{' || text[i] == '[')) {
      deepest = ++depth > deepest ? depth : deepest;
    } else if (!quoted && (text[i] == '}' || text[i] == ']')) {
      --depth;
    }
  }
  return deepest;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const std::string line = PrintableLine(text);
  Require(IsSafe(line) && PrintableLine(line) == line && IsSafe(Quote(text)));
  Require(Status(StatusCode::kInternal, text).message().size() <= 4 * 4096 + 32);
  const std::string file = FileNameOf(text, "");
  Require(file.find_first_of("/\\:\n") == std::string::npos && file != "." && file != "..");
  Require(NameOfFile(file) == text);
  if (CheckName("a", text).ok()) Require(line == text && !text.empty() && size <= kLongestName);
  Require(CheckFolderName("run", AsFolderName(text)).ok());
  if (CheckJson(text).ok()) Require(DeepestOf(text) <= 64);
  return 0;
}
