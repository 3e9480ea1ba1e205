#pragma once
// Whether there is memory for what a peer or a file asks for, where running out of it could not be caught.

#include <cstddef>
#include <string_view>

#include "consac/base/status.h"

namespace consac {

/// Ok when `bytes` could be had in one piece just now; they are given back. kResourceExhausted names `what` they are
/// for. Nothing is reserved: ask right before taking them, and for all of them together.
Status CheckMemory(std::size_t bytes, std::string_view what);

}  // namespace consac
