// What learns in a run, and what it is given: a learner for each behaviour, or a player that does not learn; recorded
// steps, a world's prices of goals, memory.
#include <algorithm>
#include <atomic>

#include "config_fields.h"
#include "consac/base/memory.h"
#include "consac/base/text.h"
#include "frozen_player.h"
#include "state_size.h"
#include "training_loop.h"

namespace consac::run {
namespace {

std::atomic<int> networks_in_the_making{0};

struct Making {
  Making() { networks_in_the_making.fetch_add(1, std::memory_order_relaxed); }
  ~Making() { networks_in_the_making.fetch_sub(1, std::memory_order_relaxed); }
  Making(const Making&) = delete;
  Making& operator=(const Making&) = delete;
};

constexpr std::int64_t kRound = 64;  // optimiser steps between looks at evaluations and checkpoints, without a world

}  // namespace

Status CannotPrice(const RunConfig& config, const learn::Algorithm& algorithm, const std::string& world) {
  const bool always = algorithm.relabels_goals;
  return {StatusCode::kInvalidArgument, (always ? Quote(config.algorithm) : "HerReplayBuffer") +
                                            " needs a world that can say what other goals would have paid, and " +
                                            world + " cannot" +
                                            (IsUrl(config.world) ? " (protocol 2's capability 'relabel')" : "") +
                                            "; choose " + (always ? "another algorithm" : "ReplayBuffer")};
}

bool NothingToLose() {
  return networks_in_the_making.load(std::memory_order_relaxed) > 0;
}

// Of config_.steps, the steps of one behaviour's agents: what its learner's schedules run over.
std::int64_t Training::ShareOfSteps(std::int64_t slots) const {
  const double share = static_cast<double>(slots) / static_cast<double>(slots_);
  return static_cast<std::int64_t>(static_cast<double>(config_.steps) * share + 0.5);
}

// Of the world's behaviour of that name, or of the only one.
Status Training::LoadDemonstration() {
  const bool given = !config_.demonstrations.empty();
  const std::string name = Quote(config_.algorithm);
  if (given && algorithm_->demonstrations == learn::Demonstrations::kNone)
    return {StatusCode::kInvalidArgument, name + " learns from no demonstrations; leave them out"};
  if (!given && algorithm_->demonstrations == learn::Demonstrations::kNeeds)
    return {StatusCode::kInvalidArgument,
            name + " learns from demonstrations; give --set demonstrations=FILE (spec/demonstration.md)"};
  if (!given) return Status::Ok();
  Result<Demonstration> recorded = Demonstration::Load(config_.demonstrations);
  if (!recorded.ok()) return recorded.status();
  demonstration_ = std::move(*recorded);
  for (const BehaviourSpec& behaviour : spec().behaviours) {
    const BehaviourSpec& shown = demonstration_->behaviour;
    if (behaviour.name != shown.name && spec().behaviours.size() > 1) continue;
    const bool fits =
        behaviour.observation_space == shown.observation_space && behaviour.action_space == shown.action_space;
    if (fits) return Status::Ok();
    return {StatusCode::kInvalidArgument, "'" + config_.demonstrations + "' has observations " +
                                              shown.observation_space.ToString() + " and actions " +
                                              shown.action_space.ToString() + ", the world has " +
                                              behaviour.observation_space.ToString() + " and " +
                                              behaviour.action_space.ToString() + "; record them in this world"};
  }
  return {StatusCode::kInvalidArgument, "'" + config_.demonstrations + "' is of behaviour " +
                                            Quote(demonstration_->behaviour.name) + ", which the world does not have"};
}

learn::LearnerOptions Training::OptionsFor(std::size_t b, const BehaviourSpec& behaviour) {
  learn::LearnerOptions options;
  options.behaviour = behaviour;
  options.seed = learn::BehaviourSeed(config_.seed, b);
  options.total_steps = ShareOfSteps(behaviour.slots);
  options.executor = pool_.executor();
  const bool shown =
      demonstration_.has_value() && (spec().behaviours.size() == 1 || demonstration_->behaviour.name == behaviour.name);
  if (shown) options.demonstration = &*demonstration_;
  if (WithoutPrices() == nullptr) {
    options.price_goals = [this, b](const std::byte* observations, std::int64_t rows, float* rewards) {
      return PriceGoals(b, observations, rows, rewards);
    };
  }
  return options;
}

// The first of the worlds that cannot say what other goals would have paid.
WorldLink* Training::WithoutPrices() {
  for (std::size_t i = 0; i < crew_.size(); ++i)
    if (!crew_[i].link().prices_goals()) return &crew_[i].link();
  return nullptr;
}

// Of the first world that is there: they are alike. One that fails here is lost when it is stepped next.
Status Training::PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) {
  Status latest;
  for (std::size_t i = 0; i < crew_.size(); ++i) {
    if (lost_[i] != 0) continue;
    latest = crew_[i].link().PriceGoals(b, observations, rows, rewards);
    if (latest.ok() || stop_.load(std::memory_order_relaxed)) return latest;
  }
  if (!latest.ok()) return latest;
  return {StatusCode::kUnavailable, "no engine is left to say what other goals would have paid"};
}

// A round of learning, or less where `stop_` is set in the middle of it.
void Training::LearnRound(learn::Learner& learner, learn::LearnPieces& pieces) const {
  for (std::int64_t left = kRound; left > 0;) {
    const std::int64_t piece = std::min(left, pieces.budget().gradient_steps);
    if (!learner.Learn({piece}) || stop_.load(std::memory_order_relaxed) || !learner.health().ok()) return;
    left -= piece;
    pieces.Look(Now());
  }
}

Status Training::MakeLearners() {
  const Result<const learn::Algorithm*> algorithm = learn::FindAlgorithm(config_.algorithm);
  if (!algorithm.ok()) return algorithm.status();
  algorithm_ = *algorithm;
  CONSAC_RETURN_IF_ERROR(LoadDemonstration());
  const Result<learn::HyperparameterSet> values = HyperparametersOf(config_);
  if (!values.ok()) return values.status();
  if (WorldLink* world = WithoutPrices(); world != nullptr && learn::RelabelsGoals(*algorithm_, *values))
    return CannotPrice(config_, *algorithm_, world->description());
  log_style_ = learn::LogStyleOf(*algorithm_, *values);
  std::vector<BehaviourSpec> behaviours = spec().behaviours;
  for (std::size_t b = 0; b < behaviours.size(); ++b) {
    behaviours[b].slots = 0;
    for (std::size_t i = 0; i < crew_.size(); ++i) behaviours[b].slots += crew_[i].link().spec().behaviours[b].slots;
    slots_ += behaviours[b].slots;
  }
  const Result<FrozenModels> frozen = FrozenFilesOf(config_, spec());
  if (!frozen.ok()) return frozen.status();
  std::int64_t bytes_left = config_.max_memory_mib << 20, state_left = static_cast<std::int64_t>(kMostStateBytes);
  for (std::size_t b = 0; b < behaviours.size(); ++b) {
    const BehaviourSpec& behaviour = behaviours[b];
    learn::LearnerOptions options = OptionsFor(b, behaviour);
    options.max_bytes = bytes_left;
    options.max_state_bytes = state_left;
    const Making making;
    const auto model = frozen->find(behaviour.name);
    Result<std::unique_ptr<learn::Learner>> learner = model != frozen->end()
                                                          ? MakeFrozenPlayer(model->second, behaviour, options.seed)
                                                          : algorithm_->create(options, *values);
    if (learner.status().code() == StatusCode::kResourceExhausted) {
      const std::string which = behaviours.size() > 1 ? "behaviour " + Quote(behaviour.name) + ": " : "";
      // Of a machine that has no more than the limit, more cannot be had.
      const bool there_is = CheckMemory(static_cast<std::size_t>(bytes_left), "the limit").ok();
      const std::string raise =
          there_is ? ", or raise max_memory_mib (now " + std::to_string(config_.max_memory_mib) + ")" : "";
      return {StatusCode::kResourceExhausted, which + learner.status().message() + raise};
    }
    if (!learner.ok()) return learner.status();
    StateSize taken;
    (*learner)->Visit(taken);
    const auto state = static_cast<std::int64_t>(taken.bytes());
    bytes_left = std::max<std::int64_t>(0, bytes_left - (*learner)->memory_bytes() - state);
    state_left = std::max<std::int64_t>(0, state_left - state);
    trainees_.push_back({std::move(*learner), EpisodeSums(behaviour.slots, b),
                         DataWatch(behaviour, DataWatchOptions::Of(config_, spec())), model != frozen->end()});
  }
  if (!algorithm_->needs_world) config_.steps = trainees_[0].learner->planned_steps();
  return Status::Ok();
}

}  // namespace consac::run
