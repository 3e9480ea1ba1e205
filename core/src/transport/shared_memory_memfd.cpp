// Linux: a memfd, named by its owner's descriptor, sealed so that its size cannot change under a reader. Sleeps on a
// futex.
#include "transport/shared_memory_ways.h"

#if CONSAC_SHARED_MEMFD

#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>

#include "base/linux_calls.h"

namespace consac {
namespace {

Status MemfdError(const std::string& what) {
  return {StatusCode::kUnavailable, what + ": " + std::strerror(errno)};
}

class MemfdRegion final : public SharedRegion {
 public:
  static Result<std::unique_ptr<SharedRegion>> Make(std::size_t bytes) {
    std::unique_ptr<MemfdRegion> region(new MemfdRegion);
    region->descriptor_ = static_cast<int>(syscall(SYS_memfd_create, "consac", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (region->descriptor_ < 0) return MemfdError("cannot make shared memory");
    if (ftruncate(region->descriptor_, static_cast<off_t>(bytes)) != 0)
      return MemfdError("cannot size shared memory to " + std::to_string(bytes) + " bytes");
    if (fcntl(region->descriptor_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0)
      return MemfdError("cannot seal shared memory");
    region->path_ = "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(region->descriptor_);
    CONSAC_RETURN_IF_ERROR(region->Map(bytes));
    return std::unique_ptr<SharedRegion>(std::move(region));
  }

  static Result<std::unique_ptr<SharedRegion>> OpenPath(const std::string& path, std::size_t bytes) {
    // Somebody else's text: nothing but a descriptor of a process is opened.
    int process = 0, descriptor = 0, length = 0;
    if (std::sscanf(path.c_str(), "/proc/%d/fd/%d%n", &process, &descriptor, &length) != 2 ||
        static_cast<std::size_t>(length) != path.size()) {
      return Status{StatusCode::kDataLoss, "'" + path + "' is no shared memory; expected /proc/PROCESS/fd/NUMBER"};
    }
    std::unique_ptr<MemfdRegion> region(new MemfdRegion);
    region->path_ = path;
    region->descriptor_ = open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK);
    if (region->descriptor_ < 0) return MemfdError("cannot open the shared memory '" + path + "'");
    struct stat what;
    const int seals = fcntl(region->descriptor_, F_GET_SEALS);
    const bool sealed = seals >= 0 && (seals & F_SEAL_SHRINK) != 0;
    if (fstat(region->descriptor_, &what) != 0 || !sealed || static_cast<std::size_t>(what.st_size) < bytes) {
      return Status{StatusCode::kDataLoss, "the shared memory '" + path + "' is smaller than " + std::to_string(bytes) +
                                               " bytes, or may yet shrink"};
    }
    CONSAC_RETURN_IF_ERROR(region->Map(bytes));
    return std::unique_ptr<SharedRegion>(std::move(region));
  }

  ~MemfdRegion() override {
    if (data_ != nullptr) munmap(data_, size_);
    if (descriptor_ >= 0) close(descriptor_);
  }

  void SleepOn(std::size_t offset, std::uint32_t value, double seconds) override {
    timespec time;
    time.tv_sec = static_cast<time_t>(seconds);
    time.tv_nsec = static_cast<long>((seconds - std::floor(seconds)) * 1e9);
    (void)syscall(SYS_futex, data_ + offset, FUTEX_WAIT, value, &time, nullptr, 0);
  }
  void Wake(std::size_t offset) override {
    (void)syscall(SYS_futex, data_ + offset, FUTEX_WAKE, 1, nullptr, nullptr, 0);
  }

 private:
  MemfdRegion() = default;

  Status Map(std::size_t bytes) {
    void* mapped = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
    if (mapped == MAP_FAILED) return MemfdError("cannot map the shared memory '" + path_ + "'");
    data_ = static_cast<std::byte*>(mapped);
    size_ = bytes;
    return Status::Ok();
  }

  int descriptor_ = -1;
};

}  // namespace

const SharedMemoryWay kMemfdWay = {"memfd", MemfdRegion::Make, MemfdRegion::OpenPath};

}  // namespace consac

#endif
