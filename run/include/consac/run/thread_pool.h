#pragma once
// The threads that learning runs on: an Executor over a few workers that wait between jobs.

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "consac/base/executor.h"

namespace consac::run {

/// `threads` - 1 workers and the calling thread share each job's blocks.
class ThreadPool {
 public:
  /// `threads` >= 1; 1 starts none.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;
  /// For LearnerOptions; valid for the pool's life. With one thread: the empty executor.
  Executor executor();

 private:
  void Work();
  void Run(std::int64_t count, void (*task)(void*, std::int64_t), void* context);
  void TakeBlocks();

  std::vector<std::thread> workers_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::atomic<std::uint64_t> job_{0};  // rises with every job
  std::atomic<std::int64_t> next_{0}, busy_{0};
  std::int64_t count_ = 0;
  void (*task_)(void*, std::int64_t) = nullptr;
  void* context_ = nullptr;
  std::atomic<bool> stop_{false};
};

}  // namespace consac::run
