// macOS and other POSIX systems: shm_open with a name that nobody guesses, for this user only, gone from the system
// once the other process has mapped it. No sealing there: the owner's own user could shrink it. No portable way to
// sleep on a word of it either, so a reader sleeps in growing pieces.
#include "transport/shared_memory_ways.h"

#if CONSAC_SHARED_POSIX

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "base/entropy.h"
#include "consac/base/hooks.h"

namespace consac {
namespace {

constexpr char kPosixPrefix[] = "/consac-";
constexpr std::size_t kPosixSecret = 10;  // bytes: macOS allows names of 31 characters

Status PosixError(const std::string& what) {
  return {StatusCode::kUnavailable, what + ": " + std::strerror(errno)};
}

class PosixRegion final : public SharedRegion {
 public:
  static Result<std::unique_ptr<SharedRegion>> Make(std::size_t bytes) {
    std::unique_ptr<PosixRegion> region(new PosixRegion);
    const std::string secret = UnguessableHex(kPosixSecret);
    if (secret.empty())
      return Status{StatusCode::kUnavailable, "the system has no randomness to name shared memory by"};
    region->path_ = kPosixPrefix + secret;
    region->descriptor_ = shm_open(region->path_.c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
    if (region->descriptor_ < 0) return PosixError("cannot make shared memory");
    region->owned_ = true;
    if (ftruncate(region->descriptor_, static_cast<off_t>(bytes)) != 0)
      return PosixError("cannot size shared memory to " + std::to_string(bytes) + " bytes");
    CONSAC_RETURN_IF_ERROR(region->Map(bytes));
    return std::unique_ptr<SharedRegion>(std::move(region));
  }

  static Result<std::unique_ptr<SharedRegion>> OpenPath(const std::string& path, std::size_t bytes) {
    // Somebody else's text: nothing but such a name is opened.
    const std::string_view name = path;
    const std::size_t length = sizeof(kPosixPrefix) - 1;
    if (!name.starts_with(kPosixPrefix) || name.size() != length + 2 * kPosixSecret ||
        name.find_first_not_of("0123456789abcdef", length) != std::string_view::npos) {
      return Status{StatusCode::kDataLoss, "'" + path + "' is no shared memory; expected /consac-NUMBER"};
    }
    std::unique_ptr<PosixRegion> region(new PosixRegion);
    region->path_ = path;
    region->descriptor_ = shm_open(path.c_str(), O_RDWR, 0);
    if (region->descriptor_ < 0) return PosixError("cannot open the shared memory '" + path + "'");
    struct stat what;
    if (fstat(region->descriptor_, &what) != 0 || what.st_uid != geteuid() ||
        static_cast<std::size_t>(what.st_size) < bytes) {
      return Status{StatusCode::kDataLoss, "the shared memory '" + path + "' is smaller than " + std::to_string(bytes) +
                                               " bytes, or another user's"};
    }
    CONSAC_RETURN_IF_ERROR(region->Map(bytes));
    (void)shm_unlink(path.c_str());  // both have it
    return std::unique_ptr<SharedRegion>(std::move(region));
  }

  ~PosixRegion() override {
    if (data_ != nullptr) munmap(data_, size_);
    if (descriptor_ >= 0) close(descriptor_);
    if (owned_) (void)shm_unlink(path_.c_str());  // nobody opened it
  }

  void SleepOn(std::size_t offset, std::uint32_t value, double seconds) override {
    constexpr double kFirstPiece = 20e-6, kLongestPiece = 1e-3;  // s
    const std::atomic<std::uint32_t>& word = Word(offset);
    const double deadline = Now() + seconds;
    for (double piece = kFirstPiece; word.load(std::memory_order_acquire) == value;
         piece = std::min(2.0 * piece, kLongestPiece)) {
      const double left = deadline - Now();
      if (left <= 0.0) return;
      std::this_thread::sleep_for(std::chrono::duration<double>(std::min(piece, left)));
    }
  }
  void Wake(std::size_t) override {}

 private:
  PosixRegion() = default;

  Status Map(std::size_t bytes) {
    void* mapped = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, 0);
    if (mapped == MAP_FAILED) return PosixError("cannot map the shared memory '" + path_ + "'");
    data_ = static_cast<std::byte*>(mapped);
    size_ = bytes;
    return Status::Ok();
  }

  int descriptor_ = -1;
  bool owned_ = false;
};

}  // namespace

const SharedMemoryWay kPosixWay = {"shm_open", PosixRegion::Make, PosixRegion::OpenPath};

}  // namespace consac

#endif
