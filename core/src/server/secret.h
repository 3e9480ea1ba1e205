#pragma once
// Comparing access and resume tokens. Private to core/server.

#include <string_view>

namespace consac {

/// Equal texts, in a time that does not tell where they differ.
bool SameSecret(std::string_view a, std::string_view b);

}  // namespace consac
