#pragma once
// What the host supplies: where log lines go, what a broken precondition does, what time it is.
// An engine sets these once at start-up, before any other call; the defaults write to stderr and trap.
// `core` and `learn` never print, exit or start a thread by any other way.

#include <cstdint>
#include <string_view>

namespace consac {

/// How loud a log line is.
enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarning, kError };

/// Host functions. Plain pointers, so that they cross a shared-library border; `user` is handed back unchanged.
struct Hooks {
  /// One line without a newline. May be called from any thread that calls into consac.
  void (*log)(void* user, LogLevel level, std::string_view line) = nullptr;
  /// A caller's mistake. May return; the call that failed then does its least harmful thing.
  void (*assertion)(void* user, const char* expression, const char* file, int line) = nullptr;
  /// Monotonic time in seconds.
  double (*now)(void* user) = nullptr;
  /// Handed to each of the above.
  void* user = nullptr;
};

/// Replaces the hooks; null members keep the defaults. Not thread-safe: call before anything else.
void SetHooks(const Hooks& hooks);
/// Sends one line to the host's log; what does not show becomes \xNN (names.h).
void Log(LogLevel level, std::string_view line);
/// Monotonic seconds from the host's clock.
double Now();
/// Reports a caller's mistake to the host.
void ReportAssertion(const char* expression, const char* file, int line);

}  // namespace consac

/// A precondition of a public call. Costs one predictable branch; stays on in release builds.
#define CONSAC_ASSERT(expression) \
  (static_cast<bool>(expression) ? void(0) : ::consac::ReportAssertion(#expression, __FILE__, __LINE__))
