#pragma once
// Names that nobody can guess. Private to core; worlds and learning take their numbers from base/rng.h.

#include <cstddef>
#include <span>
#include <string>

namespace consac {

/// `bytes` bytes of the system's own randomness, as twice so many hexadecimal digits; empty if it has none.
std::string UnguessableHex(std::size_t bytes);

/// One way to ask this system for randomness: true once all of the span is filled.
using EntropySource = bool (*)(std::span<unsigned char> into);
/// The ways that this system has, the first that answers is taken.
std::span<const EntropySource> EntropySources();

}  // namespace consac
