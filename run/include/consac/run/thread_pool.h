#pragma once
// The threads that learning runs on: an Executor over a few workers that wait between jobs. Where the system gives
// fewer threads than were asked for, the pool goes on with those, and says so once: results do not depend on their
// number.

#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <vector>

#include "consac/base/executor.h"
#include "consac/base/thread.h"

namespace consac::run {

/// `threads` - 1 workers and the calling thread share each job's blocks. What a block throws (memory that runs out) is
/// thrown on the calling thread once the job is over.
class ThreadPool {
 public:
  /// `threads` >= 1; 1 starts none.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  /// For LearnerOptions; valid for the pool's life. With one thread: the empty executor.
  Executor executor();
  /// Threads that share a job, the calling one included: as many as were asked for, or as there are.
  int threads() const { return static_cast<int>(workers_.size()) + 1; }

 private:
  ThreadPool() = default;
  void Work();
  void Run(std::int64_t count, void (*task)(void*, std::int64_t), void* context);
  void TakeBlocks();

  std::vector<std::unique_ptr<Thread>> workers_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::atomic<std::uint64_t> job_{0};  // rises with every job
  std::atomic<std::int64_t> next_{0}, busy_{0};
  std::int64_t count_ = 0;
  void (*task_)(void*, std::int64_t) = nullptr;
  void* context_ = nullptr;
  std::exception_ptr failure_;  // guarded by mutex_; the first of the present job
  std::atomic<bool> stop_{false};
};

}  // namespace consac::run
