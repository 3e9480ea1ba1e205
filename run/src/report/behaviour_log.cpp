#include "report/behaviour_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "consac/base/names.h"
#include "consac/run/training.h"

namespace consac::run {
namespace {

constexpr std::int64_t kFewestEpisodes = 20;  // that make a curve

}  // namespace

BehaviourLog::BehaviourLog(const ReportOptions& options, std::size_t b)
    : options_(options), behaviour_(options.behaviours[b]), alone_(options.behaviours.size() == 1) {
  for (const ReportedBehaviour& behaviour : options.behaviours) slots_of_all_ += behaviour.slots;
}

Status BehaviourLog::OpenFiles(double wall_time, OpenMode mode) {
  Result<std::unique_ptr<MonitorCsv>> monitor =
      MonitorCsv::Open(File("monitor.csv"), options_.world_id, wall_time, mode);
  if (!monitor.ok()) return monitor.status();
  monitor_csv_ = std::move(*monitor);
  return Status::Ok();
}

std::string BehaviourLog::File(const std::string& name) const {
  return options_.directory + "/" + (alone_ ? name : FileNameOf(behaviour_.name, "." + name));
}

// Kept here, so that a row outlives what the learner said, and a key that is known allocates nothing. A name may hold a
// comma or a slash; a key may not.
std::string_view BehaviourLog::Key(std::string_view key) {
  auto known = keys_.find(key);
  if (known == keys_.end())
    known = keys_.emplace(key, alone_ ? std::string(key) : fmt::format("{}/{}", FileNameOf(behaviour_.name, ""), key))
                .first;
  return known->second;
}

void BehaviourLog::OnEpisode(const EpisodeEnd& episode, double seconds, EventWriter* events, double wall_time) {
  episodes_.Add(episode.reward, episode.length);
  last_episode_step_ = episode.at_step;
  episode_curve_.Add(episode.at_step, episode.reward, episodes_.mean_reward());
  if (monitor_csv_ != nullptr) monitor_csv_->Append(episode.reward, episode.length, seconds);
  if (events != nullptr && IsSb2()) events->Scalar(wall_time, episode.at_step, Key("episode_reward"), episode.reward);
}

// Keys: Stable Baselines3, EvalCallback; the deviation and the count are ours. Success is told where the world tells
// it.
void BehaviourLog::OnEvaluation(const EvaluateSummary& verdict, std::int64_t steps, double wall_time,
                                EventWriter* events, Row* row) {
  const Cell cells[] = {{Key("eval/mean_reward"), verdict.mean_reward, CellKind::kDouble},
                        {Key("eval/std_reward"), verdict.std_reward, CellKind::kDouble},
                        {Key("eval/mean_ep_length"), verdict.mean_length, CellKind::kDouble},
                        {Key("eval/episodes"), static_cast<double>(verdict.episodes), CellKind::kInteger},
                        {Key("eval/success_rate"), verdict.success_rate, CellKind::kDouble}};
  std::span<const Cell> told = cells;
  if (std::isnan(verdict.success_rate)) told = told.first(told.size() - 1);
  row->insert(row->end(), told.begin(), told.end());
  for (const Cell& cell : told) {
    if (events != nullptr && cell.kind == CellKind::kDouble) events->Scalar(wall_time, steps, cell.key, cell.value);
  }
}

void BehaviourLog::OnUpdate(const UpdateReport& update, const Moment& now) {
  row_.clear();
  for (const learn::Metric& metric : update.metrics) {
    if (metric.table_key.empty()) continue;
    const bool count = metric.table_key == "train/n_updates";  // an int in Stable Baselines3
    Put(metric.table_key, metric.value,
        count                     ? CellKind::kInteger
        : metric.single_precision ? CellKind::kSingle
                                  : CellKind::kDouble);
  }
  if (IsSb2())
    FillSb2(update, now);
  else
    FillSb3(update, now);
  update_started_ = now.seconds;
  update_started_steps_ = now.steps;
}

// Source: Stable Baselines 2.10.2, ppo2.py: fps is of this update, time_elapsed is when this update started.
void BehaviourLog::FillSb2(const UpdateReport& update, const Moment& now) {
  const double seconds = std::max(now.seconds - update_started_, 1e-9);
  Put("fps", static_cast<double>(now.steps - update_started_steps_) / seconds, CellKind::kInteger);
  Put("n_updates", static_cast<double>(update.updates), CellKind::kInteger);
  Put("time_elapsed", update_started_, CellKind::kDouble);
  if (update.steps_per_update > 0) {
    const std::int64_t n_steps = update.steps_per_update / std::max(behaviour_.slots, 1);
    Put("serial_timesteps", static_cast<double>(update.updates) * static_cast<double>(n_steps), CellKind::kInteger);
  }
  if (episodes_.count() == 0) return;
  Put("ep_len_mean", episodes_.mean_length(), CellKind::kDouble);
  Put("ep_reward_mean", episodes_.mean_reward(), CellKind::kDouble);
}

// Source: Stable Baselines3, on_policy_algorithm.py: fps and time_elapsed are of the whole training.
void BehaviourLog::FillSb3(const UpdateReport& update, const Moment& now) {
  Put("time/fps", static_cast<double>(now.steps) / std::max(now.seconds, 1e-9), CellKind::kInteger);
  if (update.steps_per_update > 0) Put("time/iterations", static_cast<double>(update.updates), CellKind::kInteger);
  Put("time/time_elapsed", now.seconds, CellKind::kInteger);
  if (episodes_.count() == 0) return;
  Put("rollout/ep_len_mean", episodes_.mean_length(), CellKind::kDouble);
  Put("rollout/ep_rew_mean", episodes_.mean_reward(), CellKind::kDouble);
}

// Stable Baselines3 also writes the table's own numbers, but for those that are the axis or count it.
void BehaviourLog::WriteScalars(const UpdateReport& update, std::int64_t steps, double wall_time, EventWriter& events) {
  for (const learn::Metric& metric : update.metrics) {
    if (!metric.tensorboard_tag.empty()) events.Scalar(wall_time, steps, Key(metric.tensorboard_tag), metric.value);
  }
  if (IsSb2()) return;
  for (const char* key : {"rollout/ep_len_mean", "rollout/ep_rew_mean", "time/fps"}) {
    for (const Cell& cell : row_) {
      if (cell.key == Key(key)) events.Scalar(wall_time, steps, cell.key, cell.value);
    }
  }
}

// A trained agent may stay on the road for ever: its episodes tell of long ago, the reward of a step of now.
bool BehaviourLog::EpisodesStopped(std::int64_t steps) const {
  const double since = static_cast<double>(steps - last_episode_step_);
  const double usual = episodes_.mean_length() * std::max(slots_of_all_, 1);
  return episodes_.count() > 0 && since > 0.1 * static_cast<double>(steps) && since > 10.0 * usual;
}

RewardView BehaviourLog::Reward(std::int64_t steps) const {
  const bool per_step = EpisodesStopped(steps);
  return {alone_ ? std::string_view() : behaviour_.name, per_step ? step_curve_.RecentMean() : episodes_.mean_reward(),
          per_step};
}

Status BehaviourLog::Draw(std::int64_t steps) const {
  const bool per_step = episodes_.count() < kFewestEpisodes || EpisodesStopped(steps);
  const std::vector<CurvePoint> points = per_step ? step_curve_.Points() : episode_curve_.Points();
  const std::string_view what = per_step ? "mean reward of a step" : "mean reward of the last 100 episodes";
  CurveLabels labels;
  labels.last_step = static_cast<double>(steps);
  labels.title = options_.algorithm + " on " + options_.world_id + (alone_ ? "" : ": " + behaviour_.name);
  if (!points.empty()) labels.subtitle = fmt::format("{}: {:.4g}", what, points.back().mean);
  labels.y_axis = per_step ? "reward per step" : "episode reward";
  labels.points = per_step ? "some steps" : "an episode";
  labels.mean = per_step ? "moving mean" : "mean of 100";
  return DrawCurve(File("curve"), labels, points, options_.may_write);
}

void BehaviourLog::Visit(Archive& archive) {
  archive("update_started", update_started_);
  archive("update_started_steps", update_started_steps_);
  archive("last_episode_step", last_episode_step_);
  archive("episodes", episodes_);
  archive("episode_curve", episode_curve_);
  archive("step_curve", step_curve_);
  if (monitor_csv_ != nullptr) archive("monitor", *monitor_csv_);
}

}  // namespace consac::run
