#pragma once
// Waits that a stop ends.

#include <atomic>

namespace consac::run {

/// Waits `seconds`, or until `stop`.
void Pause(double seconds, const std::atomic<bool>& stop);

}  // namespace consac::run
