#include "server/secret.h"

#if defined(_WIN32)
#include <random>
#else
#include <unistd.h>
#endif

namespace consac {

bool SameSecret(std::string_view a, std::string_view b) {
  unsigned char difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference = static_cast<unsigned char>(difference | (a[i] ^ (i < b.size() ? b[i] : '\0')));
  }
  return difference == 0;
}

std::string MakeToken() {
  static constexpr char kHex[] = "0123456789abcdef";
  unsigned char bytes[16] = {};
#if defined(_WIN32)
  std::random_device device;
  for (unsigned char& byte : bytes) byte = static_cast<unsigned char>(device());
#else
  (void)!getentropy(bytes, sizeof(bytes));
#endif
  std::string token;
  for (const unsigned char byte : bytes) {
    token += kHex[byte >> 4];
    token += kHex[byte & 15];
  }
  return token;
}

}  // namespace consac
