#pragma once
// Spaces as JSON, as model files and protocol 2 hold them. Private to core.

#include <nlohmann/json_fwd.hpp>

#include "consac/base/budget.h"
#include "consac/space/space.h"

namespace consac {

/// {"type": "box", "shape": [2], "dtype": "F32", "low": [...], "high": [...]} and so on; infinity is null.
nlohmann::json SpaceToJson(const Space& space);
/// The reverse; the error says which part does not fit. Depth and size are limited before memory is taken.
Result<Space> SpaceFromJson(const nlohmann::json& json, MemoryBudget& budget);

}  // namespace consac
