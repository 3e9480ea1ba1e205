#pragma once
// Memory that two processes of one host share, and turns by which they pass frames through it. Protocol 2's fast path;
// the connection beside it tells of everything else. Private to core.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "consac/base/status.h"
#include "transport/waiter.h"

namespace consac {

/// A region that one process made and another opened by its path. One object is used by one thread.
class SharedRegion {
 public:
  /// Makes one of zeros, the way that is best on this system; kUnavailable where there is none.
  static Result<std::unique_ptr<SharedRegion>> Create(std::size_t bytes);
  /// Maps another process' region; kDataLoss when it is smaller than `bytes` or `path` names something else.
  static Result<std::unique_ptr<SharedRegion>> Open(const std::string& path, std::size_t bytes);
  virtual ~SharedRegion() = default;
  SharedRegion(const SharedRegion&) = delete;
  SharedRegion& operator=(const SharedRegion&) = delete;

  std::byte* data() const { return data_; }  // 64-byte aligned
  std::size_t size() const { return size_; }
  /// What another process opens.
  const std::string& path() const { return path_; }

  /// The u32 at `offset`, a multiple of 4.
  std::atomic<std::uint32_t>& Word(std::size_t offset) const {
    return *reinterpret_cast<std::atomic<std::uint32_t>*>(data_ + offset);
  }
  /// Sleeps for at most `seconds` while the word at `offset` is `value`; may return early.
  virtual void SleepOn(std::size_t offset, std::uint32_t value, double seconds) = 0;
  /// Ends the other process' SleepOn of the word at `offset`.
  virtual void Wake(std::size_t offset) = 0;

 protected:
  SharedRegion() = default;
  std::byte* data_ = nullptr;
  std::size_t size_ = 0;
  std::string path_;
};

/// One way to share memory between processes. A row of SharedMemoryWays().
struct SharedMemoryWay {
  const char* name;  // "memfd", "shm_open", "section"
  Result<std::unique_ptr<SharedRegion>> (*create)(std::size_t bytes);
  Result<std::unique_ptr<SharedRegion>> (*open)(const std::string& path, std::size_t bytes);
};

/// The ways that this system has, the best first; SharedRegion takes the first.
std::span<const SharedMemoryWay> SharedMemoryWays();

/// A counter in a region: whoever has written a frame takes a turn, the other side sees it rise. One writer, one
/// reader. Lives no longer than its region.
class SharedTurn {
 public:
  SharedTurn() = default;
  /// The counter at `offset`, a multiple of 4; the word behind it tells that its reader sleeps.
  SharedTurn(SharedRegion& region, std::size_t offset);
  /// Writer: what was written before is there now; wakes a sleeping reader.
  void Take();
  /// Reader: true once a turn was taken since the last that was seen. Spins, then sleeps, at most `timeout_s`.
  bool Await(double timeout_s);

 private:
  SharedRegion* region_ = nullptr;
  std::size_t offset_ = 0;
  std::atomic<std::uint32_t>* count_ = nullptr;
  std::atomic<std::uint32_t>* sleeping_ = nullptr;
  std::uint32_t seen_ = 0;
  SpinBudget spin_;
};

}  // namespace consac
