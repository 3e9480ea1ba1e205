#pragma once
// Whether a server's message says what a case expects of it.

#include <nlohmann/json.hpp>
#include <string>

#include "consac/base/status.h"
#include "consac/protocol/protocol2.h"

namespace consac::cli {

/// Whether it is an ERROR of that code that leaves the session there.
bool Refuses(const protocol2::Frame& frame, const std::string& code);

/// `code`, `severity`, `members` and `path` of what is expected, where they are named; `message` is what came.
Status CheckMembers(const nlohmann::json& what, const nlohmann::json& message);

/// What CONFIGURE expects of the behaviours that SPEC offered: them as they are, "with fractions" (1 as 1.0), or the
/// first "with a member more" or "of another name".
nlohmann::json Expected(const std::string& how, nlohmann::json offered);

}  // namespace consac::cli
