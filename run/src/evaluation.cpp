// Mean return of a model over episodes, in this process or with an engine.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "consac/base/text.h"
#include "consac/env/buffer.h"
#include "consac/policy/policy.h"
#include "consac/run/training.h"
#include "link.h"

namespace consac::run {
namespace {

constexpr std::int64_t kMostCopies = 16;

/// Returns of finished episodes. Each slot contributes its share, so that short episodes are not favoured.
/// Source: Stable Baselines3, evaluate_policy.
class Returns {
 public:
  Returns(std::int64_t episodes, std::int64_t slots)
      : sums_(static_cast<std::size_t>(slots)), lengths_(sums_.size()), left_(sums_.size(), episodes / slots) {
    for (std::int64_t i = 0; i < episodes % slots; ++i) ++left_[static_cast<std::size_t>(i)];
  }

  /// Adds one step; an episode also ends after `limit` steps (0: never).
  void Add(const Batch& batch, std::int64_t limit) {
    for (std::size_t i = 0; i < sums_.size(); ++i) {
      sums_[i] += batch.rewards[i];
      ++lengths_[i];
      const bool ended = (batch.terminated[i] | batch.truncated[i]) != 0 || (limit > 0 && lengths_[i] >= limit);
      if (!ended) continue;
      if (left_[i] > 0) {
        --left_[i];
        returns_.push_back(sums_[i]);
        steps_ += static_cast<double>(lengths_[i]);
      }
      sums_[i] = 0.0;
      lengths_[i] = 0;
    }
  }
  bool complete() const {
    return std::all_of(left_.begin(), left_.end(), [](std::int64_t left) { return left == 0; });
  }

  EvaluateSummary Summary() const {
    EvaluateSummary summary;
    summary.episodes = static_cast<std::int64_t>(returns_.size());
    if (returns_.empty()) return summary;
    const auto n = static_cast<double>(returns_.size());
    for (const double value : returns_) summary.mean_reward += value / n;
    for (const double value : returns_)
      summary.std_reward += (value - summary.mean_reward) * (value - summary.mean_reward) / n;
    summary.std_reward = std::sqrt(summary.std_reward);
    summary.min_reward = *std::min_element(returns_.begin(), returns_.end());
    summary.max_reward = *std::max_element(returns_.begin(), returns_.end());
    summary.mean_length = steps_ / n;
    return summary;
  }

 private:
  std::vector<double> sums_;           // [slots] of the episode under way
  std::vector<std::int64_t> lengths_;  // [slots]
  std::vector<std::int64_t> left_;     // [slots] episodes still wanted
  std::vector<double> returns_;
  double steps_ = 0.0;
};

Result<std::unique_ptr<WorldLink>> OpenWorld(const EvaluateOptions& options, const std::string& world,
                                             const std::atomic<bool>& stop) {
  if (!IsUrl(world))
    return MakeLocalLink(world, static_cast<std::int32_t>(std::clamp(options.episodes, std::int64_t{1}, kMostCopies)));
  EngineOptions engine;
  engine.url = world;
  engine.connect_timeout_s = options.connect_timeout_s;
  engine.client.deadline_s = options.deadline_s;
  engine.client.stop = &stop;
  return ConnectEngine(engine, [](const std::string& line) { Log(LogLevel::kInfo, line); });
}

}  // namespace

std::string TrainedWorld(const Policy& policy) {
  const nlohmann::json training = nlohmann::json::parse(policy.data().training_json, nullptr, false);
  const auto world = training.is_object() ? training.find("world") : training.end();
  return world != training.end() && world->is_string() ? world->get<std::string>() : std::string();
}

Result<EvaluateSummary> Evaluate(const EvaluateOptions& options, const std::atomic<bool>& stop) {
  if (options.episodes < 1)
    return Status{StatusCode::kInvalidArgument,
                  "an evaluation needs at least 1 episode, not " + std::to_string(options.episodes)};
  const Result<std::string> path = FindModel(options.model, options.directory);
  if (!path.ok()) return path.status();
  Result<Policy> policy = Policy::Load(*path, kMostCopies);
  if (!policy.ok()) return policy.status();
  const std::string world = options.world.empty() ? TrainedWorld(*policy) : options.world;
  if (world.empty())
    return Status{StatusCode::kInvalidArgument, "'" + *path + "' does not say which world it is for; name one"};
  Result<std::unique_ptr<WorldLink>> link = OpenWorld(options, world, stop);
  if (!link.ok() && options.world.empty() && link.status().code() == StatusCode::kNotFound)
    return Status{StatusCode::kNotFound, "the model was trained on " + Quote(world) +
                                             ", which is no built-in world; name a world or an engine's URL"};
  if (!link.ok()) return link.status();
  const BehaviourSpec& behaviour = (*link)->spec().behaviours[0];
  CONSAC_RETURN_IF_ERROR(policy->Fits(behaviour));

  BatchBuffer buffer(behaviour);
  Returns returns(options.episodes, behaviour.slots);
  Rng rng(options.seed, StreamId("action_sampling"));
  const std::int64_t limit = (*link)->spec().max_episode_steps > 0 ? 0 : options.max_episode_steps;
  CONSAC_RETURN_IF_ERROR((*link)->Reset(options.seed, {&buffer.batch(), 1}));
  while (!returns.complete() && !stop.load(std::memory_order_relaxed)) {
    buffer.Advance();
    Batch& batch = buffer.batch();
    policy->Act(batch.observations, batch.action_masks, batch.rows(),
                options.deterministic ? ActionMode::kDeterministic : ActionMode::kSample, rng, batch.actions);
    const Status status = (*link)->Step({&batch, 1}, MoreSteps::kYes);
    if (status.code() == StatusCode::kCancelled) break;
    if (!status.ok() && status.code() == StatusCode::kUnavailable && returns.Summary().episodes > 0)
      break;  // the engine has seen enough
    if (!status.ok()) return status;
    returns.Add(batch, limit);
  }
  return returns.Summary();
}

}  // namespace consac::run
