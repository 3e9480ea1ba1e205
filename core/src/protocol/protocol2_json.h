#pragma once
// Out of a frame's payload: JSON, and whole numbers. Private to core.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>

#include "consac/base/status.h"

namespace consac::protocol2 {

/// One object within the limits of spec/protocol2.md (1 MiB, 64 deep, no name twice); otherwise MALFORMED.
Result<nlohmann::json> ParseObject(std::span<const std::byte> payload);

/// The u32 at byte `at`, which is there.
inline std::uint32_t WordAt(std::span<const std::byte> payload, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, payload.data() + at, sizeof(word));
  return word;
}

}  // namespace consac::protocol2
