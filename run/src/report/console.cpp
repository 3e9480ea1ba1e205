#include "report/console.h"

#include <cstdlib>

#include "consac/base/names.h"
#include "consac/run/output.h"
#include "system/system.h"

namespace consac::run {
namespace {

constexpr std::string_view kClearLine = "\r\x1b[K", kLoud = "\x1b[1;31m", kPlain = "\x1b[0m";

constexpr double kPatience = 1.0;  // s that a training waits for its reader

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

void Console::Put(std::string_view text) {
  for (std::size_t at = 0; at < text.size(); at += kOutputPiece) {
    unread_ = !TakesOutput(options_.stream, unread_ ? 0.0 : kPatience);
    if (unread_) return;
    WriteOutput(options_.stream, text.substr(at, kOutputPiece));
    FlushOutput(options_.stream);
  }
}

void Console::Print(std::string_view text) {
  PrintAbove(PrintableText(std::string(text)));
}

void Console::Line(std::string_view line) {
  PrintAbove(PrintableLine(std::string(line)) + "\n");
}

void Console::Release() {
  Put(held_);
  held_.clear();
  options_.hold_until = 0.0;
}

void Console::PrintAbove(std::string_view text) {
  if (Holds()) {
    held_.append(text);
    return;
  }
  Release();
  if (bar_.size() > 0) Put(kClearLine);
  Put(text);
  Put({bar_.data(), bar_.size()});
}

void Console::Alarm(std::string_view line) {
  Release();
  PrintAbove(
      fmt::format("{}error: {}{}\n", colour() ? kLoud : "", PrintableLine(std::string(line)), colour() ? kPlain : ""));
}

void Console::Bar(std::string_view line) {
  if (Holds()) return;
  Release();
  bar_.clear();
  bar_.append(line);
  Put(kClearLine);
  Put(line);
}

void Console::EndBar() {
  if (bar_.size() == 0) return;
  bar_.clear();
  PrintAbove("\n");
}

int Console::columns() const {
  if (options_.columns > 0) return options_.columns;
  const int shown = TerminalColumns(options_.stream);
  return shown > 0 ? shown : 80;
}

}  // namespace consac::run
