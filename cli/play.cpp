// consac play: watch a model, step by step.
#include "cli/play.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "cli/flags.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/text.h"
#include "consac/run/actors.h"
#include "consac/run/pause.h"
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
  std::string model, world, directory = "runs", token;
  double deadline_s = 60.0;
  WalkOptions walk;
};

Status PlayWithEngine(const std::vector<std::string>& models, const PlayFlags& flags, const std::string& url) {
  const Result<Endpoint> endpoint = Endpoint::Parse(url);
  if (!endpoint.ok()) return endpoint.status();
  Result<std::unique_ptr<Transport>> transport = ConnectTcp(*endpoint, kConnectTimeout);
  if (!transport.ok()) {
    return {transport.status().code(),
            transport.status().message() + "; the model was trained there, and another world can be named behind it"};
  }
  EnvClientOptions options;
  options.stop = &StopSignal();
  options.token = flags.token;
  options.deadline_s = flags.deadline_s;
  const Result<std::unique_ptr<EnvClient>> engine = EnvClient::Open(std::move(*transport), options);
  if (!engine.ok()) return engine.status();
  return Walk(models, **engine, flags.walk, StopSignal());
}

Status PlayIn(const std::vector<std::string>& models, const PlayFlags& flags) {
  std::string id = flags.world;
  if (id.empty()) {
    const Result<Policy> policy = Policy::Load(models[0]);
    if (!policy.ok()) return policy.status();
    id = run::TrainedWorld(*policy);
  }
  if (run::IsUrl(id)) return PlayWithEngine(models, flags, id);
  return Walk(models, id, flags.walk, StopSignal());
}

int Play(const PlayFlags& flags) {
  const Result<std::vector<std::string>> models = run::FindModels(flags.model, flags.directory);
  if (!models.ok()) return Fail("play", models.status());
  const Status status = PlayIn(*models, flags);
  if (StopSignal().load()) return 130;
  return status.ok() ? 0 : Fail("play", status);
}

/// What a walk asks of its world.
struct Walked {
  const EnvSpec& spec;
  std::function<Status(std::span<Batch>)> step;                       ///< one step on
  std::function<std::span<const std::uint8_t>(std::size_t)> present;  ///< as in VectorEnv
  std::function<std::string()> picture;                               ///< draws it, or is empty
};

/// Tells of one agent of a behaviour; of another one where that has left.
class Narrator {
 public:
  /// `name` stands in every line; empty: in none.
  explicit Narrator(const std::string& name) : name_(name.empty() ? "" : name + "  ") {}

  /// One line for a step of `acting`, and one for the episode that it ends.
  void Tell(std::int64_t step, const Batch& batch, std::span<const std::int32_t> acting, const Policy& policy,
            const std::string& drawn) {
    if (acting.empty()) return;
    if (std::find(acting.begin(), acting.end(), slot_) == acting.end()) {
      slot_ = acting[0];
      total_ = 0.0;
    }
    const auto row = static_cast<std::size_t>(slot_);
    const Layout &seen = policy.observation_layout(), &done = policy.action_layout();
    total_ += batch.rewards[row];
    Print("{:4}  {}observation {:<12} action {:<4} reward {:<6.4g}{}\n", step, name_,
          RowText(seen, batch.observations + row * seen.row_bytes), RowText(done, batch.actions + row * done.row_bytes),
          batch.rewards[row], drawn);
    if ((batch.terminated[row] | batch.truncated[row]) == 0) return;
    Print("{}episode over: return {:.4g}, {}\n", name_, total_,
          batch.terminated[row] != 0 ? "terminated" : "truncated");
    total_ = 0.0;
    ++episodes_;
  }
  std::int64_t episodes() const { return episodes_; }

 private:
  const std::string name_;
  std::int32_t slot_ = 0;
  double total_ = 0.0;
  std::int64_t episodes_ = 0;
};

/// Walks until it has gone far enough. The world has been reset into the actors' batches.
Status WalkAlong(run::Actors& actors, const Walked& world, const WalkOptions& options, const std::atomic<bool>& stop) {
  Rng rng(static_cast<std::uint64_t>(options.seed), StreamId("action_sampling"));
  actors.Begin();
  std::vector<Narrator> narrators;
  for (const BehaviourSpec& behaviour : world.spec.behaviours)
    narrators.emplace_back(actors.size() == 1 ? "" : behaviour.name);
  const auto going_on = [&] {
    return std::any_of(narrators.begin(), narrators.end(),
                       [&](const Narrator& narrator) { return narrator.episodes() < options.episodes; });
  };
  bool anybody = false;
  for (std::int64_t i = 1; i <= options.steps && going_on() && !stop.load(); ++i) {
    const std::string drawn = world.picture ? "  " + world.picture() : "";
    for (std::size_t b = 0; b < actors.size(); ++b)
      actors.Act(b, world.present(b), options.stochastic ? ActionMode::kSample : ActionMode::kDeterministic, rng);
    CONSAC_RETURN_IF_ERROR(world.step(actors.batches()));
    for (std::size_t b = 0; b < actors.size(); ++b) {
      narrators[b].Tell(i, actors.batches()[b], actors.acting(b), actors.policy(b), drawn);
      anybody = anybody || !actors.acting(b).empty();
    }
    FlushOutput();
    for (std::size_t b = 0; b < actors.size(); ++b)
      CONSAC_RETURN_IF_ERROR(run::CheckRewards(world.spec.behaviours[b].name, actors.batches()[b], actors.acting(b)));
    run::Pause(options.delay_s, stop);
  }
  if (anybody || stop.load()) return Status::Ok();
  return {StatusCode::kUnavailable, "no agent took part in " + std::to_string(options.steps) +
                                        " steps, so nothing was played; give more with --steps, or see why the world "
                                        "has nobody to act for (state 16 of protocol 2, R77)"};
}

}  // namespace

Status Walk(const std::vector<std::string>& models, std::string_view world, const WalkOptions& options,
            const std::atomic<bool>& stop) {
  const Result<const worlds::World*> row = worlds::FindWorld(world);
  if (!row.ok()) return row.status();
  Result<std::unique_ptr<VectorEnv>> made = worlds::MakeWorld(world, 1);
  if (!made.ok()) return made.status();
  const std::unique_ptr<VectorEnv> env = std::move(*made);
  Result<run::Actors> actors = run::Actors::Load(models, env->spec());
  if (!actors.ok()) return actors.status();
  env->Reset(static_cast<std::uint64_t>(options.seed), actors->batches());
  const auto step = [&](std::span<Batch> batches) {
    env->Step(batches);
    return Status::Ok();
  };
  std::function<std::string()> picture;
  if ((*row)->describe != nullptr) picture = [&] { return (*row)->describe(*env, 0); };
  return WalkAlong(*actors, {env->spec(), step, [&](std::size_t b) { return env->present(b); }, picture}, options,
                   stop);
}

Status Walk(const std::vector<std::string>& models, EnvClient& engine, const WalkOptions& options,
            const std::atomic<bool>& stop) {
  Result<run::Actors> actors = run::Actors::Load(models, engine.spec());
  if (!actors.ok()) return actors.status();
  CONSAC_RETURN_IF_ERROR(engine.Reset(0, actors->batches()));
  const auto step = [&](std::span<Batch> batches) { return engine.Step(batches, MoreSteps::kYes); };
  return WalkAlong(*actors, {engine.spec(), step, [&](std::size_t b) { return engine.present(b); }, {}}, options, stop);
}

Action AddPlay(CLI::App& app) {
  const auto flags = std::make_shared<PlayFlags>();
  app.add_option("model", flags->model, "a .consac file, or the name of a run, all of whose models act")->required();
  app.add_option("world", flags->world, "a built-in world or tcp://host:port; the one it was trained on unless given");
  app.add_option("--dir", flags->directory, "folder of the runs");
  AddWhole(app, "--steps", &flags->walk.steps, 1, kMostWhole, "at most so many steps");
  AddWhole(app, "--episodes", &flags->walk.episodes, 1, kMostWhole, "at most so many episodes");
  AddWhole(app, "--seed", &flags->walk.seed, 0, kMostWhole, "seed of the world");
  AddNumber(app, "--delay", &flags->walk.delay_s, 0, 3600, "seconds between steps");
  AddNumber(app, "--deadline", &flags->deadline_s, 0, kMostSeconds,
            "seconds of an engine's silence that end the session");
  AddToken(app, &flags->token, "access token that the engine asks for");
  app.add_flag("--stochastic", flags->walk.stochastic, "draw actions instead of taking the most likely");
  return [flags] { return Play(*flags); };
}

}  // namespace consac::cli
