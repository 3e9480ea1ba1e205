#pragma once
// Writing that a user may break off. Private to core/server.

#include <atomic>
#include <cstddef>
#include <span>

#include "consac/base/text.h"
#include "consac/transport/transport.h"
#include "server/limits.h"

namespace consac {

/// As Transport::Write; where the peer does not take all at once, kCancelled within kStopLook of `*stop` (null: never).
inline Status WriteUnlessStopped(Transport& transport, std::span<const std::byte> bytes, double timeout_s,
                                 const std::atomic<bool>* stop) {
  if (stop == nullptr) return transport.Write(bytes, timeout_s);
  double without = 0.0;  // s in which the peer took none
  while (!bytes.empty()) {
    const Result<std::size_t> count = transport.WriteSome(bytes, kStopLook);
    if (!count.ok()) return count.status();
    bytes = bytes.subspan(*count);
    without = *count > 0 ? 0.0 : without + kStopLook;
    if (without >= timeout_s) {
      return {StatusCode::kDeadlineExceeded, transport.peer() + " takes no data for " + NumberText(timeout_s) +
                                                 " s; it hangs or is stopped in a debugger"};
    }
    if (!bytes.empty() && stop->load(std::memory_order_relaxed))
      return {StatusCode::kCancelled, "stopped while waiting for " + transport.peer()};
  }
  return Status::Ok();
}

}  // namespace consac
