#pragma once
// Floats below 1.2e-38, which processors add and multiply a hundred times slower than others. Moments of weights that
// no longer get gradients decay into them within a thousand steps and stay there. Private to core.

#if defined(__SSE2__) || defined(_M_X64)
#include <xmmintrin.h>
#endif
#include <cstdint>

namespace consac::nn {

/// While one lives, such floats are zero on this thread, read or written; afterwards all is as it was before.
class DenormalsAreZero {
 public:
  DenormalsAreZero() : before_(Get()) { Set(before_ | kBits); }
  ~DenormalsAreZero() { Set(before_); }
  DenormalsAreZero(const DenormalsAreZero&) = delete;
  DenormalsAreZero& operator=(const DenormalsAreZero&) = delete;

 private:
#if defined(__SSE2__) || defined(_M_X64)
  static constexpr std::uint64_t kBits = 0x8040;  // flush results, take operands for zero
  static std::uint64_t Get() {
    return _mm_getcsr();
  }
  static void Set(std::uint64_t bits) {
    _mm_setcsr(static_cast<unsigned>(bits));
  }
#elif defined(__aarch64__)
  static constexpr std::uint64_t kBits = std::uint64_t{1} << 24;  // FPCR.FZ
  static std::uint64_t Get() {
    std::uint64_t bits = 0;
    __asm__ volatile("mrs %0, fpcr" : "=r"(bits));
    return bits;
  }
  static void Set(std::uint64_t bits) {
    __asm__ volatile("msr fpcr, %0" : : "r"(bits));
  }
#else
  static constexpr std::uint64_t kBits = 0;
  static std::uint64_t Get() {
    return 0;
  }
  static void Set(std::uint64_t) {}
#endif

  std::uint64_t before_;
};

}  // namespace consac::nn
