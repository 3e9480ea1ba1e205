// A training that is judged as it goes: every so many steps the models of now act for some episodes in a world of their
// own, the best of them are kept, and a mean reward that is high enough ends the training. Nothing of it changes what
// is learned. Source: Stable Baselines3, EvalCallback and StopTrainingOnRewardThreshold.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "consac/base/path.h"
#include "consac/base/text.h"
#include "judgement.h"
#include "run_files.h"
#include "training_loop.h"

namespace consac::run {
namespace {

constexpr const char* kBestFolder = "best";

std::string Words(std::span<const EvaluateSummary> summaries) {
  std::string words;
  for (const EvaluateSummary& summary : summaries) {
    words += words.empty() ? "" : ", ";
    if (summaries.size() > 1) words += summary.behaviour + " ";
    words += fmt::format("{:.4g} +- {:.4g}", summary.mean_reward, summary.std_reward);
    if (!std::isnan(summary.success_rate)) words += fmt::format(" ({:.4g} % succeed)", 100.0 * summary.success_rate);
  }
  return words;
}

}  // namespace

// Steps at which an evaluation is due do not depend on where a run was interrupted.
void Training::PlanEvaluation() {
  if (config_.eval_every > 0) next_evaluation_ = (steps() / config_.eval_every + 1) * config_.eval_every;
}

// Where the evaluations' world is, and how long it is waited for: one that has failed is tried once from then on.
EvaluateOptions Training::EvaluationOptions() {
  EvaluateOptions options;
  options.world = config_.eval_world.empty() ? config_.world : config_.eval_world;
  options.episodes = config_.eval_episodes;
  options.seed = config_.seed + options.seed;
  options.connect_timeout_s = evaluation_.ok() ? config_.connect_timeout_s : 0.0;
  options.deadline_s = config_.deadline_s;
  options.token = config_.token;
  return options;
}

Status Training::CheckEvaluation() {
  if (config_.eval_every == 0 || config_.eval_world.empty()) return Status::Ok();
  EvaluateOptions options = EvaluationOptions();
  options.episodes = 1;
  const Result<std::unique_ptr<WorldLink>> link = OpenToJudge(options, config_.eval_world, stop_);
  if (!link.ok() && link.status().code() != StatusCode::kCancelled)
    return {link.status().code(), "eval_world: " + link.status().message()};
  if (!link.ok()) return link.status();
  const Status fits = Actors::Of(Snapshots(), (*link)->spec()).status();
  return fits.ok() ? fits : Status{fits.code(), "eval_world " + Quote(config_.eval_world) + ": " + fits.message()};
}

// One that was stopped stays due: the run that goes on makes up for it before its first step.
void Training::EvaluateIfDue() {
  if (EvaluationDue() && !stop_.load(std::memory_order_relaxed)) {
    const Status status = Evaluation();
    const bool stopped = status.code() == StatusCode::kCancelled;
    if (!status.ok() && !stopped && evaluation_.ok() && !Over())  // once, until it works again
      report_->Line("warning: an evaluation failed: " + status.message() + "; training goes on");
    if (!stopped) {
      evaluation_ = status;
      PlanEvaluation();
    }
  }
  if (config_.eval_every == 0) LookAtEpisodes();
}

// kCancelled where `stop_` came before all episodes had ended.
Status Training::Evaluation() {
  EvaluateOptions options = EvaluationOptions();
  options.say = [this](const std::string& line) { report_->Line(line); };
  const Result<std::unique_ptr<WorldLink>> link = OpenToJudge(options, options.world, stop_);
  if (!link.ok()) return link.status();
  Result<Actors> actors = Actors::Of(Snapshots(), (*link)->spec());
  if (!actors.ok()) return actors.status();
  const auto meanwhile = [this] { crew_.KeepAlive(); };
  const Result<std::vector<EvaluateSummary>> judged = Judge(options, **link, *actors, stop_, meanwhile);
  if (!judged.ok()) return judged.status();
  const bool whole = std::all_of(judged->begin(), judged->end(), [this](const EvaluateSummary& summary) {
    return summary.episodes == config_.eval_episodes;
  });
  if (!whole && stop_.load(std::memory_order_relaxed)) return {StatusCode::kCancelled, "stopped while it was judged"};

  double sum = 0.0, lowest = std::numeric_limits<double>::infinity();  // of those that learn
  for (std::size_t b = 0; b < judged->size(); ++b) {
    if (trainees_[b].frozen) continue;
    sum += (*judged)[b].mean_reward;
    lowest = std::min(lowest, (*judged)[b].mean_reward);
  }
  const bool best = sum > best_evaluation_;
  report_->OnEvaluation(*judged, steps());
  if (!config_.quiet)
    report_->Line(fmt::format("evaluation after {} steps: {} over {} episodes{}", steps(), Words(*judged),
                              judged->front().episodes, best ? ", the best so far" : ""));
  if (goal_.has_value() && lowest >= *goal_) ReachGoal(Words(*judged));
  if (!best) return Status::Ok();
  const Status saved = SaveBest();
  if (!Over()) TellFailure("the best model", saved, &best_failed_);
  best_ = saved;
  if (saved.ok()) best_evaluation_ = sum;
  return Status::Ok();
}

// A place where no model can be kept is said before the training.
Status Training::CheckBestFolder() const {
  const std::string folder = directory_->File(kBestFolder);
  if (IsLink(folder))
    return {StatusCode::kDataLoss, "'" + folder + "' is a link and no folder of this run; take it away"};
  if (IsThere(folder) && !IsFolder(folder))
    return {StatusCode::kDataLoss, "'" + folder + "' is no folder; take it away"};
  for (const BehaviourSpec& behaviour : spec().behaviours)
    CONSAC_RETURN_IF_ERROR(CheckOwnFile(folder + "/" + ModelFileName(spec(), behaviour)));
  return Status::Ok();
}

Status Training::SaveBest() {
  CONSAC_RETURN_IF_ERROR(directory_->CheckOurs());
  CONSAC_RETURN_IF_ERROR(CheckBestFolder());
  const std::string folder = directory_->File(kBestFolder);
  std::error_code error;
  std::filesystem::create_directories(ToPath(folder), error);
  if (error) return {StatusCode::kDataLoss, "cannot make folder '" + folder + "': " + error.message()};
  return SaveModels(folder);
}

// Without evaluations: the window of Stable Baselines, once it is full, whenever an episode has ended.
void Training::LookAtEpisodes() {
  if (!goal_.has_value() || goal_reached_) return;
  std::int64_t ended = 0;
  for (std::size_t b = 0; b < trainees_.size(); ++b) ended += report_->episodes(b);
  if (std::exchange(episodes_looked_at_, ended) == ended) return;
  std::string means;
  for (std::size_t b = 0; b < trainees_.size(); ++b) {
    if (trainees_[b].frozen) continue;
    if (report_->episodes(b) < learn::kEpisodesOfMean || report_->mean_episode_reward(b) < *goal_) return;
    means += fmt::format("{}{:.4g}", means.empty() ? "" : ", ", report_->mean_episode_reward(b));
  }
  ReachGoal(means);
}

void Training::ReachGoal(const std::string& means) {
  goal_reached_ = true;
  if (config_.quiet) return;
  report_->Line(fmt::format("mean reward {} has reached stop_reward {}: the training ends after {} of {} steps", means,
                            config_.stop_reward, steps(), config_.steps));
}

// Weights of another run; what it does besides (optimiser, generators, steps) begins anew.
Status Training::StartFromModels() {
  if (config_.init_model.empty()) return Status::Ok();
  const Result<std::vector<std::string>> files = FindModels(config_.init_model, config_.directory);
  if (!files.ok()) return files.status();
  const Result<Actors> actors = Actors::Load(*files, spec());
  if (!actors.ok()) return actors.status();
  for (std::size_t b = 0; b < trainees_.size(); ++b) {
    const Status started = trainees_[b].learner->StartFrom(actors->policy(b).data());
    if (!started.ok())
      return {started.code(), "init_model: '" + actors->file(b) + "'" + " cannot be begun with: " + started.message()};
  }
  return Status::Ok();
}

}  // namespace consac::run
