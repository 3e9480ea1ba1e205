// consac bench: speed on this machine as a table. Every figure is measured in this call, the median of repeats; ratios
// are to the multiply-add peak of the same call.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "bench/peak.h"
#include "bench/ppo_update_net.h"
#include "cli/bench_rows.h"
#include "cli/flags.h"
#include "cli/machine.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/base/thread.h"
#include "consac/base/version.h"
#include "consac/env/buffer.h"
#include "consac/learn/algo/learner.h"
#include "consac/run/thread_pool.h"
#include "consac/run/training.h"
#include "consac/server/env_client.h"
#include "consac/server/env_server.h"
#include "worlds/registry.h"

namespace consac::cli {
namespace {

struct BenchFlags {
  std::string only;
  bool json = false;
  std::int64_t repeats = 3;
  std::string kernels;
  bool processor_time = false;
};

// ---- kernels

Figure UpdateFigure(const BenchContext& context, std::int64_t rows) {
  bench::PpoUpdate update(64, rows);
  const double seconds = bench::BestSeconds([&] { update.Run(); });
  const double share = update.FlopsPerSample() * static_cast<double>(rows) / seconds / context.peak;
  return {seconds * 1e6, "us", fmt::format("{:.0f}% of the peak", 100.0 * share)};
}

Figure Update64(const BenchContext& context) {
  return UpdateFigure(context, 64);
}
Figure Update2048(const BenchContext& context) {
  return UpdateFigure(context, 2048);
}

Figure TwoCores(const BenchContext&) {
  bench::PpoUpdate one(64, 2048), two(64, 2048);
  const bench::RepeatOptions options{10, 0.02, bench::WallSeconds};
  const double alone = bench::BestSeconds([&] { one.Run(); }, options);
  run::ThreadPool pool(2);
  const double shared = bench::BestSeconds([&] { two.Run(pool.executor()); }, options);
  return {alone / shared, "x",
          fmt::format("{:.0f} us on one core, {:.0f} on two, minibatch 2048", alone * 1e6, shared * 1e6)};
}

Figure OneAction(const BenchContext&) {
  const std::unique_ptr<VectorEnv> env = (*worlds::FindWorld("cartpole-v1"))->create(1);
  const learn::Algorithm* algorithm = *learn::FindAlgorithm("ppo");
  learn::LearnerOptions options;
  options.behaviour = env->spec().behaviours[0];
  const auto learner = algorithm->create(options, learn::HyperparameterSet(algorithm->hyperparameters));
  Result<Policy> policy = Policy::Create((*learner)->Snapshot(), 1);
  const float observation[4] = {0.1f, -0.2f, 0.05f, 0.3f};
  std::int32_t action = 0;
  Rng rng(1, 1);
  const double seconds = bench::BestSeconds([&] {
    policy->Act(reinterpret_cast<const std::byte*>(observation), nullptr, 1, ActionMode::kDeterministic, rng,
                reinterpret_cast<std::byte*>(&action));
  });
  return {seconds * 1e6, "us", "64x64 tanh actor with its head, batch 1, no allocation"};
}

// ---- worlds alone

/// Actions are drawn before, so that nothing but the world is timed.
Figure CartPoleAlone(const BenchContext&) {
  constexpr std::int32_t kWorlds = 64;
  constexpr std::size_t kRounds = 1024;
  const std::unique_ptr<VectorEnv> env = (*worlds::FindWorld("cartpole-v1"))->create(kWorlds);
  BatchBuffer buffer(env->spec().behaviours[0]);
  env->Reset(1, {&buffer.batch(), 1});
  Rng rng(1, StreamId("bench"));
  std::vector<std::int32_t> actions(kRounds * kWorlds);
  for (std::int32_t& action : actions) action = static_cast<std::int32_t>(rng.Below(2));
  std::size_t round = 0;
  const double seconds = bench::BestSeconds([&] {
    buffer.Advance();
    std::memcpy(buffer.batch().actions, actions.data() + round++ % kRounds * kWorlds, kWorlds * sizeof(std::int32_t));
    env->Step({&buffer.batch(), 1});
  });
  return {kWorlds / seconds / 1e6, "M steps/s",
          fmt::format("{:.1f} ns a step, random actions", seconds / kWorlds * 1e9)};
}

/// An arm of seven joints whose tool is moved by inverse kinematics, and one moved joint by joint.
template <const char* kWorld>
Figure RobotAlone(const BenchContext&) {
  constexpr std::size_t kRounds = 4096;
  const std::unique_ptr<VectorEnv> env = (*worlds::FindWorld(kWorld))->create(1);
  BatchBuffer buffer(env->spec().behaviours[0]);
  env->Reset(1, {&buffer.batch(), 1});
  const std::size_t bytes = env->spec().behaviours[0].action_layout.row_bytes, width = bytes / sizeof(float);
  Rng rng(1, StreamId("bench"));
  std::vector<float> actions(kRounds * width);
  for (float& action : actions) action = static_cast<float>(rng.Between(-1, 1));
  std::size_t round = 0;
  const double seconds = bench::BestSeconds([&] {
    buffer.Advance();
    std::memcpy(buffer.batch().actions, actions.data() + round++ % kRounds * width, bytes);
    env->Step({&buffer.batch(), 1});
  });
  return {1e-3 / seconds, "k steps/s", fmt::format("{:.2f} us a step, random actions", seconds * 1e6)};
}
constexpr char kByTool[] = "yumi-reach-v0", kByJoints[] = "yumi-reach-joints-v0";

// ---- over a connection

/// An engine that serves the road on a thread of its own, one session.
class ServedRoad {
 public:
  explicit ServedRoad(std::int64_t steps) : env_((*worlds::FindWorld("road-v0"))->create(1)) {
    EnvServerOptions options;
    options.protocol = Protocol::kText1;  // as the thesis
    options.training_length = steps;
    options.seed = 1;
    auto listener = ListenTcp({"127.0.0.1", 0});
    auto server = EnvServer::Create(*env_, std::move(*listener), options);
    server_ = std::move(*server);
    (void)thread_.Start([this] { (void)server_->ServeSession(stop_); });  // else its client hears nothing, and says so
  }
  ~ServedRoad() {
    stop_ = true;
    thread_.Join();
  }
  int port() const { return server_->port(); }

 private:
  std::unique_ptr<VectorEnv> env_;
  std::unique_ptr<EnvServer> server_;
  std::atomic<bool> stop_{false};
  Thread thread_;
};

/// Round trips per second of `bytes` each way between two threads, nothing parsed.
double PingPong(std::size_t bytes, int count) {
  auto listener = ListenTcp({"127.0.0.1", 0});
  auto near_end = ConnectTcp({"127.0.0.1", (*listener)->port()}, 1.0);
  auto far_end = (*listener)->Accept(1.0);
  const auto exchange = [bytes](Transport& transport, bool first, int rounds) {
    std::vector<std::byte> buffer(bytes);
    for (int i = 0; i < rounds; ++i) {
      if (first && !transport.Write(buffer, 1.0).ok()) return;
      for (std::size_t got = 0; got < bytes;) {
        const Result<std::size_t> read = transport.Read(std::span(buffer).subspan(got), 1.0);
        if (!read.ok()) return;
        got += *read;
      }
      if (!first && !transport.Write(buffer, 1.0).ok()) return;
    }
  };
  Thread echo;
  if (!echo.Start([&] { exchange(**far_end, false, count); }).ok()) return std::nan("");
  const double start = Now();
  exchange(**near_end, true, count);
  const double rate = count / (Now() - start);
  echo.Join();
  return rate;
}

constexpr std::int64_t kThesisSteps = 20000;
constexpr std::size_t kStepBytes = 10;  // "10,37#1#0\n"

run::RunConfig ThesisConfig() {
  const worlds::World& road = **worlds::FindWorld("road-v0");
  return ConfigOf({"road-v0", "ppo2", 1, kThesisSteps, worlds::SuggestedSettings(road, "ppo2")});
}

/// Beside the least that it must take: the learning by itself, and as many bare round trips.
Figure ThesisJob(const BenchContext& context) {
  const double learning = Median(context.repeats, [&] { return TrainSeconds(context, ThesisConfig()); });
  const double bare = Median(context.repeats, [] { return kThesisSteps / PingPong(kStepBytes, kThesisSteps); });
  const double seconds = Median(context.repeats, [&] {
    ServedRoad engine(kThesisSteps);
    run::RunConfig config = ThesisConfig();
    config.world = fmt::format("tcp://127.0.0.1:{}", engine.port());
    config.steps = -1;  // the engine says
    return TrainSeconds(context, config);
  });
  return {
      seconds, "s",
      fmt::format("20,000 steps over TCP, text protocol 1: {:.2f}x a bare ping-pong of 20,000 messages ({:.2f} s) plus "
                  "the learning alone ({:.2f} s); the thesis took 20 s",
                  seconds / (bare + learning), bare, learning),
      seconds};
}

double StepRate(int count) {
  ServedRoad engine(count);
  auto transport = ConnectTcp({"127.0.0.1", engine.port()}, 1.0);
  auto client = EnvClient::Open(std::move(*transport), {});
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  if (!(*client)->Reset(0, {&buffer.batch(), 1}).ok()) return std::nan("");
  const double start = Now();
  for (int i = 0; i < count; ++i) {
    buffer.Advance();
    *reinterpret_cast<std::int32_t*>(buffer.batch().actions) = 1;
    if (!(*client)->Step({&buffer.batch(), 1}, i + 1 == count ? MoreSteps::kLast : MoreSteps::kYes).ok())
      return std::nan("");
  }
  const double rate = count / (Now() - start);
  (*client)->Close();
  return rate;
}

Figure StepOverTcp(const BenchContext& context) {
  constexpr int kRounds = 20000;
  double rate = 0.0;
  const double share = Median(std::max(context.repeats, 5), [&] {
    const double bare = PingPong(kStepBytes, kRounds);
    rate = StepRate(kRounds);
    return rate / bare;
  });
  return {100.0 * share, "%", fmt::format("of a bare ping-pong of that size; about {:.0f} k steps/s", rate / 1e3)};
}

constexpr BenchRow kKernelRows[] = {
    {"update64", "PPO update, two 64x64 nets, minibatch 64", Update64},
    {"update2048", "PPO update, two 64x64 nets, minibatch 2048", Update2048},
    {"cores", "two cores against one, large batch", TwoCores},
    {"action", "one action", OneAction},
    {"worlds", "CartPole alone, 64 worlds, one core", CartPoleAlone},
    {"robot", "YuMi's arm alone, by its tool, one core", RobotAlone<kByTool>},
    {"joints", "YuMi's arm alone, by its joints, one core", RobotAlone<kByJoints>},
};

constexpr BenchRow kConnectionRows[] = {
    {"thesis", "the thesis' job", ThesisJob},
    {"step", "one step over TCP", StepOverTcp},
};

/// The table.
std::vector<BenchRow> BenchRows() {
  std::vector<BenchRow> rows(std::begin(kKernelRows), std::end(kKernelRows));
  rows.insert(rows.end(), TrainingRows().begin(), TrainingRows().end());
  rows.insert(rows.end(), std::begin(kConnectionRows), std::end(kConnectionRows));
  return rows;
}

std::vector<std::string_view> RowNames() {
  std::vector<std::string_view> names;
  for (const BenchRow& row : BenchRows()) names.emplace_back(row.name);
  return names;
}

int Bench(const BenchFlags& flags) {
  EndAtSignals();
  const std::vector<std::string_view> names = RowNames();
  if (!flags.only.empty() && std::find(names.begin(), names.end(), flags.only) == names.end()) {
    return Fail("bench",
                {StatusCode::kInvalidArgument, "there is no row " + Quote(flags.only) + Suggestion(flags.only, names)});
  }
  if (!flags.kernels.empty() && !nn::UseInstructionSet(flags.kernels)) {
    return Fail("bench",
                {StatusCode::kInvalidArgument, "--kernels " + Quote(flags.kernels) + " is none that this machine runs" +
                                                   Suggestion(flags.kernels, nn::InstructionSets())});
  }
  BenchContext context;
  context.repeats = static_cast<int>(flags.repeats);
  context.processor_time = flags.processor_time;
  context.peak = nn::MeasurePeakFlops(0.5);
  nlohmann::ordered_json json = {
      {"cpu", bench::CpuName()},         {"compiler", CompilerName()},        {"version", kVersion},
      {"kernels", nn::InstructionSet()}, {"peak_gflops", context.peak / 1e9}, {"rows", nlohmann::json::array()}};
  if (!flags.json) {
    Print("{}, {}, consac {}, {} kernels, peak of one core {:.1f} GFLOP/s\n\n", bench::CpuName(), CompilerName(),
          kVersion, nn::InstructionSet(), context.peak / 1e9);
    Print("| what | figure | |\n|---|---|---|\n");
  }
  bool whole = true;
  for (const BenchRow& row : BenchRows()) {
    if (!flags.only.empty() && flags.only != row.name) continue;
    const Figure figure = row.measure(context);
    whole = whole && !std::isnan(figure.value);
    json["rows"].push_back({{"name", row.name},
                            {"what", row.what},
                            {"value", figure.value},
                            {"unit", figure.unit},
                            {"note", figure.note}});
    if (figure.seconds > 0.0) json["rows"].back()["seconds"] = figure.seconds;
    if (!flags.json) Print("| {} | {:.3g} {} | {} |\n", row.what, figure.value, figure.unit, figure.note);
    FlushOutput();
  }
  if (flags.json) PrintLines(AsciiJsonText(json, 2));
  return whole ? 0 : ExitCode({StatusCode::kInternal, ""});
}

}  // namespace

Action AddBench(CLI::App& app) {
  const auto flags = std::make_shared<BenchFlags>();
  app.add_option("--only", flags->only, "one row: " + Join(RowNames()));
  AddWhole(app, "--repeats", &flags->repeats, 1, 100, "repeats of a training; the median counts");
  app.add_option("--kernels", flags->kernels, "another instruction set than the best: " + Join(nn::InstructionSets()));
  app.add_flag("--processor-time", flags->processor_time,
               "trainings by the processor's seconds, so that other programs do not count");
  app.add_flag("--json", flags->json, "as JSON");
  return [flags] { return Bench(*flags); };
}

}  // namespace consac::cli
