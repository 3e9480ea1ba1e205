#include "consac/run/pause.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "consac/base/hooks.h"

namespace consac::run {

void Pause(double seconds, const std::atomic<bool>& stop) {
  for (const double end = Now() + seconds; !stop.load();) {
    const double left = end - Now();
    if (left <= 0.0) return;
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left, 0.02)));
  }
}

}  // namespace consac::run
