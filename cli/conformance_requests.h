#pragma once
// Whether a trainer's RESET, STEP or RELABEL is right, what the last of them is answered, and how one is told of.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "consac/base/status.h"
#include "consac/protocol/protocol2.h"

namespace consac::cli {

/// `offered` is SPEC's payload, `result` that of the latest RESULT, "" before the first.
Status CheckRequest(const std::string& offered, const protocol2::Agreed& agreed, const protocol2::Frame& frame,
                    const std::string& result);

/// The rows that a RELABEL of this payload asks of; `offered` is SPEC's payload, `max_frame` bytes the most of REWARDS.
Result<std::int64_t> RelabelledRows(const std::string& offered, const std::string& payload, std::size_t max_frame);

/// REWARDS' payload for so many rows, 1 or more: "right" (0 for each), or wrong: "one short", "one more", "NaN",
/// "infinity" (the last row's).
std::string RewardsOf(std::int64_t rows, const std::string& how);

/// A request and its byte for each environment, "STEP of 1 0".
std::string MoveText(const nlohmann::json& type, const nlohmann::json& environments);

}  // namespace consac::cli
