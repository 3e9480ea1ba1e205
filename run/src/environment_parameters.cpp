#include "environment_parameters.h"

#include "consac/base/text.h"
#include "link.h"

namespace consac::run {

Status CheckEnvironmentParameters(std::span<const ParameterLaw> laws, const WorldLink& link) {
  const std::vector<ParameterSpec>& parameters = link.spec().parameters;
  if (!laws.empty() && parameters.empty()) {
    return {StatusCode::kInvalidArgument,
            "environment_parameters sets " + Quote(laws[0].name) + ", but " + link.description() +
                " has no parameters that can be set" +
                (link.behind_connection() ? " (protocol 2's capability 'parameters')" : "")};
  }
  const Status fits = CheckParameterLaws(laws, parameters);
  if (fits.ok()) return fits;
  return {StatusCode::kInvalidArgument, "environment_parameters: " + fits.message() + " (" + link.description() + ")"};
}

void EnvironmentParameters::ChooseForAll(WorldLink& link) {
  for (std::int32_t i = 0; i < link.spec().environments(); ++i) link.SetParameters(i, chooser_.Choose(seen_));
}

void EnvironmentParameters::ChooseNext(WorldLink& link, std::int32_t i) {
  if (!chooser_.fixed()) link.SetParameters(i, chooser_.Choose(seen_));
}

}  // namespace consac::run
