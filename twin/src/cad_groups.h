#pragma once
// Which parts of an assembly move together before any joint is looked for. Private to twin.

#include <string>
#include <string_view>
#include <vector>

#include "consac/twin/cad_joints.h"

namespace consac::twin {

/// Whether `text` is what `pattern` says: "*" is any number of characters, "?" one.
bool Matches(std::string_view pattern, std::string_view text);

/// Groups, and what is of which.
struct Groups {
  std::vector<CadGroup> groups;
  std::vector<std::int32_t> of_node;     ///< [nodes] -1 of what stands above them
  std::vector<robot::Transform> places;  ///< [nodes] in the world
  std::vector<std::string> paths;        ///< [nodes] CadRobot::path_of_node
  std::vector<bool> fastens;             ///< [nodes] a screw, nut or washer, by its name or its shape
  std::vector<bool> rods;                ///< [groups] each of its parts is no wider than a pin around one axis
};

/// First-level components, and what hints put together. kInvalidArgument where a hint's pattern meets nothing.
Result<Groups> GroupParts(const CadAssembly& assembly, const JointHints& hints);

}  // namespace consac::twin
