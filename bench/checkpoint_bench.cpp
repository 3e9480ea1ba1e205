// What saving costs a run that remembers a million steps: the share of its time that checkpoints take, and the memory
// that they take beside it. Trains DQN at its defaults (a checkpoint every 10 s) in a folder of its own; Linux alone.
// Seconds are those of the clock, or with `cpu` those that the training's thread had a processor: for a machine that is
// not quiet (the disk is then not waited for).
//   consac_checkpoint_bench [steps] [seconds between checkpoints] [cpu]
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "consac/base/hooks.h"
#include "consac/run/training.h"

namespace {

/// Looks now and then at how much memory this process has.
class MemoryWatch {
 public:
  MemoryWatch() : thread_([this] { Watch(); }) {}
  ~MemoryWatch() { Stop(); }
  void Stop() {
    over_ = true;
    if (thread_.joinable()) thread_.join();
  }
  /// Of the second half of the time, when all is full, but for its end, where a curve is drawn; MiB: what was usual,
  /// and the most.
  double usual() const { return Sorted()[Sorted().size() / 2]; }
  double most() const { return Sorted().back(); }

 private:
  static constexpr std::size_t kEnd = 500;  // looks
  std::vector<double> Sorted() const {
    const auto half = looks_.begin() + static_cast<std::ptrdiff_t>(looks_.size() / 2);
    const auto end = looks_.end() - static_cast<std::ptrdiff_t>(std::min(kEnd, looks_.size() / 4));
    std::vector<double> late(half, end);
    std::sort(late.begin(), late.end());
    return late;
  }
  void Watch() {
    const double page = static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
    while (!over_) {
      double all = 0.0, resident = 0.0;
      std::ifstream("/proc/self/statm") >> all >> resident;
      looks_.push_back(resident * page);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  std::vector<double> looks_ = {0.0};
  std::atomic<bool> over_ = false;
  std::thread thread_;
};

double ProcessorSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// One line of the table.
bool Measure(const char* name, const consac::run::RunConfig& config) {
  const std::atomic<bool> stop = false;
  MemoryWatch memory;
  const consac::Result<consac::run::RunSummary> summary = consac::run::Train(config, stop);
  memory.Stop();
  if (!summary.ok()) {
    std::fprintf(stderr, "%s\n", summary.status().message().c_str());
    return false;
  }
  std::uintmax_t bytes = 0;
  for (const auto& file : std::filesystem::directory_iterator(summary->directory + "/checkpoints"))
    bytes += file.file_size();
  std::printf("| %-22s | %9lld | %7.0f | %6.2f s of %6.1f s | %5.2f %% | %7.1f | %7.1f | %5.1f %% | %6.1f |\n", name,
              static_cast<long long>(summary->steps), static_cast<double>(summary->steps) / summary->seconds,
              summary->saving_seconds, summary->seconds, 100.0 * summary->saving_seconds / summary->seconds,
              memory.usual(), memory.most(), 100.0 * (memory.most() / memory.usual() - 1.0),
              static_cast<double>(bytes) / (1 << 20));
  std::fflush(stdout);
  return true;
}

}  // namespace

int main(int count, char** arguments) {
  consac::run::RunConfig config;
  config.world = "cartpole-v1";
  config.algorithm = "dqn";
  config.steps = count > 1 ? std::atoll(arguments[1]) : 2'500'000;
  if (count > 3 && std::string(arguments[3]) == "cpu") {
    consac::Hooks hooks;
    hooks.now = [](void*) { return ProcessorSeconds(); };
    consac::SetHooks(hooks);
  }
  config.checkpoint_every_s = count > 2 ? std::atoll(arguments[2]) : config.checkpoint_every_s;
  config.directory = std::filesystem::temp_directory_path().string() + "/consac_checkpoint_bench";
  config.quiet = config.force = true;
  config.table = config.progress = config.tensorboard = false;
  std::printf(
      "| replay of a million    | steps     | steps/s | saving                | share   | usual   | most    "
      "| more    | on disk |\n|---|---|---|---|---|---|---|---|---|\n");
  struct Case {
    const char* name;
    std::vector<std::pair<std::string, std::string>> hyperparameters;
  };
  const Case cases[] = {{"CartPole", {}}, {"CartPole, prioritised", {{"prioritized_replay", "true"}}}};
  bool fine = true;
  for (const Case& entry : cases) {
    config.name = "bench";
    config.hyperparameters = entry.hyperparameters;
    fine = Measure(entry.name, config) && fine;
  }
  std::filesystem::remove_all(config.directory);
  return fine ? 0 : 1;
}
