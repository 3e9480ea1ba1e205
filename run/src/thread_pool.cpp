#include "consac/run/thread_pool.h"

#include <thread>
#include <utility>

namespace consac::run {
namespace {
constexpr int kSpins = 60000;  // about 60 us: what lies between two jobs of an update, an optimiser's step above all
}

// A constructor that has come to its end here: whatever fails below, the destructor ends what has begun.
ThreadPool::ThreadPool(int threads) : ThreadPool() {
  for (int i = 1; i < threads; ++i) {
    auto worker = std::make_unique<Thread>();
    const Status started = worker->Start([this] { Work(); });
    if (!started.ok()) {
      Log(LogLevel::kWarning, "learning on " + std::to_string(i) + " of " + std::to_string(threads) +
                                  " threads, with the same result: " + started.message());
      return;
    }
    workers_.push_back(std::move(worker));
  }
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (const std::unique_ptr<Thread>& worker : workers_) worker->Join();
}

Executor ThreadPool::executor() {
  if (workers_.empty()) return {};
  return {[](void* user, std::int64_t count, void (*task)(void*, std::int64_t), void* context) {
            static_cast<ThreadPool*>(user)->Run(count, task, context);
          },
          this};
}

void ThreadPool::TakeBlocks() {
  try {
    for (std::int64_t i = next_.fetch_add(1); i < count_; i = next_.fetch_add(1)) task_(context_, i);
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (failure_ == nullptr) failure_ = std::current_exception();
  }
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
  if (failure_ != nullptr) std::rethrow_exception(std::exchange(failure_, nullptr));
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
