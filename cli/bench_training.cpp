// The rows of `consac bench` that train: the time of whole trainings beside what their networks take at the peak.
#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <string>
#include <system_error>

#include "cli/bench_rows.h"
#include "consac/base/file.h"
#include "consac/base/path.h"

namespace consac::cli {
namespace {

const std::atomic<bool> kNeverStop{false};

/// Multiply-adds of the updates and the acting of two 64x64 towers, in FLOP per step.
double TrainingFlops(double inputs, double outputs, double epochs) {
  const double forward = 2.0 * (2.0 * inputs * 64 + 2.0 * 64 * 64 + 64 * (outputs + 1.0));
  const double update = forward * 3.0 - 2.0 * 2.0 * inputs * 64;
  return forward + epochs * update;
}

/// How much of what is counted one training does.
struct Work {
  std::int64_t count;  ///< steps or updates
  const char* unit;    ///< thousands of them a second
  double flops = 0.0;  ///< multiply-adds of all its networks, in FLOP; 0: not counted
};

Figure TrainingFigure(const BenchContext& context, const BenchJob& job, const Work& work) {
  const double seconds = Median(context.repeats, [&] { return TrainSeconds(context, ConfigOf(job)); });
  const std::string share =
      fmt::format("{:.0f}% of the peak in networks alone, ", 100.0 * work.flops / seconds / context.peak);
  return {static_cast<double>(work.count) / seconds / 1e3, work.unit,
          fmt::format("{}{:.2f} s", work.flops > 0.0 ? share : "", seconds), seconds};
}

Figure RateFigure(const BenchContext& context, const BenchJob& job) {
  return TrainingFigure(context, job, {job.steps, "k steps/s"});
}

/// Multiply-adds of one row through hidden layers `width` and `width`; and of its first layer alone.
struct LayerSums {
  LayerSums(double in, double width, double out) : all(in * width + width * width + width * out), first(in * width) {}
  double all, first;
};

constexpr std::int64_t kReplayStarts = 100;

/// SAC or TD3 with one update a step behind the first kReplayStarts, which only fill the replay.
BenchJob PendulumReplayJob(bool td3, double width, double batch, std::int64_t steps) {
  const std::string text = fmt::format("{:.0f}", width);
  return {"pendulum-v1",
          td3 ? "td3" : "sac",
          1,
          steps,
          {{"net_arch", "[" + text + ", " + text + "]"},
           {"batch_size", fmt::format("{:.0f}", batch)},
           {"learning_starts", std::to_string(kReplayStarts)}}};
}

/// An actor and two critics on Pendulum, one update a step, which are what is counted. FLOP are those that the
/// algorithm asks for: a gradient is two products, of the first layer one; an actor is learned through critics that are
/// held fast.
Figure PendulumReplay(const BenchContext& context, bool td3, double width, double batch, std::int64_t steps) {
  const LayerSums actor(3, width, td3 ? 1 : 2), critic(4, width, 1);
  const double targets = actor.all + 2 * critic.all, critics = 2 * (3 * critic.all - critic.first);
  const double judged = (td3 ? 1 : 2) * (2 * critic.all - critic.first);         // TD3 asks the first critic alone
  const double policy = (3 * actor.all - actor.first + judged) / (td3 ? 2 : 1);  // every other time
  const double flops = 2 * batch * (targets + critics + policy);
  return TrainingFigure(context, PendulumReplayJob(td3, width, batch, steps),
                        {steps - kReplayStarts, "k updates/s", flops * static_cast<double>(steps - kReplayStarts)});
}

}  // namespace

run::RunConfig ConfigOf(const BenchJob& job) {
  run::RunConfig config;
  config.world = job.world;
  config.algorithm = job.algorithm;
  config.envs = job.envs;
  config.steps = job.steps;
  config.seed = 1;
  config.hyperparameters = job.settings;
  config.directory = FromPath(std::filesystem::temp_directory_path() / ("consac_bench_" + std::to_string(ProcessId())));
  config.name = "bench";
  config.force = true;
  config.table = config.progress = config.tensorboard = false;
  config.quiet = true;
  config.checkpoint_every_s = 0;
  return config;
}

double TrainSeconds(const BenchContext& context, const run::RunConfig& config) {
  const Result<run::RunSummary> summary = run::Train(config, kNeverStop);
  std::error_code left_there;
  std::filesystem::remove_all(ToPath(config.directory), left_there);
  if (!summary.ok()) {
    (void)Fail("bench", summary.status());
    return std::nan("");
  }
  return context.processor_time ? summary->processor_seconds : summary->seconds;
}

namespace {

Figure CartPolePpo(const BenchContext& context, const BenchJob& job, double epochs) {
  return TrainingFigure(context, job,
                        {job.steps, "k steps/s", static_cast<double>(job.steps) * TrainingFlops(4, 2, epochs)});
}

Figure CartPoleDefaults(const BenchContext& context) {
  return CartPolePpo(context, {"cartpole-v1", "ppo", 1, 51200, {}}, 10);
}

Figure CartPoleEight(const BenchContext& context) {
  return CartPolePpo(
      context, {"cartpole-v1", "ppo", 8, 409600, {{"n_steps", "128"}, {"batch_size", "256"}, {"n_epochs", "4"}}}, 4);
}

// Stable Baselines3's defaults: n_steps 5; learning every fourth step of one world, batch 32.
Figure CartPoleA2c(const BenchContext& context) {
  return RateFigure(context, {"cartpole-v1", "a2c", 1, 102400, {}});
}
Figure CartPoleA2cEight(const BenchContext& context) {
  return RateFigure(context, {"cartpole-v1", "a2c", 8, 409600, {}});
}
Figure CartPoleDqn(const BenchContext& context) {
  return RateFigure(context, {"cartpole-v1", "dqn", 1, 102400, {}});
}

// The Zoo's settings. Counted: both networks forward and the online one backward for a minibatch, nothing else.
Figure CartPoleDqnWide(const BenchContext& context) {
  constexpr std::int64_t kSteps = 50000;
  constexpr double kUpdates = (kSteps - 1000) / 256 * 128.0;
  constexpr double kMultiplyAdds = 4.0 * 256 + 256 * 256 + 256 * 2;
  constexpr double kFlopsPerRow = 2.0 * (4.0 * kMultiplyAdds - 4 * 256);  // no gradient of the observation
  return TrainingFigure(context,
                        {"cartpole-v1",
                         "dqn",
                         1,
                         kSteps,
                         {{"learning_rate", "2.3e-3"},
                          {"batch_size", "64"},
                          {"buffer_size", "100000"},
                          {"learning_starts", "1000"},
                          {"target_update_interval", "10"},
                          {"train_freq", "256"},
                          {"gradient_steps", "128"},
                          {"exploration_fraction", "0.16"},
                          {"exploration_final_eps", "0.04"},
                          {"net_arch", "[256, 256]"}}},
                        {kSteps, "k steps/s", kUpdates * 64 * kFlopsPerRow});
}

Figure PendulumSac(const BenchContext& context) {
  return PendulumReplay(context, false, 64, 100, 10000);
}
Figure PendulumTd3(const BenchContext& context) {
  return PendulumReplay(context, true, 64, 100, 10000);
}
Figure PendulumSacWide(const BenchContext& context) {
  return PendulumReplay(context, false, 256, 256, 1000);
}

Figure PendulumSacTwoCores(const BenchContext& context) {
  constexpr std::int64_t kSteps = 1000;
  run::RunConfig config = ConfigOf(PendulumReplayJob(false, 256, 256, kSteps));
  const BenchContext by_the_wall{context.peak, context.repeats, false};
  const double alone = Median(context.repeats, [&] { return TrainSeconds(by_the_wall, config); });
  config.threads = 2;
  const double shared = Median(context.repeats, [&] { return TrainSeconds(by_the_wall, config); });
  constexpr double kUpdates = static_cast<double>(kSteps - kReplayStarts);
  return {
      alone / shared, "x",
      fmt::format("{:.2f} ms an update on one core, {:.2f} on two", alone / kUpdates * 1e3, shared / kUpdates * 1e3)};
}

// The settings of the strongest native peer's own Pendulum benchmark.
Figure PendulumPpo(const BenchContext& context) {
  const BenchJob job{"pendulum-v1",
                     "ppo",
                     4,
                     307200,
                     {{"n_steps", "1024"},
                      {"batch_size", "256"},
                      {"n_epochs", "2"},
                      {"gamma", "0.9"},
                      {"learning_rate", "1e-3"},
                      {"activation_fn", "relu"},
                      {"norm_obs", "true"}}};
  const double seconds = Median(context.repeats, [&] { return TrainSeconds(context, ConfigOf(job)); });
  return {seconds, "s", "307,200 steps, 4 worlds x 1024, batch 256, 2 epochs, 64x64 ReLU", seconds};
}

constexpr BenchRow kTrainingRows[] = {
    {"cartpole", "CartPole PPO, 1 world, n_steps 2048, batch 64, 10 epochs", CartPoleDefaults},
    {"cartpole8", "CartPole PPO, 8 worlds, n_steps 128, batch 256, 4 epochs", CartPoleEight},
    {"a2c", "CartPole A2C, 1 world, n_steps 5", CartPoleA2c},
    {"a2c8", "CartPole A2C, 8 worlds, n_steps 5", CartPoleA2cEight},
    {"dqn", "CartPole DQN, 1 world, train_freq 4, batch 32, 64x64", CartPoleDqn},
    {"dqn256", "CartPole DQN, train_freq 256, gradient_steps 128, batch 64, 256x256", CartPoleDqnWide},
    {"pendulum", "Pendulum PPO, whole training", PendulumPpo},
    {"sac", "Pendulum SAC, one update a step, batch 100, 64x64", PendulumSac},
    {"td3", "Pendulum TD3, one update a step, batch 100, 64x64", PendulumTd3},
    {"sac256", "Pendulum SAC, one update a step, batch 256, 256x256", PendulumSacWide},
    {"sac256cores", "the same on two cores against one", PendulumSacTwoCores},
};

}  // namespace

std::span<const BenchRow> TrainingRows() {
  return kTrainingRows;
}

}  // namespace consac::cli
