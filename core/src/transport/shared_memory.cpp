#include "transport/shared_memory.h"

#include <vector>

#include "transport/shared_memory_ways.h"

namespace consac {

std::span<const SharedMemoryWay> SharedMemoryWays() {
  static const std::vector<SharedMemoryWay> ways = {
#if CONSAC_SHARED_MEMFD
    kMemfdWay,
#endif
#if CONSAC_SHARED_POSIX
    kPosixWay,
#endif
#if CONSAC_SHARED_SECTION
    kSectionWay,
#endif
  };
  return ways;
}

Result<std::unique_ptr<SharedRegion>> SharedRegion::Create(std::size_t bytes) {
  const auto ways = SharedMemoryWays();
  if (ways.empty()) return Status{StatusCode::kUnavailable, "this system shares no memory between processes"};
  return ways[0].create(bytes);
}

Result<std::unique_ptr<SharedRegion>> SharedRegion::Open(const std::string& path, std::size_t bytes) {
  const auto ways = SharedMemoryWays();
  if (ways.empty()) return Status{StatusCode::kUnavailable, "this system shares no memory between processes"};
  return ways[0].open(path, bytes);
}

SharedTurn::SharedTurn(SharedRegion& region, std::size_t offset)
    : region_(&region),
      offset_(offset),
      count_(&region.Word(offset)),
      sleeping_(&region.Word(offset + sizeof(std::uint32_t))),
      seen_(count_->load(std::memory_order_acquire)) {}

void SharedTurn::Take() {
  count_->fetch_add(1, std::memory_order_seq_cst);
  if (sleeping_->load(std::memory_order_seq_cst) != 0) region_->Wake(offset_);
}

bool SharedTurn::Await(double timeout_s) {
  const auto taken = [&] { return count_->load(std::memory_order_acquire) != seen_; };
  if (!taken()) {
    if (timeout_s <= 0.0) return false;
    if (!spin_.Spin(timeout_s, taken)) {
      sleeping_->store(1, std::memory_order_seq_cst);
      if (!taken()) region_->SleepOn(offset_, seen_, timeout_s);
      sleeping_->store(0, std::memory_order_seq_cst);
      if (!taken()) return false;
    }
  }
  seen_ = count_->load(std::memory_order_acquire);
  return true;
}

}  // namespace consac
