// consac play: watch a model, step by step.
#include "cli/play.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

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

struct PlayFlags {
  std::string model, world, directory = "runs";
  WalkOptions walk;
};

int Play(const PlayFlags& flags) {
  const Result<std::string> path = run::FindModel(flags.model, flags.directory);
  if (!path.ok()) return Fail("play", path.status());
  Result<Policy> policy = Policy::Load(*path);
  if (!policy.ok()) return Fail("play", policy.status());
  const nlohmann::json training = nlohmann::json::parse(policy->data().training_json, nullptr, false);
  const std::string id = !flags.world.empty()   ? flags.world
                         : training.is_object() ? training.value("world", std::string())
                                                : std::string();
  const Result<const worlds::World*> world = worlds::FindWorld(id);
  if (!world.ok())
    return Fail("play", {world.status().code(),
                         world.status().message() +
                             "; play needs a built-in world (an engine plays with consac train and a model name)"});
  const Status status = Walk(*policy, **world, flags.walk, StopSignal());
  if (!status.ok()) return Fail("play", status);
  return StopSignal().load() ? 130 : 0;
}

}  // namespace

Status Walk(Policy& policy, const worlds::World& world, const WalkOptions& options, const std::atomic<bool>& stop) {
  const std::unique_ptr<VectorEnv> env = world.create(1);
  const BehaviourSpec& behaviour = env->spec().behaviours[0];
  CONSAC_RETURN_IF_ERROR(policy.Fits(behaviour));
  BatchBuffer buffer(behaviour);
  Rng rng(options.seed, StreamId("action_sampling"));
  env->Reset(options.seed, {&buffer.batch(), 1});
  double total = 0.0;
  std::int64_t episodes = 0;
  for (std::int64_t step = 1; step <= options.steps && episodes < options.episodes && !stop.load(); ++step) {
    const std::string picture = world.describe != nullptr ? "  " + world.describe(*env, 0) : "";
    buffer.Advance();
    Batch& batch = buffer.batch();
    policy.Act(batch.observations, batch.action_masks, 1,
               options.stochastic ? ActionMode::kSample : ActionMode::kDeterministic, rng, batch.actions);
    env->Step({&batch, 1});
    total += batch.rewards[0];
    fmt::print("{:4}  observation {:<12} action {:<4} reward {:<6.4g}{}\n", step,
               RowText(behaviour.observation_layout, batch.observations),
               RowText(behaviour.action_layout, batch.actions), batch.rewards[0], picture);
    if ((batch.terminated[0] | batch.truncated[0]) != 0) {
      fmt::print("episode over: return {:.4g}, {}\n", total, batch.terminated[0] != 0 ? "terminated" : "truncated");
      total = 0.0;
      ++episodes;
    }
    std::fflush(stdout);
    if (options.delay_s > 0.0) std::this_thread::sleep_for(std::chrono::duration<double>(options.delay_s));
  }
  return Status::Ok();
}

Action AddPlay(CLI::App& app) {
  const auto flags = std::make_shared<PlayFlags>();
  app.add_option("model", flags->model, "a .consac file or a run's name")->required();
  app.add_option("world", flags->world, "a built-in world; the one it was trained on unless given");
  app.add_option("--dir", flags->directory, "folder of the runs");
  app.add_option("--steps", flags->walk.steps, "at most so many steps")->check(CLI::PositiveNumber);
  app.add_option("--episodes", flags->walk.episodes, "at most so many episodes")->check(CLI::PositiveNumber);
  app.add_option("--seed", flags->walk.seed, "seed of the world");
  app.add_option("--delay", flags->walk.delay_s, "seconds between steps")->check(CLI::NonNegativeNumber);
  app.add_flag("--stochastic", flags->walk.stochastic, "draw actions instead of taking the most likely");
  return [flags] { return Play(*flags); };
}

}  // namespace consac::cli
