#pragma once
// Which protocol an end of a connection speaks.

#include <cstdint>

namespace consac {

/// kAuto finds out by the first bytes (spec/protocol2.md).
enum class Protocol : std::uint8_t { kAuto, kText1, kProtocol2 };

}  // namespace consac
