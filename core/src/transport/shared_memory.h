#pragma once
// Memory that two processes of one host share, and turns by which they pass frames through it. Protocol 2's fast path;
// the connection beside it tells of everything else. Private to core.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "consac/base/status.h"
#include "transport/waiter.h"

namespace consac {

/// A region that one process made and another opened by its path. On Linux sealed: its size cannot change under a
/// reader.
class SharedRegion {
 public:
  /// Makes one of zeros.
  static Result<std::unique_ptr<SharedRegion>> Create(std::size_t bytes);
  /// Maps another process' region; kDataLoss when it is smaller than `bytes` or may still shrink.
  static Result<std::unique_ptr<SharedRegion>> Open(const std::string& path, std::size_t bytes);
  ~SharedRegion();
  SharedRegion(const SharedRegion&) = delete;
  SharedRegion& operator=(const SharedRegion&) = delete;

  std::byte* data() const { return data_; }
  std::size_t size() const { return size_; }
  /// What another process opens.
  const std::string& path() const { return path_; }

 private:
  SharedRegion() = default;
  std::byte* data_ = nullptr;
  std::size_t size_ = 0;
  std::string path_;
  int descriptor_ = -1;
};

/// A counter in a region: whoever has written a frame takes a turn, the other side sees it rise. One writer, one
/// reader.
class SharedTurn {
 public:
  SharedTurn() = default;
  /// The counter at `at`, 4-byte aligned; the word behind it tells that its reader sleeps.
  explicit SharedTurn(std::byte* at);
  /// Writer: what was written before is there now; wakes a sleeping reader.
  void Take();
  /// Reader: true once a turn was taken since the last that was seen. Spins, then sleeps, at most `timeout_s`.
  bool Await(double timeout_s);

 private:
  std::atomic<std::uint32_t>* count_ = nullptr;
  std::atomic<std::uint32_t>* sleeping_ = nullptr;
  std::uint32_t seen_ = 0;
  SpinBudget spin_;
};

}  // namespace consac
