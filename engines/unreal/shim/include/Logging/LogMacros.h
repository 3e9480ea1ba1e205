#pragma once
#include "CoreMinimal.h"

namespace Shim {
enum class Verbosity { Fatal, Error, Warning, Display, Log, Verbose, VeryVerbose };
/// A category of log lines.
struct LogCategory {
  const char* name;
};
/// Keeps the line; tests read them.
void LogLine(const LogCategory& category, Verbosity verbosity, std::u16string line);
}  // namespace Shim

#define DECLARE_LOG_CATEGORY_EXTERN(name, verbosity, compiled) extern const Shim::LogCategory name
#define DEFINE_LOG_CATEGORY(name) \
  const Shim::LogCategory name {  \
#name                         \
  }
#define DEFINE_LOG_CATEGORY_STATIC(name, verbosity, compiled) \
  static const Shim::LogCategory name {                       \
#name                                                     \
  }
#define UE_LOG(category, verbosity, format, ...) \
  Shim::LogLine(category, Shim::Verbosity::verbosity, Shim::Format(format, Shim::Arguments(__VA_ARGS__)))

namespace Shim {
template <class... T>
std::vector<Argument> Arguments(T... values) {
  return {ArgumentOf(values)...};
}
}  // namespace Shim
