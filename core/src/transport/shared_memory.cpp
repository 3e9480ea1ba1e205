#include "transport/shared_memory.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#if defined(__linux__)
#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <ctime>
#else
#include <chrono>
#include <thread>
#endif

namespace consac {

#if defined(__linux__)

namespace {

Status SystemError(const std::string& what) {
  return {StatusCode::kUnavailable, what + ": " + std::strerror(errno)};
}

}  // namespace

Result<std::unique_ptr<SharedRegion>> SharedRegion::Create(std::size_t bytes) {
  std::unique_ptr<SharedRegion> region(new SharedRegion);
  region->descriptor_ = memfd_create("consac", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (region->descriptor_ < 0) return SystemError("cannot make shared memory");
  if (ftruncate(region->descriptor_, static_cast<off_t>(bytes)) != 0)
    return SystemError("cannot size shared memory to " + std::to_string(bytes) + " bytes");
  if (fcntl(region->descriptor_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
    return SystemError("cannot seal shared memory");
  void* mapped = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, region->descriptor_, 0);
  if (mapped == MAP_FAILED) return SystemError("cannot map shared memory");
  region->data_ = static_cast<std::byte*>(mapped);
  region->size_ = bytes;
  region->path_ = "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(region->descriptor_);
  return region;
}

Result<std::unique_ptr<SharedRegion>> SharedRegion::Open(const std::string& path, std::size_t bytes) {
  // Somebody else's text: nothing but a descriptor of a process is opened.
  int process = 0, descriptor = 0, length = 0;
  if (std::sscanf(path.c_str(), "/proc/%d/fd/%d%n", &process, &descriptor, &length) != 2 ||
      static_cast<std::size_t>(length) != path.size()) {
    return Status{StatusCode::kDataLoss, "'" + path + "' is no shared memory; expected /proc/PROCESS/fd/NUMBER"};
  }
  std::unique_ptr<SharedRegion> region(new SharedRegion);
  region->descriptor_ = open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
  if (region->descriptor_ < 0) return SystemError("cannot open the shared memory '" + path + "'");
  struct stat what;
  const int seals = fcntl(region->descriptor_, F_GET_SEALS);
  const bool sealed = seals >= 0 && (seals & F_SEAL_SHRINK) != 0;
  if (fstat(region->descriptor_, &what) != 0 || !sealed || static_cast<std::size_t>(what.st_size) < bytes) {
    return Status{StatusCode::kDataLoss, "the shared memory '" + path + "' is smaller than " + std::to_string(bytes) +
                                             " bytes, or may yet shrink"};
  }
  void* mapped = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, region->descriptor_, 0);
  if (mapped == MAP_FAILED) return SystemError("cannot map the shared memory '" + path + "'");
  region->data_ = static_cast<std::byte*>(mapped);
  region->size_ = bytes;
  region->path_ = path;
  return region;
}

SharedRegion::~SharedRegion() {
  if (data_ != nullptr) munmap(data_, size_);
  if (descriptor_ >= 0) close(descriptor_);
}

namespace {

void SleepOn(std::atomic<std::uint32_t>* word, std::uint32_t value, double seconds) {
  timespec time;
  time.tv_sec = static_cast<time_t>(seconds);
  time.tv_nsec = static_cast<long>((seconds - std::floor(seconds)) * 1e9);
  (void)syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(word), FUTEX_WAIT, value, &time, nullptr, 0);
}

void Wake(std::atomic<std::uint32_t>* word) {
  (void)syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(word), FUTEX_WAKE, 1, nullptr, nullptr, 0);
}

}  // namespace

#else

// Other systems go on over TCP until their named mappings are written and tested there.
Result<std::unique_ptr<SharedRegion>> SharedRegion::Create(std::size_t) {
  return Status{StatusCode::kUnavailable, "shared memory between processes is there on Linux only"};
}
Result<std::unique_ptr<SharedRegion>> SharedRegion::Open(const std::string&, std::size_t) {
  return Status{StatusCode::kUnavailable, "shared memory between processes is there on Linux only"};
}
SharedRegion::~SharedRegion() = default;

namespace {

void SleepOn(std::atomic<std::uint32_t>*, std::uint32_t, double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(std::min(seconds, 1e-4)));
}
void Wake(std::atomic<std::uint32_t>*) {}

}  // namespace

#endif

SharedTurn::SharedTurn(std::byte* at)
    : count_(reinterpret_cast<std::atomic<std::uint32_t>*>(at)),
      sleeping_(reinterpret_cast<std::atomic<std::uint32_t>*>(at + 4)),
      seen_(count_->load(std::memory_order_acquire)) {}

void SharedTurn::Take() {
  count_->fetch_add(1, std::memory_order_seq_cst);
  if (sleeping_->load(std::memory_order_seq_cst) != 0) Wake(count_);
}

bool SharedTurn::Await(double timeout_s) {
  const auto taken = [&] { return count_->load(std::memory_order_acquire) != seen_; };
  if (!taken()) {
    if (timeout_s <= 0.0) return false;
    if (!spin_.Spin(timeout_s, taken)) {
      sleeping_->store(1, std::memory_order_seq_cst);
      if (!taken()) SleepOn(count_, seen_, timeout_s);
      sleeping_->store(0, std::memory_order_seq_cst);
      if (!taken()) return false;
    }
  }
  seen_ = count_->load(std::memory_order_acquire);
  return true;
}

}  // namespace consac
