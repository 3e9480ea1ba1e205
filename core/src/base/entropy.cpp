#include "base/entropy.h"

#if defined(_WIN32)
#include <random>
#elif defined(__APPLE__)
#include <sys/random.h>
#else
#include <unistd.h>
#endif

namespace consac {

std::string UnguessableHex(std::size_t bytes) {
  static constexpr char kHexDigits[] = "0123456789abcdef";
#if defined(_WIN32)
  std::random_device device;
#endif
  std::string text;
  for (std::size_t i = 0; i < bytes; ++i) {
#if defined(_WIN32)
    const auto byte = static_cast<unsigned char>(device());
#else
    unsigned char byte = 0;
    if (getentropy(&byte, 1) != 0) return {};
#endif
    text += kHexDigits[byte >> 4];
    text += kHexDigits[byte & 15];
  }
  return text;
}

}  // namespace consac
