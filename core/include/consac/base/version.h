#pragma once
// The version of CONSAC, written into models, logs and handshakes.

namespace consac {

/// Semantic version, kept equal to the project version in CMakeLists.txt by a test.
inline constexpr const char* kVersion = "0.1.0";

}  // namespace consac
