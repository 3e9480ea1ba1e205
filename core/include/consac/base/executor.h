#pragma once
// Threads are the host's. Parallel work is handed to an executor as numbered blocks; which thread runs which
// block never changes a result, because blocks do not depend on the number of threads and are reduced in order.

#include <cstdint>
#include <type_traits>

namespace consac {

/// Runs `task(context, i)` for every i in [0, count) and returns when all are done; any order, any thread.
struct Executor {
  /// The host's loop; null runs the blocks one after another on the calling thread.
  void (*run)(void* user, std::int64_t count, void (*task)(void* context, std::int64_t index), void* context) = nullptr;
  /// Handed to `run`.
  void* user = nullptr;

  /// Calls body(i) for every block.
  template <class Body>
  void ForEach(std::int64_t count, Body&& body) const {
    if (run == nullptr || count <= 1) {
      for (std::int64_t i = 0; i < count; ++i) body(i);
      return;
    }
    using Callable = std::remove_reference_t<Body>;
    run(
        user, count, [](void* context, std::int64_t index) { (*static_cast<Callable*>(context))(index); }, &body);
  }
};

}  // namespace consac
