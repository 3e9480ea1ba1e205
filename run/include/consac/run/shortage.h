#pragma once
// What becomes of a run when the machine has no more to give: memory is kept aside for saving, and what libraries throw
// becomes a Status at the edges, on whichever thread it was thrown.

#include <cstddef>
#include <cstdint>

#include "consac/base/status.h"

namespace consac::run {

/// Memory that is kept aside, untouched. The first allocation of the process, on any thread, that finds none gets it,
/// so that whoever needed it goes on; the run sees that and ends in order. One object holds it at a time: those made
/// meanwhile hold none, and hear of a shortage alike.
class MemoryReserve {
 public:
  /// `bytes`, or as much of them as there is.
  explicit MemoryReserve(std::size_t bytes);
  ~MemoryReserve();
  MemoryReserve(const MemoryReserve&) = delete;
  MemoryReserve& operator=(const MemoryReserve&) = delete;
  /// Ok, or kResourceExhausted once memory has run short since this was made.
  Status health() const;

 private:
  std::uint64_t shortages_before_;
  bool holds_ = false;
};

/// Inside a catch block: the exception as a Status. kResourceExhausted for memory, threads, descriptors and disk,
/// else kInternal.
Status CaughtException();

/// What `body` returns, a Status or a Result; CaughtException where it throws.
template <class Body>
auto Guarded(Body&& body) -> decltype(body()) {
  try {
    return body();
  } catch (...) {
    return CaughtException();
  }
}

}  // namespace consac::run
