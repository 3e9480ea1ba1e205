#pragma once
// Whether a trainer's RESET or STEP is right.

#include <nlohmann/json.hpp>
#include <string>

#include "consac/base/status.h"
#include "consac/protocol/protocol2.h"

namespace consac::cli {

/// `offered` is SPEC, `result` the payload of the latest RESULT, "" before the first.
Status CheckRequest(const nlohmann::json& offered, const protocol2::Frame& frame, const std::string& result);

}  // namespace consac::cli
