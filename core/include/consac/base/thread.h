#pragma once
// A thread that may fail to start. Threads are the host's: core and learn start none; the program, run and host start
// all of theirs by this. The standard's own throws where the system gives no more, which would kill a game.

#include <cstddef>
#include <functional>

#include "consac/base/status.h"

namespace consac {

/// One thread. Not movable: its body may point to what stands beside it.
class Thread {
 public:
  Thread() = default;
  /// Waits for the body to return.
  ~Thread() { Join(); }
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;

  /// Runs `body`, which must be callable, on a thread of its own with a stack of 8 MiB; one at a time.
  /// kResourceExhausted where processes, threads or memory are short: nothing was started, nothing has changed.
  Status Start(std::function<void()> body);
  /// Whether a thread was started that nobody has waited for.
  bool started() const { return started_; }
  /// Waits for the body to return; does nothing where none was started.
  void Join();

 private:
  std::function<void()> body_;
  alignas(void*) std::byte handle_[sizeof(void*)] = {};  // the system's
  bool started_ = false;
};

}  // namespace consac
