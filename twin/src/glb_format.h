#pragma once
// The container of glTF 2.0, GLB: what its words are. Private to twin.

#include <cstdint>

namespace consac::twin {

inline constexpr std::uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
inline constexpr int kFloat = 5126;  ///< a type of numbers

}  // namespace consac::twin
