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

/// Whether some value is wrong, then of the last environment, or of the first where it says so.
inline bool IsWrongSetting(std::string_view how) {
  return how.starts_with("too ") || how.starts_with("infinity");
}
inline bool IsOfFirst(std::string_view how) {
  return how.ends_with(" in the first");
}

/// Whether a parameter has the bound that such a wrong value is beyond; true where none is meant.
inline bool HasBound(const ParameterSpec& parameter, std::string_view how) {
  return how.starts_with("too high")  ? std::isfinite(parameter.high)
         : how.starts_with("too low") ? std::isfinite(parameter.low)
                                      : true;
}

/// The value of one parameter; `last`: it is the one that can be wrong, or high alone. Where no bound is, "high" and
/// "low" are 1 beyond the default.
inline double SettingOf(const ParameterSpec& parameter, std::string_view how, bool last) {
  const bool has_high = std::isfinite(parameter.high), has_low = std::isfinite(parameter.low);
  const double high = has_high ? parameter.high : parameter.default_value + 1.0;
  if (how == "nothing") return std::numeric_limits<double>::quiet_NaN();
  if (how == "high in the last") return last ? high : std::numeric_limits<double>::quiet_NaN();
  if (how == "high" || (IsWrongSetting(how) && !last)) return high;
  if (how == "low") return has_low ? parameter.low : parameter.default_value - 1.0;
  if (how == "infinity" || (how == "infinity without a bound" && !has_high))
    return std::numeric_limits<double>::infinity();
  if (how.starts_with("too high") && has_high) return parameter.high + 1.0 + std::fabs(parameter.high);
  if (how.starts_with("too low") && has_low) return parameter.low - 1.0 - std::fabs(parameter.low);
  return IsWrongSetting(how) ? high : parameter.default_value;
}

/// Whether parameters can be set so: where none has a bound, none can be beyond it.
inline bool CanBeSet(std::span<const ParameterSpec> parameters, std::string_view how) {
  return std::ranges::any_of(parameters, [&](const ParameterSpec& parameter) {
    return how == "infinity without a bound" ? std::isinf(parameter.high) : HasBound(parameter, how);
  });
}

/// The place of the last parameter that can be wrong so; with "by the last" it alone is.
inline std::size_t LastWithBound(std::span<const ParameterSpec> parameters, std::string_view how) {
  std::size_t place = parameters.size() - 1;
  while (place > 0 && !HasBound(parameters[place], how)) --place;
  return place;
}

/// N x P f64. What leaves a value as it is, is NaN of one bits or another: quiet and signalling, of either sign.
inline std::string SettingBlock(std::span<const ParameterSpec> parameters, std::size_t environments,
                                std::string_view how) {
  constexpr std::uint64_t kNaNs[] = {0x7FF8000000000000, 0xFFF8000000000001, 0x7FF0000000000001, 0xFFFFFFFFFFFFFFFF};
  std::string block;
  for (std::size_t i = 0; i < environments * parameters.size(); ++i) {
    const std::size_t place = i % parameters.size();
    const bool is_meant = !how.ends_with(" by the last") || place == LastWithBound(parameters, how);
    const bool last = is_meant && i / parameters.size() == (IsOfFirst(how) ? 0 : environments - 1);
    const double value = SettingOf(parameters[place], how, last);
    const std::uint64_t bits = std::isnan(value) ? kNaNs[i % std::size(kNaNs)] : std::bit_cast<std::uint64_t>(value);
    block.append(reinterpret_cast<const char*>(&bits), sizeof(bits));
  }
  if (how == "short") block.resize(block.size() - 8);
  if (how == "long") block.resize(block.size() + 8);
  return block;
}

}  // namespace consac::cli
