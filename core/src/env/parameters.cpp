#include "consac/env/parameters.h"

#include <cmath>

#include "consac/base/names.h"
#include "consac/base/text.h"

namespace consac {

Status CheckParameters(std::span<const ParameterSpec> parameters) {
  std::vector<std::string> names;
  for (const ParameterSpec& parameter : parameters) {
    names.push_back(parameter.name);
    const double value = parameter.default_value;
    const bool fits = std::isfinite(value) && parameter.low <= value && value <= parameter.high;
    if (fits) continue;
    return {StatusCode::kInvalidArgument, "parameter " + Quote(parameter.name) + " is " + NumberText(value) +
                                              " unless it is set, which is not within its " +
                                              NumberText(parameter.low) + " to " + NumberText(parameter.high)};
  }
  return CheckNamesApart("parameter", names);
}

Status CheckValue(const ParameterSpec& parameter, double value) {
  if (!std::isfinite(value))
    return {StatusCode::kNonFinite, "parameter " + Quote(parameter.name) + " cannot be NaN or infinite"};
  if (value >= parameter.low && value <= parameter.high) return Status::Ok();
  return {StatusCode::kInvalidArgument, "parameter " + Quote(parameter.name) + " cannot be " + NumberText(value) +
                                            "; " + NumberText(parameter.low) + " to " + NumberText(parameter.high)};
}

Result<std::size_t> FindParameter(std::span<const ParameterSpec> parameters, std::string_view name) {
  std::vector<std::string_view> known;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (parameters[i].name == name) return i;
    known.emplace_back(parameters[i].name);
  }
  std::string text = "there is no parameter " + Quote(name);
  if (const std::string_view nearest = NearestName(name, known); !nearest.empty())
    text += "; is " + Quote(nearest) + " meant?";
  else if (!known.empty())
    text += "; there is " + Quote(known[0]) + (known.size() > 1 ? " and others" : "");
  return Status{StatusCode::kNotFound, text};
}

std::vector<double> DefaultsOf(std::span<const ParameterSpec> parameters) {
  std::vector<double> values;
  for (const ParameterSpec& parameter : parameters) values.push_back(parameter.default_value);
  return values;
}

}  // namespace consac
