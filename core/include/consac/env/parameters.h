#pragma once
// Numbers of a world that its trainer sets: gravity, friction, how many enemies there are. What they are, and how they
// are given by name. Used by worlds, both ends of protocol 2 (spec/protocol2.md, section 14) and runs.

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"

namespace consac {

/// One parameter of a world.
struct ParameterSpec {
  std::string name;  ///< unique within the environment
  double default_value = 0.0;
  double low = -std::numeric_limits<double>::infinity();  ///< least value that may be set
  double high = std::numeric_limits<double>::infinity();  ///< largest value that may be set
  std::string description = {};                           ///< one line, with the unit; ""
};

/// Ok for a name, finite defaults and low <= default <= high, all names different.
Status CheckParameters(std::span<const ParameterSpec> parameters);
/// Ok for a finite value from low to high; kNonFinite, kOutOfRange name it.
Status CheckValue(const ParameterSpec& parameter, double value);
/// The place of `name` in the list; kNotFound names the nearest.
Result<std::size_t> FindParameter(std::span<const ParameterSpec> parameters, std::string_view name);
/// Their defaults, in order.
std::vector<double> DefaultsOf(std::span<const ParameterSpec> parameters);

}  // namespace consac
