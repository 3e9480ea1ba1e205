// consac demo: an engine on a thread serves the road over TCP, the trainer learns it, the saved model walks to the
// coin.
#include <fmt/format.h>

#include "cli/demo_yumi.h"
#include "cli/flags.h"
#include "cli/play.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/thread.h"
#include "consac/run/shortage.h"
#include "consac/run/training.h"
#include "consac/server/env_server.h"

namespace consac::cli {
namespace {

constexpr const char* kWorld = "road-v0";

struct DemoFlags {
  std::int64_t steps = 20000, seed = 1;
  std::string directory = "runs", name = "demo";
};

/// The engine: serves one session on a thread of its own.
class Engine {
 public:
  Status Open(const worlds::World& world, const DemoFlags& flags) {
    env_ = world.create(1);
    Result<std::unique_ptr<Listener>> listener = ListenTcp({"127.0.0.1", 0});
    if (!listener.ok()) return listener.status();
    EnvServerOptions options;
    options.training_length = flags.steps;
    options.protocol = Protocol::kText1;  // the thesis'
    options.seed = static_cast<std::uint64_t>(flags.seed);
    Result<std::unique_ptr<EnvServer>> server = EnvServer::Create(*env_, std::move(*listener), options);
    if (!server.ok()) return server.status();
    server_ = std::move(*server);
    return thread_.Start([this] { (void)run::Guarded([this] { return server_->ServeSession(stop_); }); });
  }
  ~Engine() {
    stop_ = true;
    thread_.Join();
  }
  std::string url() const { return fmt::format("tcp://127.0.0.1:{}", server_->port()); }

 private:
  std::unique_ptr<VectorEnv> env_;
  std::unique_ptr<EnvServer> server_;
  Thread thread_;
  std::atomic<bool> stop_{false};
};

Result<run::RunSummary> TrainOverTcp(const DemoFlags& flags, const worlds::World& world) {
  Engine engine;
  CONSAC_RETURN_IF_ERROR(engine.Open(world, flags));
  Print(
      "1. An engine offers the thesis' road on {}: an actor, a coin, places 0 to 40.\n"
      "2. The trainer connects and learns for {} steps with ppo2.\n\n",
      engine.url(), flags.steps);
  run::RunConfig config;
  config.world = engine.url();
  config.directory = flags.directory;
  config.name = flags.name;
  config.seed = static_cast<std::uint64_t>(flags.seed);
  config.force = true;
  config.log_interval = 20;
  config.hyperparameters = worlds::SuggestedSettings(world, config.algorithm);
  return run::Train(config, StopSignal());
}

int Demo(const DemoFlags& flags) {
  const Result<const worlds::World*> world = worlds::FindWorld(kWorld);
  if (!world.ok()) return Fail("demo", world.status());
  const Result<run::RunSummary> summary = TrainOverTcp(flags, **world);
  if (!summary.ok()) return Fail("demo", summary.status());
  if (summary->interrupted) {
    PrintError("consac demo: interrupted after {} steps; what was learned is in {}\n", summary->steps,
               summary->directory);
    return 130;
  }
  Print("\n3. The saved model acts, with no network and no trainer (A: actor, o: coin):\n\n");
  WalkOptions walk;
  walk.steps = 40;
  const Status walked = Walk({summary->models[0].path}, kWorld, walk, StopSignal());
  if (!walked.ok()) return Fail("demo", walked);
  run::EvaluateOptions evaluate;
  evaluate.model = summary->models[0].path;
  evaluate.world = kWorld;
  evaluate.episodes = 20;
  const Result<std::vector<run::EvaluateSummary>> verdict = run::Evaluate(evaluate, StopSignal());
  if (!verdict.ok()) return Fail("demo", verdict.status());
  const std::string& folder = summary->directory;
  Print("\nIt steps nearer to the coin in {:.1f}% of its steps.\n\n",
        100.0 * verdict->front().mean_reward / verdict->front().mean_length);
  Print(
      "model           {1}\nlearning curve  {2} (and .svg)\n"
      "watch it again  {0} play {1} {3}\nlook inside     {0} inspect {1}\n"
      "TensorBoard     tensorboard --logdir {4} (where it is installed)\n",
      Argument(ProgramPath()), Argument(summary->models[0].path), Argument(folder + "/curve.png"), kWorld,
      Argument(folder + "/tensorboard"));
  return 0;
}

}  // namespace

Action AddDemo(CLI::App& app) {
  const auto flags = std::make_shared<DemoFlags>();
  AddWhole(app, "--steps", &flags->steps, 1, kMostWhole, "steps to train for");
  AddWhole(app, "--seed", &flags->seed, 0, kMostWhole, "seed of everything");
  app.add_option("--dir", flags->directory, "folder of the runs");
  app.add_option("--name", flags->name, "name of the run; it is overwritten");
  const auto yumi_flags = std::make_shared<DemoYumiFlags>();
  CLI::App* yumi = app.add_subcommand("yumi", "a robot instead: imported, taught to reach by sac with HER, and drawn");
  AddWhole(*yumi, "--steps", &yumi_flags->steps, 1, kMostWhole, "steps to train for");
  AddWhole(*yumi, "--seed", &yumi_flags->seed, 0, kMostWhole, "seed of everything");
  yumi->add_option("--dir", yumi_flags->directory, "folder of the runs");
  yumi->add_option("--name", yumi_flags->name, "name of the run; it is overwritten");
  yumi->add_option("--robot", yumi_flags->robot, "YuMi's URDF, where it is not in examples/robots/yumi");
  return [flags, yumi, yumi_flags] { return yumi->parsed() ? DemoYumi(*yumi_flags) : Demo(*flags); };
}

}  // namespace consac::cli
