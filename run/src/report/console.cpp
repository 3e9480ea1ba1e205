#include "report/console.h"

#include <cstdlib>

#include "system/system.h"

namespace consac::run {
namespace {

constexpr std::string_view kClearLine = "\r\x1b[K", kLoud = "\x1b[1;31m", kPlain = "\x1b[0m";

void Put(std::FILE* stream, std::string_view text) {
  (void)std::fwrite(text.data(), 1, text.size(), stream);
}

bool IsSet(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

}  // namespace

ConsoleOptions StandardConsole() {
  ConsoleOptions options;
  options.terminal = UnderstandsEscapeCodes(stdout);
  options.colour = options.terminal && !IsSet("NO_COLOR");
  return options;
}

void Console::Print(std::string_view text) {
  if (bar_.size() > 0) Put(options_.stream, kClearLine);
  Put(options_.stream, text);
  Put(options_.stream, {bar_.data(), bar_.size()});
  (void)std::fflush(options_.stream);
}

void Console::Alarm(std::string_view line) {
  Print(fmt::format("{}error: {}{}\n", colour() ? kLoud : "", line, colour() ? kPlain : ""));
}

void Console::Bar(std::string_view line) {
  bar_.clear();
  bar_.append(line);
  Put(options_.stream, kClearLine);
  Put(options_.stream, line);
  (void)std::fflush(options_.stream);
}

void Console::EndBar() {
  if (bar_.size() == 0) return;
  bar_.clear();
  Print("\n");
}

int Console::columns() const {
  if (options_.columns > 0) return options_.columns;
  const int shown = TerminalColumns(options_.stream);
  return shown > 0 ? shown : 80;
}

}  // namespace consac::run
