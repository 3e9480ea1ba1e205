#pragma once
// What becomes of a run when the machine has no more to give: memory is kept aside for saving, and what libraries throw
// becomes a Status at the edges, on whichever thread it was thrown.

#include <cstddef>
#include <cstdint>

#include "consac/base/status.h"

namespace consac::run {

/// First aid for an allocation that finds no memory, where nothing has to be saved afterwards but what is under way has
/// to come to its end.
inline constexpr std::size_t kFirstAid = std::size_t{8} << 20;

/// Memory that is kept aside, untouched, in two parts. First aid goes to the first allocation of the process, on any
/// thread, that finds none, so that whoever needed it goes on; the run sees that and ends in order. What even that
/// cannot hold throws std::bad_alloc there. The rest is for saving: nobody gets it before Release. One object holds
/// memory at a time: those made meanwhile hold none, and hear of a shortage alike.
class MemoryReserve {
 public:
  /// So many bytes, or as much of them as there is.
  explicit MemoryReserve(std::size_t first_aid, std::size_t for_saving = 0);
  ~MemoryReserve();
  MemoryReserve(const MemoryReserve&) = delete;
  MemoryReserve& operator=(const MemoryReserve&) = delete;
  /// Whether memory has run short since this was made. Needs none.
  bool ran_short() const;
  /// Ok, or kResourceExhausted once it has.
  Status health() const;
  /// Gives free what was kept for saving, to whoever allocates next: call it once only the saving thread does.
  void Release();

 private:
  static void OnShortage();

  std::uint64_t shortages_before_;
  void* first_aid_ = nullptr;  // of the one that holds; guarded
  void* for_saving_ = nullptr;
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
