#pragma once
// What the joints of a CAD file's own say, as hints: looked at after people's. Private to twin.

#include <string>
#include <vector>

#include "cad_groups.h"

namespace consac::twin {

/// `hints`' joints, then the file's own between groups that no hint names. What cannot be taken is a warning.
std::vector<JointHint> WithOwnJoints(const CadAssembly& assembly, const Groups& groups, const JointHints& hints,
                                     const std::vector<std::pair<std::int32_t, std::int32_t>>& hinted,
                                     std::vector<std::string>* warnings);

}  // namespace consac::twin
