#pragma once
// The version of CONSAC, written into models, logs and handshakes. This is where it stands: the build reads it here,
// and files that must repeat it are written by tools/version.py and held to it by a test.

namespace consac {

/// Semantic version.
inline constexpr const char* kVersion = "0.2.0";

}  // namespace consac
