#pragma once
// Where a link is, as `consac twin fk --json` and the viewer's page say it.

#include <nlohmann/json.hpp>
#include <string>

#include "consac/robot/transform.h"

namespace consac::cli {

/// {"link": "...", "position": [x, y, z], "rotation": [x, y, z, w]}; m.
inline nlohmann::ordered_json PoseRow(const std::string& link, const robot::Transform& at) {
  const auto& [q, p] = at;
  constexpr double kZero = 0.0;  // -0 plus it is 0
  return {{"link", link},
          {"position", {p.x + kZero, p.y + kZero, p.z + kZero}},
          {"rotation", {q.x + kZero, q.y + kZero, q.z + kZero, q.w + kZero}}};
}

}  // namespace consac::cli
