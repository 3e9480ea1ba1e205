#include "cli/machine.h"

#if defined(_WIN32)
#include <windows.h>
#else
#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "consac/base/hooks.h"
#include "consac/nn/network.h"

namespace consac::cli {

// Windows never promises memory that it does not have. Sanitizers reserve terabytes that they never touch.
void LimitMemory() {
#if !defined(_WIN32) && !defined(CONSAC_SANITIZED)
  std::ifstream info("/proc/meminfo");
  std::string name, unit;
  rlim_t kibibytes = 0;
  while (info >> name >> kibibytes >> unit) {
    if (name != "MemAvailable:") continue;
    rlimit limit{};
    if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, kibibytes * 1024);
    (void)setrlimit(RLIMIT_DATA, &limit);
    return;
  }
#endif
}

#if !defined(_WIN32)
namespace {

// So much more of the stack than is in use now.
[[gnu::noinline]] void TouchStack(std::size_t bytes) {
  constexpr std::size_t kPiece = std::size_t{1} << 14, kPage = std::size_t{1} << 12;
  volatile std::byte piece[kPiece];
  for (std::size_t i = 0; i < kPiece; i += kPage) piece[i] = std::byte{0};
  if (bytes > kPiece) TouchStack(bytes - kPiece);
  piece[0] = piece[kPiece - 1];  // what comes after a call keeps it from taking this one's place
}

}  // namespace
#endif

// Half of what there may be is left to the arguments, the environment and what lies above.
bool TakeStack() {
#if !defined(_WIN32)
  constexpr std::size_t kBytes = std::size_t{1} << 20;
  rlimit limit{};
  if (getrlimit(RLIMIT_STACK, &limit) != 0) return true;
  if (limit.rlim_cur < kLeastStack) return false;
  TouchStack(limit.rlim_cur == RLIM_INFINITY ? kBytes : std::min<std::size_t>(kBytes, limit.rlim_cur / 2));
#endif
  return true;
}

void AllowManyFiles() {
#if !defined(_WIN32)
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  (void)setrlimit(RLIMIT_NOFILE, &limit);
#endif
}

#if defined(_WIN32)
namespace {
UINT code_page = 0;  // the console's, before us
}  // namespace
#endif

#if !defined(_WIN32)
namespace {

// Where one of the first three descriptors is closed, the next file that is opened gets its number, and what is printed
// lands in that file.
void OpenStandardStreams() {
  int descriptor = 0;
  while (descriptor >= 0 && descriptor <= STDERR_FILENO) descriptor = open("/dev/null", O_RDWR);
  if (descriptor > STDERR_FILENO) close(descriptor);
}

}  // namespace
#endif

void PrepareOutput() {
#if defined(_WIN32)
  code_page = GetConsoleOutputCP();
  if (code_page == 0) return;
  SetConsoleOutputCP(CP_UTF8);
  std::atexit([] { SetConsoleOutputCP(code_page); });
#else
  OpenStandardStreams();
  std::signal(SIGPIPE, SIG_IGN);  // a reader that leaves (| head) and a file that may not grow are errors of a write,
  std::signal(SIGXFSZ, SIG_IGN);  // not the end of a training
#endif
}

void EndAtOnce(std::string_view line, int code) {
#if defined(_WIN32)
  DWORD written = 0;
  (void)WriteFile(GetStdHandle(STD_ERROR_HANDLE), line.data(), static_cast<DWORD>(line.size()), &written, nullptr);
#else
  pollfd asked{STDERR_FILENO, POLLOUT, 0};
  if (poll(&asked, 1, 0) > 0 && write(STDERR_FILENO, line.data(), line.size()) < 0) std::_Exit(code);
#endif
  std::_Exit(code);
}

bool OutputMayBeLost() {
#if defined(_WIN32)
  return GetFileType(GetStdHandle(STD_OUTPUT_HANDLE)) != FILE_TYPE_DISK;
#else
  struct stat what {};
  return fstat(STDOUT_FILENO, &what) == 0 && (S_ISFIFO(what.st_mode) || S_ISSOCK(what.st_mode));
#endif
}

std::string CompilerName() {
#if defined(__clang__)
  return "clang " __clang_version__;
#elif defined(__GNUC__)
  return "g++ " __VERSION__;
#else
  return "unknown";
#endif
}

double MeasureDenseFlops(double seconds) {
  constexpr std::int64_t kSize = 64;
  constexpr int kBurst = 500;
  nn::NetworkSpec spec;
  spec.inputs = {{"x", kSize}};
  spec.blocks = {{.inputs = {"x"}, .output = "y", .name = "layer", .in_size = kSize, .out_size = kSize}};
  spec.outputs = {"y"};
  const Result<nn::Network> network = nn::Network::Create(spec);
  nn::Evaluator evaluator(*network, kSize);
  evaluator.Load(std::vector<float>(static_cast<std::size_t>(network->parameter_count()), 0.01f));
  const std::vector<float> x(kSize * kSize, 0.5f);
  const float* input = x.data();
  double best = 0.0;
  for (const double end = Now() + seconds; Now() < end;) {
    const double start = Now();
    for (int i = 0; i < kBurst; ++i) evaluator.Forward({&input, 1}, kSize);
    best = std::max(best, 2.0 * kSize * kSize * kSize * kBurst / (Now() - start));
  }
  return best;
}

}  // namespace consac::cli
