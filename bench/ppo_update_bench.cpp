// One PPO minibatch update in microseconds, GFLOP/s and percent of the multiply-add peak measured in the same run; two
// threads against one; beside LibTorch when built with it (CONSAC_BENCH_LIBTORCH).

#include <atomic>
#include <thread>

#include "bench/peak.h"
#include "bench/ppo_update_net.h"

#ifdef CONSAC_BENCH_LIBTORCH
#include "bench/ppo_update_libtorch.h"
#endif

namespace consac::bench {
namespace {

/// A second thread that spins for work: what a trainer's thread pool looks like while it is busy.
class SpinningPair {
 public:
  SpinningPair() : second_([this] { Serve(); }) {}
  ~SpinningPair() {
    stop_ = true;
    second_.join();
  }
  Executor executor() { return {Run, this}; }

 private:
  static void Run(void* user, std::int64_t count, void (*task)(void*, std::int64_t), void* context) {
    auto* self = static_cast<SpinningPair*>(user);
    self->count_ = count;
    self->task_ = task;
    self->context_ = context;
    self->next_ = 0;
    self->round_.fetch_add(1, std::memory_order_release);
    self->Drain();
    while (self->served_.load(std::memory_order_acquire) != self->round_.load(std::memory_order_relaxed)) {
    }
  }
  void Drain() {
    for (std::int64_t i = next_++; i < count_; i = next_++) task_(context_, i);
  }
  void Serve() {
    for (int seen = 0; !stop_;) {
      if (round_.load(std::memory_order_acquire) == seen) continue;
      ++seen;
      Drain();
      served_.store(seen, std::memory_order_release);
    }
  }

  std::int64_t count_ = 0;
  void (*task_)(void*, std::int64_t) = nullptr;
  void* context_ = nullptr;
  std::atomic<std::int64_t> next_ = 0;
  std::atomic<int> round_ = 0, served_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread second_;
};

void PrintRow(const char* what, std::int64_t width, std::int64_t rows, double seconds, double flops, double peak) {
  std::printf("%-22s %5lld %6lld %12.1f %10.1f %8.1f %%\n", what, static_cast<long long>(width),
              static_cast<long long>(rows), seconds * 1e6, flops / seconds * 1e-9, 100.0 * flops / seconds / peak);
  std::fflush(stdout);
}

void Compare(std::int64_t width, std::int64_t rows, double peak) {
  PpoUpdate update(width, rows);
  const double flops = update.FlopsPerSample() * static_cast<double>(rows);
  PrintRow("consac", width, rows, BestSeconds([&] { update.Run(); }), flops, peak);
#ifdef CONSAC_BENCH_LIBTORCH
  TorchPpoUpdate torch_update(width, rows);
  PrintRow("libtorch", width, rows, BestSeconds([&] { torch_update.Run(); }), flops, peak);
#endif
}

void CompareThreads(std::int64_t width, std::int64_t rows, double peak) {
  const RepeatOptions wall{15, 0.02, WallSeconds};
  PpoUpdate update(width, rows);
  const double flops = update.FlopsPerSample() * static_cast<double>(rows);
  const double one = BestSeconds([&] { update.Run(); }, wall);
  SpinningPair pair;
  const double two = BestSeconds([&] { update.Run(pair.executor()); }, wall);
  PrintRow("one thread, wall", width, rows, one, flops, peak);
  PrintRow("two threads, wall", width, rows, two, flops, peak);
  std::printf("two threads against one: %.2f x\n", one / two);
}

}  // namespace
}  // namespace consac::bench

int main(int argc, char** argv) {
  using namespace consac::bench;
  const double peak = PrintMachine(argc, argv);
  std::printf("%-22s %5s %6s %12s %10s %10s\n", "PPO update", "width", "rows", "us/update", "GFLOP/s", "of peak");
  Compare(64, 64, peak);
  Compare(64, 256, peak);
  Compare(64, 2048, peak);
  Compare(256, 64, peak);
  Compare(256, 2048, peak);
  CompareThreads(64, 2048, peak);
}
