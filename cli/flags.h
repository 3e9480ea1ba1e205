#pragma once
// Flags that hold numbers: read as in a configuration file ("1_000_000", "1e6"), never NaN, never out of range.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

namespace consac::cli {

/// A flag whose value must be a number from `low` to `high`.
CLI::Option* AddNumber(CLI::App& app, const std::string& name, double* value, double low, double high,
                       const std::string& help);
/// A flag whose value must be a whole number from `low` to `high`.
CLI::Option* AddWhole(CLI::App& app, const std::string& name, std::int64_t* value, std::int64_t low, std::int64_t high,
                      const std::string& help);

inline constexpr std::int64_t kMostWhole = std::int64_t{9'000'000'000'000'000'000};  ///< no limit of its own
inline constexpr double kMostSeconds = 1e9;                                          ///< of any waiting time

/// Declares --token, which may also come from the environment: a command line is shown to everybody (ps).
CLI::Option* AddToken(CLI::App& app, std::string* value, const std::string& help);

}  // namespace consac::cli
