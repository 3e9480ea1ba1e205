#include "consac/base/hooks.h"

#include <chrono>
#include <cstdio>
#include <string>

#include "consac/base/names.h"

namespace consac {
namespace {

Hooks& InstalledHooks() {
  static Hooks hooks;
  return hooks;
}

const char* LevelName(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return "debug";
    case LogLevel::kInfo:
      return "info";
    case LogLevel::kWarning:
      return "warning";
    case LogLevel::kError:
      return "error";
  }
  return "log";
}

}  // namespace

void SetHooks(const Hooks& hooks) {
  InstalledHooks() = hooks;
}

void Log(LogLevel level, std::string_view text) {
  const Hooks& hooks = InstalledHooks();
  if (level == LogLevel::kDebug && hooks.log == nullptr) return;
  const std::string line = PrintableLine(std::string(text));
  if (hooks.log != nullptr) {
    hooks.log(hooks.user, level, line);
    return;
  }
  std::fprintf(stderr, "%s: %.*s\n", LevelName(level), static_cast<int>(line.size()), line.data());
}

double Now() {
  const Hooks& hooks = InstalledHooks();
  if (hooks.now != nullptr) return hooks.now(hooks.user);
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void ReportAssertion(const char* expression, const char* file, int line) {
  const Hooks& hooks = InstalledHooks();
  if (hooks.assertion != nullptr) {
    hooks.assertion(hooks.user, expression, file, line);
    return;
  }
  std::fprintf(stderr, "consac: broken precondition '%s' at %s:%d\n", expression, file, line);
#if defined(_MSC_VER) && !defined(__clang__)
  __debugbreak();
#else
  __builtin_trap();
#endif
}

}  // namespace consac
