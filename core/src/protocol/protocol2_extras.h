#pragma once
// SPEC's environment parameters and groups as JSON (spec/protocol2.md, sections 14 and 16). Private to core.

#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "consac/base/status.h"
#include "consac/env/vector_env.h"

namespace consac::protocol2 {

nlohmann::json ParametersToJson(std::span<const ParameterSpec> parameters);
/// MALFORMED where they are not as R100 has them.
Result<std::vector<ParameterSpec>> ParametersFromJson(const nlohmann::json& list);

nlohmann::json GroupsToJson(const EnvSpec& env);
/// To `env`, whose behaviours are there; MALFORMED where they are not as R106 has them.
Status ReadGroups(const nlohmann::json& list, EnvSpec* env);

}  // namespace consac::protocol2
