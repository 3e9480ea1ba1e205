#pragma once
// Names that nobody can guess. Private to core; worlds and learning take their numbers from base/rng.h.

#include <cstddef>
#include <string>

namespace consac {

/// `bytes` bytes of the system's own randomness, as twice so many hexadecimal digits; empty if it has none.
std::string UnguessableHex(std::size_t bytes);

}  // namespace consac
