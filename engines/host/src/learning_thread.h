#pragma once
// The thread on which learners learn, and models that are asked ahead act, while the engine's own goes on. Private to
// host.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "consac/base/thread.h"

namespace consac::host {

/// What a job and the engine's thread take turns at. The engine's thread goes first: it waits for the job's present
/// turn at most.
class Sharing {
 public:
  /// The engine's turn, until what is returned goes.
  std::unique_lock<std::mutex> Mine() {
    waits_.fetch_add(1);
    std::unique_lock lock(mutex_);
    waits_.fetch_sub(1);
    return lock;
  }
  /// A turn of the job.
  std::unique_lock<std::mutex> Job() {
    while (waits_.load() != 0) std::this_thread::yield();
    return std::unique_lock(mutex_);
  }

 private:
  std::mutex mutex_;
  std::atomic<int> waits_ = 0;
};

/// Does one job at a time. What the job touches is its own until it is done.
class LearningThread {
 public:
  LearningThread() = default;
  /// Waits for the job under way.
  ~LearningThread() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    thread_.Join();
  }
  LearningThread(const LearningThread&) = delete;
  LearningThread& operator=(const LearningThread&) = delete;

  /// Once, before the first job. kResourceExhausted where the system gives no thread.
  Status Start() {
    return thread_.Start([this] { Work(); });
  }
  /// Begins a job; none may be under way.
  void Begin(std::function<void()> job) {
    {
      const std::lock_guard lock(mutex_);
      job_ = std::move(job);
      busy_ = true;
    }
    wake_.notify_all();
  }
  /// True when no job is under way; waits for that at most `wait_s`.
  bool Done(double wait_s) {
    std::unique_lock lock(mutex_);
    if (busy_ && wait_s > 0.0) wake_.wait_for(lock, std::chrono::duration<double>(wait_s), [this] { return !busy_; });
    return !busy_;
  }
  /// Waits until no job is under way.
  void Await() {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [this] { return !busy_; });
  }
  /// Whether the job should come to an early end: the thread is to stop.
  bool stopping() {
    const std::lock_guard lock(mutex_);
    return stop_;
  }

 private:
  void Work() {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [this] { return busy_ || stop_; });
      if (stop_) return;
      lock.unlock();
      job_();
      lock.lock();
      busy_ = false;
      wake_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::function<void()> job_;
  bool busy_ = false, stop_ = false;
  Thread thread_;  // last: it uses what is above
};

}  // namespace consac::host
