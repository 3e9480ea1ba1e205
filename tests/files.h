#pragma once
// Whole files, for tests.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

namespace consac::testing {

/// All of a file; empty when there is none.
inline std::string TextOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Makes or replaces a file, and makes the folders that it is in.
inline void Put(const std::string& path, const std::string& text) {
  const auto folder = std::filesystem::path(path).parent_path();
  if (!folder.empty()) std::filesystem::create_directories(folder);
  std::ofstream(path, std::ios::binary) << text;
}

/// Every file below a folder by its path, with what is in it.
inline std::map<std::string, std::string> FilesBelow(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    std::error_code looping;
    if (entry.is_regular_file(looping)) files[entry.path().generic_string()] = TextOf(entry.path().string());
  }
  return files;
}

}  // namespace consac::testing
