// Two ends of a connection inside one process: a byte queue each way, safe between two threads.
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <vector>

#include "consac/transport/transport.h"
#include "transport/waiter.h"

namespace consac {
namespace {

constexpr std::size_t kQueueBytes = 1 << 16;

/// One direction: a ring of bytes.
class ByteQueue {
 public:
  /// Bytes moved into `into`; waits at most `timeout_s` for the first.
  std::size_t Pop(std::span<std::byte> into, double timeout_s, bool* closed) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(timeout_s), [this] { return size_ > 0 || closed_; });
    const std::size_t count = std::min(size_, into.size());
    for (std::size_t i = 0; i < count; ++i) into[i] = ring_[(begin_ + i) % kQueueBytes];
    begin_ = (begin_ + count) % kQueueBytes;
    size_ -= count;
    *closed = closed_ && count == 0;
    if (count > 0) changed_.notify_all();
    return count;
  }

  /// Bytes taken from `bytes`; waits at most `timeout_s` for room.
  std::size_t Push(std::span<const std::byte> bytes, double timeout_s, bool* closed) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(timeout_s),
                      [this] { return size_ < kQueueBytes || closed_; });
    *closed = closed_;
    const std::size_t count = closed_ ? 0 : std::min(kQueueBytes - size_, bytes.size());
    for (std::size_t i = 0; i < count; ++i) ring_[(begin_ + size_ + i) % kQueueBytes] = bytes[i];
    size_ += count;
    if (count > 0) changed_.notify_all();
    return count;
  }

  void Close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::byte> ring_ = std::vector<std::byte>(kQueueBytes);
  std::size_t begin_ = 0, size_ = 0;
  bool closed_ = false;
};

/// Both directions.
struct Pipe {
  ByteQueue to_first, to_second;
};

class InProcessTransport final : public Transport {
 public:
  InProcessTransport(std::shared_ptr<Pipe> pipe, ByteQueue& in, ByteQueue& out)
      : pipe_(std::move(pipe)), in_(in), out_(out) {}
  ~InProcessTransport() override { Close(); }

  Result<std::size_t> Read(std::span<std::byte> into, double timeout_s) override {
    bool closed = false;
    std::size_t count = 0;
    const auto ready = [&] {
      count = in_.Pop(into, 0.0, &closed);
      return count > 0 || closed;
    };
    if (!ready() && timeout_s > 0.0 && !spin_.Spin(timeout_s, ready)) count = in_.Pop(into, timeout_s, &closed);
    if (closed) return Status{StatusCode::kUnavailable, "the other end in this process closed the connection"};
    return count;
  }

  Result<std::size_t> WriteSome(std::span<const std::byte> bytes, double timeout_s) override {
    bool closed = false;
    const std::size_t count = out_.Push(bytes, timeout_s, &closed);
    if (closed) return Status{StatusCode::kUnavailable, "the other end in this process closed the connection"};
    return count;
  }

  void Close() override {
    in_.Close();
    out_.Close();
  }

  std::string peer() const override { return "in-process"; }

 private:
  std::shared_ptr<Pipe> pipe_;  // owned by both ends, so that either may go first
  ByteQueue& in_;
  ByteQueue& out_;
  SpinBudget spin_;
};

}  // namespace

std::pair<std::unique_ptr<Transport>, std::unique_ptr<Transport>> MakeInProcessPair() {
  const auto pipe = std::make_shared<Pipe>();
  return {std::make_unique<InProcessTransport>(pipe, pipe->to_first, pipe->to_second),
          std::make_unique<InProcessTransport>(pipe, pipe->to_second, pipe->to_first)};
}

}  // namespace consac
