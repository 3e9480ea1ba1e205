#pragma once
// What every bench prints beside its figures: CPU seconds of this process, the best of several repeats, and the
// fused-multiply-add peak measured in the same run.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <string>

#include "consac/nn/kernels.h"

namespace consac::bench {

/// CPU seconds of the calling thread: other jobs on the machine do not count.
inline double ThreadSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Wall seconds: for work on several threads.
inline double WallSeconds() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// How long to look.
struct RepeatOptions {
  int repeats = 15;       ///< the best of these counts
  double seconds = 0.02;  ///< of each repeat
  double (*clock)() = ThreadSeconds;
};

/// Seconds of one call of `work`, the best of several repeats.
template <class Work>
double BestSeconds(Work&& work, const RepeatOptions& options = {}) {
  std::int64_t calls = 1;
  double best = 1e30;
  work();
  for (int repeat = 0; repeat < options.repeats;) {
    const double begin = options.clock();
    for (std::int64_t i = 0; i < calls; ++i) work();
    const double taken = options.clock() - begin;
    if (taken < 0.5 * options.seconds) {
      calls *= 2;
      continue;
    }
    best = std::min(best, taken / static_cast<double>(calls));
    ++repeat;
  }
  return best;
}

/// The CPU's name as the system gives it.
inline std::string CpuName() {
  std::string name = "unknown CPU";
  if (std::FILE* file = std::fopen("/proc/cpuinfo", "r")) {
    char line[256];
    while (std::fgets(line, sizeof(line), file)) {
      const std::string text = line;
      if (text.rfind("model name", 0) != 0) continue;
      name = text.substr(text.find(':') + 2);
      while (!name.empty() && (name.back() == '\n' || name.back() == ' ')) name.pop_back();
      break;
    }
    std::fclose(file);
  }
  return name;
}

/// Prints the machine's line and returns its peak in FLOP/s, the best of several looks. A first argument names another
/// instruction set than the best: AVX3 (AVX-512), AVX2, SSE4, NEON.
inline double PrintMachine(int argc, char** argv) {
  if (argc > 1 && !nn::UseInstructionSet(argv[1])) std::printf("this machine cannot run %s\n", argv[1]);
  double peak = 0.0;
  for (int i = 0; i < 5; ++i) peak = std::max(peak, nn::MeasurePeakFlops(0.02));
#if defined(__clang__)
  const char* compiler = "clang " __clang_version__;
#elif defined(__GNUC__)
  const char* compiler = "gcc " __VERSION__;
#else
  const char* compiler = "unknown compiler";
#endif
  std::printf("%s, %s, %s (%lld floats a register), peak %.1f GFLOP/s\n", CpuName().c_str(), compiler,
              std::string(nn::InstructionSet()).c_str(), static_cast<long long>(nn::VectorLanes()), peak * 1e-9);
  return peak;
}

}  // namespace consac::bench
