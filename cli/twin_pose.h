#pragma once
// Where a link is, as `consac twin fk --json` and the viewer's page say it.

#include <nlohmann/json.hpp>
#include <string>

#include "consac/robot/transform.h"

namespace consac::cli {

/// {"link": "...", "position": [x, y, z], "rotation": [x, y, z, w]}; m.
inline nlohmann::ordered_json PoseRow(const std::string& link, const robot::Transform& at) {
  const auto& [q, p] = at;
  return {{"link", link}, {"position", {p.x, p.y, p.z}}, {"rotation", {q.x, q.y, q.z, q.w}}};
}

}  // namespace consac::cli
