#pragma once
// For tests of files: a folder of their own, and a limit of how long a file may grow.

#include <gtest/gtest.h>
#if !defined(_WIN32)
#include <sys/resource.h>
#endif

#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>

namespace consac::testing {

/// A folder of its own below the system's temporary one, removed at the end.
class ScratchFolder {
 public:
  /// Makes it.
  explicit ScratchFolder(const std::string& name)
      : path_((std::filesystem::temp_directory_path() / ("consac_" + name + "_" + std::to_string(::getpid())))
                  .generic_string()) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  /// Its path.
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// One that has its test's name.
class TestFolder : public ScratchFolder {
 public:
  TestFolder() : ScratchFolder(NameOfTest()) {}
  std::string File(const std::string& name) const { return path() + "/" + name; }

 private:
  static std::string NameOfTest() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    return std::string(info->test_suite_name()) + "_" + info->name();
  }
};

#if !defined(_WIN32)  // which knows no such limit
/// No file of this process may grow past `bytes` while it lives.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limited{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limited);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  void (*handler_)(int);
  rlimit before_{};
};
#endif

}  // namespace consac::testing
