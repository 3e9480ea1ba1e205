#pragma once
// Paths are UTF-8 in all of CONSAC; what the standard library makes of a plain string is, on Windows, of the system's
// code page.

#include <filesystem>
#include <string>

#include "consac/base/file.h"

namespace consac {

/// A path for the standard library.
inline std::filesystem::path ToPath(const std::string& utf8) {
#if defined(_WIN32)
  return WidePath(utf8);
#else
  return utf8;
#endif
}

/// And back, with slashes on every system.
inline std::string FromPath(const std::filesystem::path& path) {
#if defined(_WIN32)
  const std::u8string utf8 = path.generic_u8string();
  return {utf8.begin(), utf8.end()};
#else
  return path.native();
#endif
}

}  // namespace consac
