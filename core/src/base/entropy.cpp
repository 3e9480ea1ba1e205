#include "base/entropy.h"

#include <vector>

#if defined(_WIN32)
#include <random>
#elif defined(__linux__)
#include <cerrno>

#include "base/linux_calls.h"
#elif defined(__APPLE__)
#include <sys/random.h>
#else
#include <unistd.h>
#endif

namespace consac {
namespace {

#if defined(_WIN32)

bool AskRandomDevice(std::span<unsigned char> into) {
  std::random_device device;
  for (unsigned char& byte : into) byte = static_cast<unsigned char>(device());
  return true;
}
constexpr EntropySource kEntropySources[] = {AskRandomDevice};

#elif defined(__linux__)

/// Fills `into` by calls of `read(bytes, count)`, which fill a part each.
template <typename Read>
bool FillByParts(std::span<unsigned char> into, const Read& read) {
  while (!into.empty()) {
    const auto count = read(into.data(), into.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    into = into.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

#if defined(SYS_getrandom)
bool AskKernel(std::span<unsigned char> into) {
  return FillByParts(into, [](void* bytes, std::size_t count) { return syscall(SYS_getrandom, bytes, count, 0); });
}
#endif

// Kernels before 3.17, and sandboxes that refuse the call.
bool ReadRandomFile(std::span<unsigned char> into) {
  const int file = open("/dev/urandom", O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool filled = FillByParts(into, [&](void* bytes, std::size_t count) { return read(file, bytes, count); });
  close(file);
  return filled;
}

constexpr EntropySource kEntropySources[] = {
#if defined(SYS_getrandom)
    AskKernel,
#endif
    ReadRandomFile,
};

#else

bool AskSystem(std::span<unsigned char> into) {
  constexpr std::size_t kMost = 256;  // bytes that one call gives
  for (; !into.empty(); into = into.subspan(into.size() < kMost ? into.size() : kMost))
    if (getentropy(into.data(), into.size() < kMost ? into.size() : kMost) != 0) return false;
  return true;
}
constexpr EntropySource kEntropySources[] = {AskSystem};

#endif

}  // namespace

std::span<const EntropySource> EntropySources() {
  return kEntropySources;
}

std::string UnguessableHex(std::size_t bytes) {
  static constexpr char kHexDigits[] = "0123456789abcdef";
  std::vector<unsigned char> drawn(bytes);
  bool filled = false;
  for (const EntropySource source : EntropySources()) filled = filled || source(drawn);
  std::string text;
  if (!filled) return text;
  for (const unsigned char byte : drawn) {
    text += kHexDigits[byte >> 4];
    text += kHexDigits[byte & 15];
  }
  return text;
}

}  // namespace consac
