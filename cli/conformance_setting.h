#pragma once
// Environment parameters as the conformance cases of a server set them: flag 4's block, right ones and wrong ones.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "consac/protocol/protocol2.h"

namespace consac::cli {

/// What of a payload's name says that it sets parameters; behind it comes how.
inline constexpr std::string_view kSet = ", set ";

/// How a RESET or STEP of that name sets parameters; "" where it sets none.
inline std::string HowItSets(const std::string& kind) {
  const std::size_t set = kind.find(kSet);
  return set == std::string::npos ? "" : kind.substr(set + kSet.size());
}

/// Whether some value is wrong, then of the last environment.
inline bool IsWrongSetting(std::string_view how) {
  return how.starts_with("too ") || how.starts_with("infinity");
}

/// The value of one parameter; `last`: of the last environment. Where no bound is, "high" and "low" are 1 beyond the
/// default.
inline double SettingOf(const ParameterSpec& parameter, std::string_view how, bool last) {
  const bool has_high = std::isfinite(parameter.high), has_low = std::isfinite(parameter.low);
  const double high = has_high ? parameter.high : parameter.default_value + 1.0;
  if (how == "nothing") return std::numeric_limits<double>::quiet_NaN();
  if (how == "high in the last") return last ? high : std::numeric_limits<double>::quiet_NaN();
  if (how == "high" || (IsWrongSetting(how) && !last)) return high;
  if (how == "low") return has_low ? parameter.low : parameter.default_value - 1.0;
  if (how == "infinity" || (how == "infinity without a bound" && !has_high))
    return std::numeric_limits<double>::infinity();
  if (how == "too high" && has_high) return parameter.high + 1.0 + std::fabs(parameter.high);
  if (how == "too low" && has_low) return parameter.low - 1.0 - std::fabs(parameter.low);
  return IsWrongSetting(how) ? high : parameter.default_value;
}

/// Whether parameters can be set so: where none has a bound, none can be beyond it.
inline bool CanBeSet(std::span<const ParameterSpec> parameters, std::string_view how) {
  return std::ranges::any_of(parameters, [&](const ParameterSpec& parameter) {
    return how == "too high"                   ? std::isfinite(parameter.high)
           : how == "too low"                  ? std::isfinite(parameter.low)
           : how == "infinity without a bound" ? std::isinf(parameter.high)
                                               : true;
  });
}

/// N x P f64. What leaves a value as it is, is NaN of one bits or another: quiet and signalling, of either sign.
inline std::string SettingBlock(std::span<const ParameterSpec> parameters, std::size_t environments,
                                std::string_view how) {
  constexpr std::uint64_t kNaNs[] = {0x7FF8000000000000, 0xFFF8000000000001, 0x7FF0000000000001, 0xFFFFFFFFFFFFFFFF};
  std::string block;
  for (std::size_t i = 0; i < environments * parameters.size(); ++i) {
    const bool last = i / parameters.size() + 1 == environments;
    const double value = SettingOf(parameters[i % parameters.size()], how, last);
    const std::uint64_t bits = std::isnan(value) ? kNaNs[i % std::size(kNaNs)] : std::bit_cast<std::uint64_t>(value);
    block.append(reinterpret_cast<const char*>(&bits), sizeof(bits));
  }
  if (how == "short") block.resize(block.size() - 8);
  if (how == "long") block.resize(block.size() + 8);
  return block;
}

}  // namespace consac::cli
