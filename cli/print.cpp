#include "cli/print.h"

#include "cli/verbs.h"
#include "consac/base/hooks.h"
#include "consac/base/names.h"
#include "consac/run/output.h"

namespace consac::cli {
namespace {

constexpr double kStopLook = 0.1;     // s between looks at whether to stop
constexpr double kLogPatience = 1.0;  // s that a training waits for the reader of its log

bool AwaitReader(std::FILE* stream) {
  while (!run::TakesOutput(stream, kStopLook)) {
    if (Stopped()) return false;
  }
  return true;
}

}  // namespace

void Write(std::FILE* stream, std::string_view any) {
  const std::string shown = PrintableText(std::string(any));
  const std::string_view text = shown;
  for (std::size_t at = 0; at < text.size(); at += run::kOutputPiece) {
    if (!AwaitReader(stream)) return;
    run::WriteOutput(stream, text.substr(at, run::kOutputPiece));
  }
}

void LogToStandardError() {
  Hooks hooks;
  hooks.log = [](void*, LogLevel level, std::string_view line) {
    if (level == LogLevel::kDebug || !run::TakesOutput(stderr, kLogPatience)) return;
    static constexpr const char* kNames[] = {"debug", "info", "warning", "error"};
    run::WriteOutput(stderr, fmt::format("{}: {}\n", kNames[static_cast<int>(level)], line));  // fmt::print throws
  };
  SetHooks(hooks);
}

bool FlushOutput() {
  if (!AwaitReader(stdout)) return false;
  run::FlushOutput(stdout);
  return run::OutputError() == 0;
}

}  // namespace consac::cli
