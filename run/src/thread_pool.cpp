#include "consac/run/thread_pool.h"

namespace consac::run {
namespace {
constexpr int kSpins = 2000;  // about 20 us: the gap between two minibatches
}

ThreadPool::ThreadPool(int threads) {
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { Work(); });
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

Executor ThreadPool::executor() {
  if (workers_.empty()) return {};
  return {[](void* user, std::int64_t count, void (*task)(void*, std::int64_t), void* context) {
            static_cast<ThreadPool*>(user)->Run(count, task, context);
          },
          this};
}

void ThreadPool::TakeBlocks() {
  for (std::int64_t i = next_.fetch_add(1); i < count_; i = next_.fetch_add(1)) task_(context_, i);
}

// Every worker takes part in every job, so that none can still be in the last one when the next begins.
void ThreadPool::Run(std::int64_t count, void (*task)(void*, std::int64_t), void* context) {
  count_ = count;
  task_ = task;
  context_ = context;
  next_.store(0);
  busy_.store(static_cast<std::int64_t>(workers_.size()));
  {
    const std::lock_guard lock(mutex_);
    job_.fetch_add(1);
  }
  wake_.notify_all();
  TakeBlocks();
  while (busy_.load() > 0) std::this_thread::yield();
}

void ThreadPool::Work() {
  std::uint64_t seen = 0;
  while (true) {
    for (int i = 0; i < kSpins && job_.load() == seen && !stop_; ++i) {
    }
    if (job_.load() == seen) {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [&] { return stop_ || job_.load() != seen; });
    }
    if (stop_) return;
    seen = job_.load();
    TakeBlocks();
    busy_.fetch_sub(1);
  }
}

}  // namespace consac::run
