#include "acting.h"

#include <fmt/format.h>

#include <limits>

#include "consac/env/buffer.h"
#include "consac/policy/policy.h"
#include "report/console.h"

namespace consac::run {
namespace {

/// A policy for one behaviour of the engine, and where its steps are written.
struct Actor {
  Policy policy;
  BatchBuffer buffer;
};

/// The model's file for a behaviour: the model itself, or with several behaviours its neighbour of that name.
std::string BehaviourFile(const std::string& model, const EnvSpec& spec, const BehaviourSpec& behaviour) {
  if (spec.behaviours.size() == 1) return model;
  return model.substr(0, model.rfind('/') + 1) + behaviour.name + ".consac";
}

Result<std::vector<Actor>> LoadActors(const std::string& model, const EnvSpec& spec) {
  std::vector<Actor> actors;
  for (const BehaviourSpec& behaviour : spec.behaviours) {
    const std::string path = BehaviourFile(model, spec, behaviour);
    Result<Policy> policy = Policy::Load(path, behaviour.slots);
    if (!policy.ok()) return policy.status();
    const Status fits = policy->Fits(behaviour);
    if (!fits.ok()) return Status{fits.code(), "'" + path + "': " + fits.message()};
    actors.push_back({std::move(*policy), BatchBuffer(behaviour)});
  }
  return actors;
}

/// Mean return of the episodes that ended while it was looked at.
class MeanReturn {
 public:
  explicit MeanReturn(std::int32_t slots) : sums_(static_cast<std::size_t>(slots)) {}
  void Add(const Batch& batch) {
    for (std::size_t i = 0; i < batch.slots.size(); ++i) {
      double& sum = sums_[static_cast<std::size_t>(batch.slots[i])];
      sum += batch.rewards[i];
      if ((batch.terminated[i] | batch.truncated[i]) == 0) continue;
      total_ += sum;
      ++episodes_;
      sum = 0.0;
    }
  }
  double mean() const {
    return episodes_ > 0 ? total_ / static_cast<double>(episodes_) : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  std::vector<double> sums_;  // [slots] of the episode under way
  double total_ = 0.0;
  std::int64_t episodes_ = 0;
};

void ActOnce(std::vector<Actor>& actors, std::span<Batch> batches, Rng& rng) {
  for (std::size_t b = 0; b < actors.size(); ++b) {
    actors[b].buffer.Advance();
    batches[b] = actors[b].buffer.batch();
    actors[b].policy.Act(batches[b].observations, batches[b].action_masks, batches[b].rows(),
                         ActionMode::kDeterministic, rng, batches[b].actions);
  }
}

}  // namespace

Result<RunSummary> ActForEngine(const RunConfig& config, WorldLink& link, const std::atomic<bool>& stop) {
  const std::string& name = config.name.empty() ? link.request().model_name : config.name;
  if (name.empty()) {
    return Status{StatusCode::kInvalidArgument,
                  "the engine asks for training of length 0 and names no model to act with; set a length or a model "
                  "name there, or give --steps"};
  }
  const Result<std::string> path = FindModel(name, config.directory);
  if (!path.ok()) return path.status();
  const EnvSpec& spec = link.spec();
  Result<std::vector<Actor>> actors = LoadActors(*path, spec);
  if (!actors.ok()) return actors.status();
  Console console(StandardConsole());
  if (config.table || config.progress) console.Print(fmt::format("acting with {} for {}\n", *path, link.description()));

  Rng rng(config.seed, StreamId("action_sampling"));
  std::vector<Batch> batches;
  std::vector<MeanReturn> returns;
  for (std::size_t b = 0; b < actors->size(); ++b) {
    batches.push_back((*actors)[b].buffer.batch());
    returns.emplace_back(spec.behaviours[b].slots);
  }
  RunSummary summary;
  summary.acted_only = true;
  summary.model_path = *path;
  const double start = Now();
  Status status = link.Reset(config.seed, batches);
  while (status.ok() && !stop.load(std::memory_order_relaxed)) {
    ActOnce(*actors, batches, rng);
    status = link.Step(batches, MoreSteps::kYes);
    for (std::size_t b = 0; status.ok() && b < batches.size(); ++b) {
      summary.steps += batches[b].rows();
      returns[b].Add(batches[b]);
    }
  }
  // An engine that has seen enough closes; that is the end of such a session.
  const bool over = status.ok() || status.code() == StatusCode::kUnavailable || status.code() == StatusCode::kCancelled;
  if (!over) return status;
  summary.seconds = Now() - start;
  summary.mean_episode_reward = returns[0].mean();
  summary.interrupted = stop.load();
  if (config.table || config.progress) console.Print(fmt::format("acted for {} steps\n", summary.steps));
  return summary;
}

}  // namespace consac::run
