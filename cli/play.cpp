// consac play: watch a model, step by step.
#include "cli/play.h"

#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <thread>

#include "cli/flags.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/text.h"
#include "consac/env/buffer.h"
#include "consac/run/training.h"

namespace consac::cli {
namespace {

/// "[10, 37]"; one number alone stands without brackets.
std::string RowText(const Layout& layout, const std::byte* row) {
  std::string out;
  std::int64_t count = 0;
  for (const Leaf& leaf : layout.leaves) {
    for (std::int64_t i = 0; i < leaf.count; ++i, ++count)
      out += (count > 0 ? ", " : "") + fmt::format("{:.4g}", ReadElement(leaf, row, i));
  }
  return count > 1 ? "[" + out + "]" : out;
}

constexpr double kConnectTimeout = 3.0;  // s

struct PlayFlags {
  std::string model, world, directory = "runs";
  WalkOptions walk;
};

Status PlayWithEngine(Policy& policy, const PlayFlags& flags, const std::string& url) {
  const Result<Endpoint> endpoint = Endpoint::Parse(url);
  if (!endpoint.ok()) return endpoint.status();
  Result<std::unique_ptr<Transport>> transport = ConnectTcp(*endpoint, kConnectTimeout);
  if (!transport.ok()) {
    return {transport.status().code(),
            transport.status().message() + "; the model was trained there, and another world can be named behind it"};
  }
  EnvClientOptions options;
  options.stop = &StopSignal();
  const Result<std::unique_ptr<EnvClient>> engine = EnvClient::Open(std::move(*transport), options);
  if (!engine.ok()) return engine.status();
  return Walk(policy, **engine, flags.walk, StopSignal());
}

int Play(const PlayFlags& flags) {
  const Result<std::string> path = run::FindModel(flags.model, flags.directory);
  if (!path.ok()) return Fail("play", path.status());
  Result<Policy> policy = Policy::Load(*path);
  if (!policy.ok()) return Fail("play", policy.status());
  const std::string id = flags.world.empty() ? run::TrainedWorld(*policy) : flags.world;
  Status status;
  if (run::IsUrl(id)) {
    status = PlayWithEngine(*policy, flags, id);
  } else {
    const Result<const worlds::World*> world = worlds::FindWorld(id);
    if (!world.ok()) return Fail("play", world.status());
    status = Walk(*policy, **world, flags.walk, StopSignal());
  }
  if (StopSignal().load()) return 130;
  return status.ok() ? 0 : Fail("play", status);
}

/// Walks until it has gone far enough. `step` takes the world one step on; `picture` draws it, or is empty.
Status WalkAlong(Policy& policy, BatchBuffer& buffer, const WalkOptions& options, const std::atomic<bool>& stop,
                 const std::function<Status(Batch&)>& step, const std::function<std::string()>& picture) {
  Rng rng(static_cast<std::uint64_t>(options.seed), StreamId("action_sampling"));
  double total = 0.0;
  std::int64_t episodes = 0;
  for (std::int64_t i = 1; i <= options.steps && episodes < options.episodes && !stop.load(); ++i) {
    const std::string drawn = picture ? "  " + picture() : "";
    buffer.Advance();
    Batch& batch = buffer.batch();
    policy.Act(batch.observations, batch.action_masks, 1,
               options.stochastic ? ActionMode::kSample : ActionMode::kDeterministic, rng, batch.actions);
    CONSAC_RETURN_IF_ERROR(step(batch));
    total += batch.rewards[0];
    Print("{:4}  observation {:<12} action {:<4} reward {:<6.4g}{}\n", i,
          RowText(policy.observation_layout(), batch.observations), RowText(policy.action_layout(), batch.actions),
          batch.rewards[0], drawn);
    if ((batch.terminated[0] | batch.truncated[0]) != 0) {
      Print("episode over: return {:.4g}, {}\n", total, batch.terminated[0] != 0 ? "terminated" : "truncated");
      total = 0.0;
      ++episodes;
    }
    std::fflush(stdout);
    if (options.delay_s > 0.0) std::this_thread::sleep_for(std::chrono::duration<double>(options.delay_s));
  }
  return Status::Ok();
}

}  // namespace

Status Walk(Policy& policy, const worlds::World& world, const WalkOptions& options, const std::atomic<bool>& stop) {
  const std::unique_ptr<VectorEnv> env = world.create(1);
  CONSAC_RETURN_IF_ERROR(policy.Fits(env->spec().behaviours[0]));
  BatchBuffer buffer(env->spec().behaviours[0]);
  env->Reset(static_cast<std::uint64_t>(options.seed), {&buffer.batch(), 1});
  std::function<std::string()> picture;
  if (world.describe != nullptr) picture = [&] { return world.describe(*env, 0); };
  const auto step = [&](Batch& batch) {
    env->Step({&batch, 1});
    return Status::Ok();
  };
  return WalkAlong(policy, buffer, options, stop, step, picture);
}

Status Walk(Policy& policy, EnvClient& engine, const WalkOptions& options, const std::atomic<bool>& stop) {
  CONSAC_RETURN_IF_ERROR(policy.Fits(engine.spec().behaviours[0]));
  BatchBuffer buffer(engine.spec().behaviours[0]);
  CONSAC_RETURN_IF_ERROR(engine.Reset(0, {&buffer.batch(), 1}));
  const auto step = [&](Batch& batch) { return engine.Step({&batch, 1}, MoreSteps::kYes); };
  return WalkAlong(policy, buffer, options, stop, step, {});
}

Action AddPlay(CLI::App& app) {
  const auto flags = std::make_shared<PlayFlags>();
  app.add_option("model", flags->model, "a .consac file or a run's name")->required();
  app.add_option("world", flags->world, "a built-in world or tcp://host:port; the one it was trained on unless given");
  app.add_option("--dir", flags->directory, "folder of the runs");
  AddWhole(app, "--steps", &flags->walk.steps, 1, kMostWhole, "at most so many steps");
  AddWhole(app, "--episodes", &flags->walk.episodes, 1, kMostWhole, "at most so many episodes");
  AddWhole(app, "--seed", &flags->walk.seed, 0, kMostWhole, "seed of the world");
  AddNumber(app, "--delay", &flags->walk.delay_s, 0, 3600, "seconds between steps");
  app.add_flag("--stochastic", flags->walk.stochastic, "draw actions instead of taking the most likely");
  return [flags] { return Play(*flags); };
}

}  // namespace consac::cli
