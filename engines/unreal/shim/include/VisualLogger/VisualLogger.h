#pragma once
#include <string>
#include <utility>
#include <vector>

#include "Logging/LogMacros.h"

class UObject;

namespace Shim {
/// Whether the Visual Logger records, and what it has recorded; for tests.
inline bool vlog_records = false;
inline std::vector<std::pair<const UObject*, std::string>> vlog;
}  // namespace Shim

/// Arguments are asked for where it records alone.
#define UE_VLOG(owner, category, verbosity, format, ...)                                                \
  do {                                                                                                  \
    if (Shim::vlog_records) {                                                                           \
      static_cast<void>(category), static_cast<void>(Shim::Verbosity::verbosity);                       \
      Shim::vlog.emplace_back(owner, Shim::Narrow(Shim::Format(format, Shim::Arguments(__VA_ARGS__)))); \
    }                                                                                                   \
  } while (false)
