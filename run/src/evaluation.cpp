// Mean return of a model over episodes, in this process or with an engine.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/env/success.h"
#include "data_watch.h"
#include "judgement.h"

namespace consac::run {
namespace {

constexpr std::int64_t kMostCopies = 16;

/// Returns of finished episodes. Each slot contributes its share, so that short episodes are not favoured; the share of
/// a slot whose agent is away while nobody else has anything left to contribute is the others'.
/// Source: Stable Baselines3, evaluate_policy.
class Returns {
 public:
  Returns(std::int64_t episodes, std::int64_t slots)
      : sums_(static_cast<std::size_t>(slots)), lengths_(sums_.size()), left_(sums_.size(), episodes / slots) {
    for (std::int64_t i = 0; i < episodes % slots; ++i) ++left_[static_cast<std::size_t>(i)];
  }

  /// Adds one step of the slots `acting` in a batch of all slots; an episode also ends after `limit` steps (0: never).
  /// `success` [slots] is 1 where it was to where it should be; empty: nobody says.
  void Add(const Batch& batch, std::span<const std::int32_t> acting, std::int64_t limit,
           std::span<const float> success) {
    for (const std::int32_t slot : acting) {
      const auto i = static_cast<std::size_t>(slot);
      sums_[i] += batch.rewards[i];
      ++lengths_[i];
      const bool ended = (batch.terminated[i] | batch.truncated[i]) != 0 || (limit > 0 && lengths_[i] >= limit);
      if (!ended) continue;
      if (left_[i] > 0) {
        --left_[i];
        returns_.push_back(sums_[i]);
        steps_ += static_cast<double>(lengths_[i]);
        if (!success.empty()) told_ = true, successes_ += success[i] > 0.5f ? 1 : 0;
      }
      Forget(i);
    }
  }
  /// Who takes the coming step, one byte per slot; empty: all.
  void Present(std::span<const std::uint8_t> present) {
    if (present.empty()) return;
    std::int64_t here = 0, left_here = 0, left_away = 0;
    for (std::size_t i = 0; i < left_.size(); ++i) {
      here += present[i] != 0 ? 1 : 0;
      (present[i] != 0 ? left_here : left_away) += left_[i];
      if (present[i] == 0) Forget(i);
    }
    if (here > 0 && left_here == 0) PassOn(present, std::min(here, left_away));
  }
  bool complete() const {
    return std::all_of(left_.begin(), left_.end(), [](std::int64_t left) { return left == 0; });
  }

  EvaluateSummary Summary(const std::string& behaviour) const {
    EvaluateSummary summary;
    summary.behaviour = behaviour;
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
    if (told_) summary.success_rate = static_cast<double>(successes_) / n;
    return summary;
  }

  std::int64_t episodes() const { return static_cast<std::int64_t>(returns_.size()); }

 private:
  void Forget(std::size_t slot) {
    sums_[slot] = 0.0;
    lengths_[slot] = 0;
  }
  /// One episode each of `count` that absent slots owe becomes one of a present slot.
  void PassOn(std::span<const std::uint8_t> present, std::int64_t count) {
    for (std::size_t away = 0, here = 0; count > 0; --count) {
      while (present[away] != 0 || left_[away] == 0) ++away;
      while (present[here] == 0) ++here;
      --left_[away];
      ++left_[here++];
    }
  }

  std::vector<double> sums_;           // [slots] of the episode under way
  std::vector<std::int64_t> lengths_;  // [slots]
  std::vector<std::int64_t> left_;     // [slots] episodes still wanted
  std::vector<double> returns_;
  double steps_ = 0.0;
  std::int64_t successes_ = 0;
  bool told_ = false;  // whether anybody says which succeed
};

/// The world that is named, or the one that the models were trained on.
Result<std::unique_ptr<WorldLink>> OpenWorldFor(const EvaluateOptions& options, const std::vector<std::string>& models,
                                                const std::atomic<bool>& stop) {
  if (!options.world.empty()) return OpenToJudge(options, options.world, stop);
  const Result<Policy> policy = Policy::Load(models[0]);
  if (!policy.ok()) return policy.status();
  const std::string world = TrainedWorld(*policy);
  if (world.empty())
    return Status{StatusCode::kInvalidArgument, "'" + models[0] + "' does not say which world it is for; name one"};
  Result<std::unique_ptr<WorldLink>> link = OpenToJudge(options, world, stop);
  if (link.ok() || link.status().code() != StatusCode::kNotFound) return link;
  return Status{StatusCode::kNotFound, "the model was trained on " + Quote(world) +
                                           ", which is no built-in world; name a world or an engine's URL"};
}

/// Behaviours that are judged together.
class Judgement {
 public:
  Judgement(const EvaluateOptions& options, const EnvSpec& spec)
      : options_(options), spec_(spec), limit_(spec.max_episode_steps > 0 ? 0 : options.max_episode_steps) {
    for (const BehaviourSpec& behaviour : spec.behaviours) {
      returns_.emplace_back(options.episodes, behaviour.slots);
      somebody_.push_back(Now());
    }
  }

  bool complete() const {
    return std::all_of(returns_.begin(), returns_.end(), [](const Returns& returns) { return returns.complete(); });
  }
  bool any() const {
    return std::any_of(returns_.begin(), returns_.end(), [](const Returns& returns) { return returns.episodes() > 0; });
  }
  /// What a step has brought. kNonFinite where a reward is no number: then there is no mean.
  Status Add(Actors& actors, const WorldLink& link) {
    for (std::size_t b = 0; b < returns_.size(); ++b) {
      CONSAC_RETURN_IF_ERROR(CheckRewards(spec_.behaviours[b].name, actors.batches()[b], actors.acting(b)));
      returns_[b].Add(actors.batches()[b], actors.acting(b), limit_, SuccessOf(b, link));
      returns_[b].Present(link.present(b));
      if (!actors.acting(b).empty() || returns_[b].complete()) somebody_[b] = Now();
      if (Now() - somebody_[b] < kPatience) continue;
      somebody_[b] = Now();
      options_.say("no agent of " + Quote(spec_.behaviours[b].name) + " is there to be judged; waiting for one");
    }
    return Status::Ok();
  }
  std::vector<EvaluateSummary> Summaries() const {
    std::vector<EvaluateSummary> summaries;
    for (std::size_t b = 0; b < returns_.size(); ++b)
      summaries.push_back(returns_[b].Summary(spec_.behaviours[b].name));
    return summaries;
  }

 private:
  static constexpr double kPatience = 5.0;  // s

  // Of the slots of behaviour `b`, which stand after those of the behaviours before it.
  std::span<const float> SuccessOf(std::size_t b, const WorldLink& link) const {
    std::size_t first = 0;
    for (std::size_t before = 0; before < b; ++before)
      first += static_cast<std::size_t>(spec_.behaviours[before].slots);
    for (const InfoColumn& column : link.infos()) {
      if (column.name == kSuccessInfo)
        return column.values.subspan(first, static_cast<std::size_t>(spec_.behaviours[b].slots));
    }
    return {};
  }

  const EvaluateOptions& options_;
  const EnvSpec& spec_;
  const std::int64_t limit_;
  std::vector<Returns> returns_;
  std::vector<double> somebody_;  // when an agent of the behaviour last was there, or its absence was said
};

}  // namespace

std::string TrainedWorld(const Policy& policy) {
  const Result<nlohmann::json> training = ReadJson<nlohmann::json>(policy.data().training_json);
  if (!training.ok() || !training->is_object()) return {};
  const auto world = training->find("world");
  return world != training->end() && world->is_string() ? world->get<std::string>() : std::string();
}

Status CheckRewards(std::string_view behaviour, const Batch& batch, std::span<const std::int32_t> acting) {
  for (const std::int32_t slot : acting) {
    const float reward = batch.rewards[slot];
    if (!std::isfinite(reward))
      return NoReward(Quote(behaviour) + ", agent " + std::to_string(slot), reward,
                      "there is no return to tell; mend it in the world");
  }
  return Status::Ok();
}

Result<std::unique_ptr<WorldLink>> OpenToJudge(const EvaluateOptions& options, const std::string& world,
                                               const std::atomic<bool>& stop) {
  if (!IsUrl(world))
    return MakeLocalLink(world, static_cast<std::int32_t>(std::clamp(options.episodes, std::int64_t{1}, kMostCopies)));
  EngineOptions engine;
  engine.url = world;
  engine.connect_timeout_s = options.connect_timeout_s;
  engine.client.deadline_s = options.deadline_s;
  engine.client.token = options.token;
  engine.client.stop = &stop;
  return ConnectEngine(engine, options.say);
}

Result<std::vector<EvaluateSummary>> Judge(const EvaluateOptions& options, WorldLink& link, Actors& actors,
                                           const std::atomic<bool>& stop, const std::function<void()>& meanwhile) {
  Judgement judgement(options, link.spec());
  Rng rng(options.seed, StreamId("action_sampling"));
  CONSAC_RETURN_IF_ERROR(link.Reset(options.seed, actors.batches()));
  actors.Begin();
  while (!judgement.complete() && !stop.load(std::memory_order_relaxed)) {
    for (std::size_t b = 0; b < actors.size(); ++b)
      actors.Act(b, link.present(b), options.deterministic ? ActionMode::kDeterministic : ActionMode::kSample, rng);
    const Status status = link.Step(actors.batches(), MoreSteps::kYes);
    if (status.code() == StatusCode::kCancelled) break;
    if (!status.ok() && status.code() == StatusCode::kUnavailable && judgement.any())
      break;  // the engine has seen enough
    if (!status.ok()) return status;
    CONSAC_RETURN_IF_ERROR(judgement.Add(actors, link));
    meanwhile();
  }
  return judgement.Summaries();
}

Result<std::vector<EvaluateSummary>> Evaluate(const EvaluateOptions& options, const std::atomic<bool>& stop) {
  if (options.episodes < 1)
    return Status{StatusCode::kInvalidArgument,
                  "an evaluation needs at least 1 episode, not " + std::to_string(options.episodes)};
  const Result<std::vector<std::string>> models = FindModels(options.model, options.directory);
  if (!models.ok()) return models.status();
  Result<std::unique_ptr<WorldLink>> link = OpenWorldFor(options, *models, stop);
  if (!link.ok()) return link.status();
  Result<Actors> actors = Actors::Load(*models, (*link)->spec());
  if (!actors.ok()) return actors.status();
  return Judge(options, **link, *actors, stop, [] {});
}

}  // namespace consac::run
