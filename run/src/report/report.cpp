// The one Report: keeps clocks and the episode window, and hands each event to the sinks, each a file of its own here.
#include "consac/run/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "report/budget.h"
#include "report/console.h"
#include "report/console_table.h"
#include "report/curve.h"
#include "report/curve_drawing.h"
#include "report/episodes.h"
#include "report/monitor_csv.h"
#include "report/progress.h"
#include "report/progress_csv.h"
#include "report/report_on.h"
#include "report/tensorboard.h"

namespace consac::run {
namespace {

constexpr int kMostCallsPerLook = 64;                   // steps between looks at the clock
constexpr double kShortLook = 0.005, kLongLook = 0.05;  // s: look less often, look every step
constexpr std::int64_t kFewestEpisodes = 20;            // that make a curve
constexpr double kFlushEvery = 1.0;                     // s
constexpr double kBudgetEvery = 15.0;                   // s

double WallTime() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

class AllSinks final : public Report {
 public:
  AllSinks(const ReportOptions& options, const ConsoleOptions& console)
      : options_(options), console_(console), progress_(&console_) {
    Begin(Now());
  }

  Status OpenFiles();
  void OnEpisode(const EpisodeEnd& episode) override;
  void OnUpdate(std::span<const learn::Metric> metrics, std::int64_t steps, std::int64_t updates,
                std::int64_t steps_per_update) override;
  void OnStep(std::int64_t steps, double reward_sum) override;
  void OnTime(const TimeSpent& round) override { budget_.Add(round, looked_); }
  void Line(std::string_view line) override { console_.Print(std::string(line) + "\n"); }
  Status Finish() override;
  double mean_episode_reward() const override { return episodes_.mean_reward(); }
  double mean_episode_length() const override { return episodes_.mean_length(); }
  void Visit(Archive& archive) override;

 private:
  bool IsSb2() const { return options_.style == learn::LogStyle::kStableBaselines2; }
  double Elapsed(double now) const { return elapsed_before_ + (now - session_start_); }
  void Begin(double now);
  void Look();
  void Flush();
  void SayFailures();
  void FillRow(std::span<const learn::Metric> metrics, std::int64_t steps, std::int64_t updates,
               std::int64_t steps_per_update);
  void FillSb2(std::int64_t steps, std::int64_t updates, std::int64_t steps_per_update);
  void FillSb3(std::int64_t steps, std::int64_t updates);
  void WriteScalars(std::span<const learn::Metric> metrics, std::int64_t steps);
  bool EpisodesStopped() const;
  void TellBudget();
  ProgressView View() const;
  Status Draw() const;

  const ReportOptions options_;
  Console console_;
  Progress progress_;
  std::unique_ptr<ProgressCsv> progress_csv_;  // null, like the next two, when not written
  std::unique_ptr<MonitorCsv> monitor_csv_;
  std::unique_ptr<EventWriter> events_;
  Status said_[3];  // failures of these three that were reported

  // Saved in checkpoints. Times are seconds of training, without the time between a kill and a resume.
  EpisodeWindow episodes_;
  EpisodeCurve episode_curve_;
  StepCurve step_curve_;
  double elapsed_before_ = 0.0;  // in earlier sessions
  double update_started_ = 0.0;
  std::int64_t steps_ = 0, update_started_steps_ = 0, last_episode_step_ = 0;

  // Of this session.
  double session_start_ = 0.0, looked_ = 0.0, flushed_ = 0.0;
  bool stepped_ = false;
  int calls_per_look_ = 1, calls_left_ = 1;
  Budget budget_;
  double told_budget_ = 0.0;
  Row row_;
};

Status AllSinks::OpenFiles() {
  if (options_.directory.empty()) return Status::Ok();
  const OpenMode mode = options_.append ? OpenMode::kAppend : OpenMode::kTruncate;
  const double now = WallTime();

  const ProgressCsv::Resume resume{options_.append, IsSb2() ? "total_timesteps" : "time/total_timesteps",
                                   options_.resume_step};
  Result<std::unique_ptr<ProgressCsv>> csv = ProgressCsv::Open(options_.directory + "/progress.csv", resume);
  if (!csv.ok()) return csv.status();
  progress_csv_ = std::move(*csv);

  Result<std::unique_ptr<MonitorCsv>> monitor =
      MonitorCsv::Open(options_.directory + "/monitor.csv", options_.world_id, now, mode);
  if (!monitor.ok()) return monitor.status();
  monitor_csv_ = std::move(*monitor);

  if (!options_.tensorboard) return Status::Ok();
  const Result<std::string> folder = TensorboardFolder(options_.directory + "/tensorboard", options_.algorithm, mode);
  if (!folder.ok()) return folder.status();
  Result<std::unique_ptr<EventWriter>> events = EventWriter::Open(*folder, now);
  if (!events.ok()) return events.status();
  events_ = std::move(*events);
  if (options_.append) events_->Restart(now, options_.resume_step + 1);
  return Status::Ok();
}

// The clocks start at the first step: what went before (waiting for an engine) is no training.
void AllSinks::Begin(double now) {
  session_start_ = looked_ = flushed_ = told_budget_ = now;
  progress_.Start(now, steps_);
}

void AllSinks::OnEpisode(const EpisodeEnd& episode) {
  episodes_.Add(episode.reward, episode.length);
  last_episode_step_ = episode.at_step;
  episode_curve_.Add(episode.at_step, episode.reward, episodes_.mean_reward());
  if (monitor_csv_ != nullptr) monitor_csv_->Append(episode.reward, episode.length, Elapsed(Now()));
  if (events_ != nullptr && IsSb2()) events_->Scalar(WallTime(), episode.at_step, "episode_reward", episode.reward);
}

void AllSinks::OnStep(std::int64_t steps, double reward_sum) {
  step_curve_.Add(steps, reward_sum, steps - steps_);
  if (!stepped_) Begin(Now());
  stepped_ = true;
  steps_ = steps;
  if (--calls_left_ < 0) Look();
}

// Looks at the clock: after every step of a slow engine, after every 64th of a fast world.
void AllSinks::Look() {
  const double now = Now(), passed = now - looked_;
  looked_ = now;
  if (passed > kLongLook) calls_per_look_ = 1;
  if (passed < kShortLook) calls_per_look_ = std::min(2 * calls_per_look_, kMostCallsPerLook);
  calls_left_ = calls_per_look_ - 1;
  if (options_.progress && progress_.Due(now)) progress_.Draw(now, View());
  if (options_.progress && now - told_budget_ >= kBudgetEvery) {
    told_budget_ = now;
    TellBudget();
  }
  if (now - flushed_ < kFlushEvery) return;
  flushed_ = now;
  Flush();
}

void AllSinks::Flush() {
  if (monitor_csv_ != nullptr) monitor_csv_->Flush();
  if (events_ != nullptr) events_->Flush();
  SayFailures();
}

void AllSinks::SayFailures() {
  const Status ok;
  const Status* found[] = {progress_csv_ ? &progress_csv_->status() : &ok, monitor_csv_ ? &monitor_csv_->status() : &ok,
                           events_ ? &events_->status() : &ok};
  for (std::size_t i = 0; i < std::size(found); ++i) {
    if (found[i]->ok() || !said_[i].ok()) continue;
    said_[i] = *found[i];
    console_.Alarm(said_[i].message() + "; training goes on, but this log has a gap");
  }
}

void AllSinks::OnUpdate(std::span<const learn::Metric> metrics, std::int64_t steps, std::int64_t updates,
                        std::int64_t steps_per_update) {
  steps_ = std::max(steps_, steps);
  FillRow(metrics, steps, updates, steps_per_update);
  if (progress_csv_ != nullptr) progress_csv_->Append(row_);
  if (events_ != nullptr) WriteScalars(metrics, steps);
  const std::int64_t interval = std::max<std::int64_t>(options_.log_interval, 1);
  const bool due = updates % interval == 0 || (IsSb2() && updates == 1);
  if (options_.console_table && due) console_.Print(FormatTable(options_.style, row_));
  update_started_ = Elapsed(Now());
  update_started_steps_ = steps;
  calls_left_ = 0;  // learning took its time
  SayFailures();
}

void AllSinks::FillRow(std::span<const learn::Metric> metrics, std::int64_t steps, std::int64_t updates,
                       std::int64_t steps_per_update) {
  row_.clear();
  for (const learn::Metric& metric : metrics) {
    if (metric.table_key.empty()) continue;
    const bool count = metric.table_key == "train/n_updates";  // an int in Stable Baselines3
    row_.push_back({metric.table_key, metric.value,
                    count                     ? CellKind::kInteger
                    : metric.single_precision ? CellKind::kSingle
                                              : CellKind::kDouble});
  }
  if (IsSb2()) {
    FillSb2(steps, updates, steps_per_update);
  } else {
    FillSb3(steps, updates);
  }
  std::sort(row_.begin(), row_.end(), [](const Cell& a, const Cell& b) { return a.key < b.key; });
}

// Source: Stable Baselines 2.10.2, ppo2.py: fps is of this update, time_elapsed is when this update started.
void AllSinks::FillSb2(std::int64_t steps, std::int64_t updates, std::int64_t steps_per_update) {
  const double seconds = std::max(Elapsed(Now()) - update_started_, 1e-9);
  row_.push_back({"fps", static_cast<double>(steps - update_started_steps_) / seconds, CellKind::kInteger});
  row_.push_back({"n_updates", static_cast<double>(updates), CellKind::kInteger});
  row_.push_back({"time_elapsed", update_started_, CellKind::kDouble});
  row_.push_back({"total_timesteps", static_cast<double>(steps), CellKind::kInteger});
  if (steps_per_update > 0) {
    const std::int64_t n_steps = steps_per_update / std::max(options_.slots, 1);
    row_.push_back({"serial_timesteps", static_cast<double>(updates * n_steps), CellKind::kInteger});
  }
  if (episodes_.count() == 0) return;
  row_.push_back({"ep_len_mean", episodes_.mean_length(), CellKind::kDouble});
  row_.push_back({"ep_reward_mean", episodes_.mean_reward(), CellKind::kDouble});
}

// Source: Stable Baselines3, on_policy_algorithm.py: fps and time_elapsed are of the whole training.
void AllSinks::FillSb3(std::int64_t steps, std::int64_t updates) {
  const double seconds = Elapsed(Now());
  row_.push_back({"time/fps", static_cast<double>(steps) / std::max(seconds, 1e-9), CellKind::kInteger});
  row_.push_back({"time/iterations", static_cast<double>(updates), CellKind::kInteger});
  row_.push_back({"time/time_elapsed", seconds, CellKind::kInteger});
  row_.push_back({"time/total_timesteps", static_cast<double>(steps), CellKind::kInteger});
  if (episodes_.count() == 0) return;
  row_.push_back({"rollout/ep_len_mean", episodes_.mean_length(), CellKind::kDouble});
  row_.push_back({"rollout/ep_rew_mean", episodes_.mean_reward(), CellKind::kDouble});
}

// Stable Baselines3 also writes the table's own numbers, but for those that are the axis or count it.
void AllSinks::WriteScalars(std::span<const learn::Metric> metrics, std::int64_t steps) {
  const double now = WallTime();
  for (const learn::Metric& metric : metrics) {
    if (!metric.tensorboard_tag.empty()) events_->Scalar(now, steps, metric.tensorboard_tag, metric.value);
  }
  if (IsSb2()) return;
  for (const Cell& cell : row_) {
    if (cell.key.starts_with("rollout/") || cell.key == "time/fps") events_->Scalar(now, steps, cell.key, cell.value);
  }
}

// A trained agent may stay on the road for ever: its episodes tell of long ago, the reward of a step of now.
bool AllSinks::EpisodesStopped() const {
  const double since = static_cast<double>(steps_ - last_episode_step_);
  const double usual = episodes_.mean_length() * std::max(options_.slots, 1);
  return episodes_.count() > 0 && since > 0.1 * static_cast<double>(steps_) && since > 10.0 * usual;
}

ProgressView AllSinks::View() const {
  ProgressView view;
  view.steps = steps_;
  view.total_steps = options_.total_steps;
  view.reward_per_step = EpisodesStopped();
  view.reward = view.reward_per_step ? step_curve_.RecentMean() : episodes_.mean_reward();
  return view;
}

void AllSinks::TellBudget() {
  fmt::memory_buffer line;
  AppendBudget(budget_.recent(), options_.engine ? "engine" : "world", &line);
  if (line.size() > 0) Line({line.data(), line.size()});
}

Status AllSinks::Draw() const {
  const bool per_step = episodes_.count() < kFewestEpisodes || EpisodesStopped();
  const std::vector<CurvePoint> points = per_step ? step_curve_.Points() : episode_curve_.Points();
  const std::string_view what = per_step ? "mean reward of a step" : "mean reward of the last 100 episodes";
  CurveLabels labels;
  labels.last_step = static_cast<double>(steps_);
  labels.title = options_.algorithm + " on " + options_.world_id;
  if (!points.empty()) labels.subtitle = fmt::format("{}: {:.4g}", what, points.back().mean);
  labels.y_axis = per_step ? "reward per step" : "episode reward";
  labels.points = per_step ? "some steps" : "an episode";
  labels.mean = per_step ? "moving mean" : "mean of 100";
  return DrawCurve(options_.directory + "/curve", labels, points);
}

Status AllSinks::Finish() {
  if (options_.progress && stepped_) {
    progress_.Finish(Now(), View());
    TellBudget();
  }
  Flush();
  if (options_.directory.empty()) return Status::Ok();
  const Status drawn = Draw();
  for (const Status& failure : said_) CONSAC_RETURN_IF_ERROR(failure);
  return drawn;
}

void AllSinks::Visit(Archive& archive) {
  const double now = Now();
  double elapsed = Elapsed(now);
  archive("elapsed", elapsed);
  archive("update_started", update_started_);
  archive("update_started_steps", update_started_steps_);
  archive("steps", steps_);
  archive("last_episode_step", last_episode_step_);
  archive("episodes", episodes_);
  archive("episode_curve", episode_curve_);
  archive("step_curve", step_curve_);
  if (monitor_csv_ != nullptr) archive("monitor", *monitor_csv_);
  if (!archive.loading()) return Flush();
  elapsed_before_ = elapsed;
  Begin(now);
}

}  // namespace

Result<std::unique_ptr<Report>> ReportOn(const ReportOptions& options, const ConsoleOptions& console) {
  auto report = std::make_unique<AllSinks>(options, console);
  CONSAC_RETURN_IF_ERROR(report->OpenFiles());
  return std::unique_ptr<Report>(std::move(report));
}

Result<std::unique_ptr<Report>> Report::Open(const ReportOptions& options) {
  return ReportOn(options, StandardConsole());
}

}  // namespace consac::run
