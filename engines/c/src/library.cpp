// What is the library's own: versions, errors, log lines.
#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>

#include "calls.h"
#include "consac/base/hooks.h"
#include "consac/base/names.h"
#include "consac/base/version.h"
#include "consac/learn/algo/learner.h"

namespace consac::c {
namespace {

constexpr const char* kStatusNames[] = {
    "OK",       "INVALID_ARGUMENT", "NOT_FOUND",   "ALREADY_EXISTS",    "FAILED_PRECONDITION", "DATA_LOSS",
    "PROTOCOL", "NON_FINITE",       "UNAVAILABLE", "DEADLINE_EXCEEDED", "RESOURCE_EXHAUSTED",  "CANCELLED",
    "INTERNAL"};
static_assert(static_cast<int>(StatusCode::kInternal) == CONSAC_INTERNAL);
static_assert(static_cast<int>(StatusCode::kDataLoss) == CONSAC_DATA_LOSS);
static_assert(static_cast<int>(StatusCode::kNonFinite) == CONSAC_NON_FINITE);
static_assert(static_cast<int>(StatusCode::kResourceExhausted) == CONSAC_RESOURCE_EXHAUSTED);
static_assert(std::size(kStatusNames) == CONSAC_INTERNAL + 1);
static_assert(static_cast<int>(LogLevel::kError) == CONSAC_LOG_ERROR);

// No destructor, so that it may be read while a thread ends.
constexpr std::size_t kLongestMessage = 6 << 10;  // a Status' sentence, and what was put before it
thread_local char last_error[kLongestMessage] = "";

/// Where lines go, where somebody takes them.
struct Sink {
  consac_log_function log = nullptr;
  void* user = nullptr;
};
Sink sink;

void LogLine(void*, LogLevel level, std::string_view line) {
  sink.log(sink.user, static_cast<int32_t>(level), std::string(line).c_str());
}

// A broken precondition is our own mistake: the host hears of it and goes on.
void Assertion(void*, const char* expression, const char* file, int line) {
  Log(LogLevel::kError, std::string("a mistake of CONSAC's own: ") + expression + " in " + file + ":" +
                            std::to_string(line) + "; please report it");
}

void InstallHooks() {
  Hooks hooks;
  hooks.log = sink.log != nullptr ? &LogLine : nullptr;
  hooks.assertion = &Assertion;
  SetHooks(hooks);
}

// Before any call, whoever makes the first one: no assertion stops the host.
[[maybe_unused]] const bool kInstalled = (InstallHooks(), true);

}  // namespace

consac_status Tell(consac_status code, const char* message) noexcept {
  if (code == CONSAC_OK) return code;
  const std::string_view all(message);
  const std::string_view fits = CutAtCharacter(all, kLongestMessage - 1);
  std::copy(fits.begin(), fits.end(), last_error);
  last_error[fits.size()] = '\0';
  return code;
}

consac_status Tell(const Status& status) noexcept {
  return Tell(static_cast<consac_status>(status.code()), status.message().c_str());
}

}  // namespace consac::c

extern "C" {

uint32_t consac_abi_version(void) {
  return CONSAC_ABI_VERSION;
}

const char* consac_version(void) {
  return consac::kVersion;
}

const char* consac_status_name(consac_status status) {
  return status >= 0 && status <= CONSAC_INTERNAL ? consac::c::kStatusNames[status] : "UNKNOWN";
}

const char* consac_last_error(void) {
  return consac::c::last_error;
}

const char* consac_algorithm(size_t index) {
  const auto algorithms = consac::learn::Algorithms();
  return index < algorithms.size() ? algorithms[index].name : nullptr;
}

void consac_set_log(consac_log_function log, void* user) {
  consac::c::sink = {log, user};
  consac::c::InstallHooks();
}

}  // extern "C"
