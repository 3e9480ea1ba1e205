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
    : options_(options),
      behaviour_(options.behaviours[b]),
      alone_(options.behaviours.size() == 1),
      numbers_(options.style, behaviour_.name, alone_, behaviour_.slots) {
  for (const ReportedBehaviour& behaviour : options.behaviours) slots_of_all_ += behaviour.slots;
}

Status BehaviourLog::OpenFiles(double wall_time, learn::OpenMode mode) {
  Result<std::unique_ptr<MonitorCsv>> monitor =
      MonitorCsv::Open(File("monitor.csv"), options_.world_id, wall_time, mode);
  if (!monitor.ok()) return monitor.status();
  monitor_csv_ = std::move(*monitor);
  return Status::Ok();
}

std::string BehaviourLog::File(const std::string& name) const {
  return options_.directory + "/" + (alone_ ? name : FileNameOf(behaviour_.name, "." + name));
}

void BehaviourLog::OnEpisode(const EpisodeEnd& episode, double seconds, learn::EventWriter* events, double wall_time) {
  episodes_.Add(episode.reward, episode.length);
  last_episode_step_ = episode.at_step;
  episode_curve_.Add(episode.at_step, episode.reward, episodes_.mean_reward());
  if (monitor_csv_ != nullptr) monitor_csv_->Append(episode.reward, episode.length, seconds);
  if (events != nullptr && IsSb2())
    events->Scalar(wall_time, episode.at_step, numbers_.Key("episode_reward"), episode.reward);
}

// Keys: Stable Baselines3, EvalCallback; the deviation and the count are ours. Success is told where the world tells
// it.
void BehaviourLog::OnEvaluation(const EvaluateSummary& verdict, std::int64_t steps, double wall_time,
                                learn::EventWriter* events, learn::Row* row) {
  using learn::CellKind;
  const learn::Cell cells[] = {
      {numbers_.Key("eval/mean_reward"), verdict.mean_reward, CellKind::kDouble},
      {numbers_.Key("eval/std_reward"), verdict.std_reward, CellKind::kDouble},
      {numbers_.Key("eval/mean_ep_length"), verdict.mean_length, CellKind::kDouble},
      {numbers_.Key("eval/episodes"), static_cast<double>(verdict.episodes), CellKind::kInteger},
      {numbers_.Key("eval/success_rate"), verdict.success_rate, CellKind::kDouble}};
  std::span<const learn::Cell> told = cells;
  if (std::isnan(verdict.success_rate)) told = told.first(told.size() - 1);
  row->insert(row->end(), told.begin(), told.end());
  for (const learn::Cell& cell : told) {
    if (events != nullptr && cell.kind == CellKind::kDouble) events->Scalar(wall_time, steps, cell.key, cell.value);
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
  const std::string what = per_step ? "mean reward of a step"
                                    : fmt::format("mean reward of the last {} episodes",
                                                  std::min<std::int64_t>(episodes_.count(), learn::kEpisodesOfMean));
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
  numbers_.Visit(archive);
  archive("last_episode_step", last_episode_step_);
  archive("episodes", episodes_);
  archive("episode_curve", episode_curve_);
  archive("step_curve", step_curve_);
  if (monitor_csv_ != nullptr) archive("monitor", *monitor_csv_);
}

}  // namespace consac::run
