// The one Report: keeps clocks and the episode window, and hands each event to the sinks, each a file of its own here.
#include "consac/run/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <utility>

#include "consac/learn/log/game_statistics.h"
#include "consac/learn/log/progress_csv.h"
#include "consac/run/training.h"
#include "report/behaviour_log.h"
#include "report/budget.h"
#include "report/console.h"
#include "report/console_table.h"
#include "report/progress.h"
#include "report/report_on.h"
#include "report/tensorboard_folder.h"

namespace consac::run {
namespace {

constexpr int kMostCallsPerLook = 64;                   // steps between looks at the clock
constexpr double kShortLook = 0.005, kLongLook = 0.05;  // s: look less often, look every step
constexpr double kFlushEvery = 1.0;                     // s
constexpr double kBudgetEvery = 15.0;                   // s
constexpr double kDrawAfterStop = 2.0;                  // s

class AllSinks final : public Report {
 public:
  AllSinks(const ReportOptions& options, const ConsoleOptions& console)
      : options_(options), console_(console), progress_(&console_) {
    for (std::size_t b = 0; b < options_.behaviours.size(); ++b) logs_.emplace_back(options_, b);
    shown_.resize(logs_.size(), 1);
    rewards_.resize(logs_.size());
    Begin(Now());
  }

  Status OpenFiles();
  void OnEpisode(const EpisodeEnd& episode) override;
  void OnUpdates(std::span<const UpdateReport> updates, std::int64_t steps) override;
  void OnStep(std::int64_t steps, std::span<const BehaviourStep> behaviours) override;
  void OnEvaluation(std::span<const EvaluateSummary> verdicts, std::int64_t steps) override;
  void OnStatistics(std::span<const Statistic> noted) override;
  void OnTime(const TimeSpent& rounds) override { budget_.Add(rounds, looked_); }
  void Line(std::string_view line) override { console_.Line(line); }
  Status Finish() override;
  void DrawCurves(const std::atomic<bool>& stop) override;
  double mean_episode_reward(std::size_t b) const override { return logs_[b].episodes().mean_reward(); }
  std::int64_t episodes(std::size_t b) const override { return logs_[b].episodes().count(); }
  double mean_episode_length(std::size_t b) const override { return logs_[b].episodes().mean_length(); }
  void Visit(Archive& archive) override;

 private:
  bool IsSb2() const { return options_.style == learn::LogStyle::kStableBaselines2; }
  const char* StepsKey() const { return learn::StepsKey(options_.style); }
  double Elapsed(double now) const { return elapsed_before_ + (now - session_start_); }
  void Begin(double now);
  void Look();
  void Flush();
  void SayFailures();
  learn::ProgressCsv::Resume Resumed() const { return {options_.append, StepsKey(), options_.resume_step}; }
  void GatherRow(const std::vector<std::uint8_t>& behaviours);
  void ShowTable(double now);
  bool Held() const { return std::find(shown_.begin(), shown_.end(), 0) != shown_.end(); }
  bool TableDue(double now) const { return !console_.terminal() || now - tabled_ >= options_.table_every_s; }
  void TellBudget();
  ProgressView View();

  const ReportOptions options_;
  Console console_;
  Progress progress_;
  std::deque<BehaviourLog> logs_;                     // one per behaviour; they stay where they are
  std::unique_ptr<learn::ProgressCsv> progress_csv_;  // null, like the next, when not written
  std::unique_ptr<learn::EventWriter> events_;
  std::unique_ptr<learn::ProgressCsv> evaluations_csv_;  // once there was one
  std::vector<Status> said_;  // failures to write that were reported: of these three, and of each Monitor file

  // Saved in checkpoints, as is what logs_ hold. Seconds of training, without the time between a kill and a resume.
  double elapsed_before_ = 0.0;  // in earlier sessions
  std::int64_t steps_ = 0;

  // Of this session.
  double session_start_ = 0.0, looked_ = 0.0, flushed_ = 0.0;
  bool stepped_ = false, over_ = false;
  int calls_per_look_ = 1, calls_left_ = 1;
  Budget budget_;
  learn::GameStatistics game_;
  bool said_names_ = false;
  double told_budget_ = 0.0;
  learn::Row row_;                     // as it is written
  std::int64_t updated_steps_ = 0;     // of the latest update
  std::vector<std::uint8_t> updated_;  // per behaviour: it has just reported
  std::vector<std::uint8_t> shown_;    // per behaviour: its latest numbers that are due were in a table
  double tabled_ = -std::numeric_limits<double>::infinity();  // when the latest table was shown
  std::vector<RewardView> rewards_;                           // per behaviour, as the progress line shows them
};

Status AllSinks::OpenFiles() {
  if (options_.directory.empty()) return Status::Ok();
  const learn::OpenMode mode = options_.append ? learn::OpenMode::kAppend : learn::OpenMode::kTruncate;
  const double now = learn::WallTime();

  Result<std::unique_ptr<learn::ProgressCsv>> csv =
      learn::ProgressCsv::Open(options_.directory + "/progress.csv", Resumed());
  if (!csv.ok()) return csv.status();
  progress_csv_ = std::move(*csv);
  for (BehaviourLog& log : logs_) CONSAC_RETURN_IF_ERROR(log.OpenFiles(now, mode));

  if (!options_.tensorboard) return Status::Ok();
  const Result<std::string> folder = TensorboardFolder(options_.directory + "/tensorboard", options_.algorithm, mode);
  if (!folder.ok()) return folder.status();
  Result<std::unique_ptr<learn::EventWriter>> events = OpenEvents(*folder, now);
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
  logs_[episode.behaviour].OnEpisode(episode, Elapsed(Now()), events_.get(), learn::WallTime());
}

void AllSinks::OnStatistics(std::span<const Statistic> noted) {
  const std::string left_out = game_.Add(noted);
  if (left_out.empty() || std::exchange(said_names_, true)) return;
  Line(fmt::format("warning: the game notes more than {} names; '{}' and others are left out",
                   learn::GameStatistics::kMostNames, left_out));
}

void AllSinks::OnStep(std::int64_t steps, std::span<const BehaviourStep> behaviours) {
  for (std::size_t b = 0; b < behaviours.size(); ++b) logs_[b].OnStep(steps, behaviours[b]);
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
  if (Held() && TableDue(now)) ShowTable(now);
  if (now - flushed_ < kFlushEvery) return;
  flushed_ = now;
  Flush();
}

void AllSinks::Flush() {
  for (BehaviourLog& log : logs_) {
    if (log.monitor() != nullptr) log.monitor()->Flush();
  }
  if (events_ != nullptr) events_->Flush();
  SayFailures();
}

void AllSinks::SayFailures() {
  const auto say = [this](std::size_t i, const Status& found) {
    if (found.ok() || !said_[i].ok()) return;
    said_[i] = found;
    console_.Alarm(said_[i].message() +
                   (over_ ? "; this log has a gap" : "; training goes on, but this log has a gap"));
  };
  said_.resize(3 + logs_.size());
  if (progress_csv_ != nullptr) say(0, progress_csv_->status());
  if (events_ != nullptr) say(1, events_->status());
  if (evaluations_csv_ != nullptr) say(2, evaluations_csv_->status());
  for (std::size_t b = 0; b < logs_.size(); ++b) {
    if (logs_[b].monitor() != nullptr) say(3 + b, logs_[b].monitor()->status());
  }
}

void AllSinks::OnUpdates(std::span<const UpdateReport> updates, std::int64_t steps) {
  steps_ = std::max(steps_, steps);
  updated_steps_ = steps;
  const double now = Now();
  const std::int64_t interval = std::max<std::int64_t>(options_.log_interval, 1);
  updated_.assign(logs_.size(), 0);
  for (const UpdateReport& update : updates) {
    BehaviourLog& log = logs_[update.behaviour];
    log.OnUpdate(update, {steps, Elapsed(now)});
    updated_[update.behaviour] = 1;
    if (update.reports % interval == 0 || (IsSb2() && update.reports == 1)) shown_[update.behaviour] = 0;
    if (events_ != nullptr) log.WriteScalars(update, steps, learn::WallTime(), *events_);
  }
  game_.Tell();
  for (const learn::Cell& cell : game_.row()) {
    if (events_ != nullptr) events_->Scalar(learn::WallTime(), steps, cell.key, cell.value);
  }
  if (progress_csv_ != nullptr) {
    GatherRow(updated_);
    progress_csv_->Append(row_);
  }
  if (!options_.console_table) shown_.assign(logs_.size(), 1);
  if (Held() && TableDue(now)) ShowTable(now);
  calls_left_ = 0;  // learning took its time
  SayFailures();
}

// The numbers of some behaviours beside each other, by key; those of the run come first.
void AllSinks::GatherRow(const std::vector<std::uint8_t>& behaviours) {
  row_.assign(1, {StepsKey(), static_cast<double>(updated_steps_), learn::CellKind::kInteger});
  for (std::size_t b = 0; b < logs_.size(); ++b) {
    if (behaviours[b] != 0) row_.insert(row_.end(), logs_[b].row().begin(), logs_[b].row().end());
  }
  row_.insert(row_.end(), game_.row().begin(), game_.row().end());
  learn::SortByKey(&row_);
}

// A file of its own, so that progress.csv stays a row for each update; it is there once something was evaluated.
void AllSinks::OnEvaluation(std::span<const EvaluateSummary> verdicts, std::int64_t steps) {
  learn::Row row = {{StepsKey(), static_cast<double>(steps), learn::CellKind::kInteger}};
  for (std::size_t b = 0; b < verdicts.size(); ++b)
    logs_[b].OnEvaluation(verdicts[b], steps, learn::WallTime(), events_.get(), &row);
  learn::SortByKey(&row);
  if (options_.directory.empty()) return;
  if (evaluations_csv_ == nullptr) {
    Result<std::unique_ptr<learn::ProgressCsv>> csv =
        learn::ProgressCsv::Open(options_.directory + "/evaluations.csv", Resumed());
    if (!csv.ok()) return console_.Alarm(csv.status().message() + "; training goes on, but evaluations have no log");
    evaluations_csv_ = std::move(*csv);
  }
  evaluations_csv_->Append(row);
  SayFailures();
}

// What was held back since the last one, the latest of each behaviour.
void AllSinks::ShowTable(double now) {
  for (std::uint8_t& shown : shown_) shown = shown != 0 ? 0 : 1;  // now: which are to be shown
  GatherRow(shown_);
  console_.Print(FormatTable(options_.style, row_));
  shown_.assign(logs_.size(), 1);
  tabled_ = now;
}

ProgressView AllSinks::View() {
  for (std::size_t b = 0; b < logs_.size(); ++b) rewards_[b] = logs_[b].Reward(steps_);
  return {steps_, options_.total_steps, 0.0, rewards_};
}

void AllSinks::TellBudget() {
  fmt::memory_buffer line;
  AppendBudget(budget_.recent(), options_.engine ? "engine" : "world", &line);
  if (line.size() > 0) Line({line.data(), line.size()});
}

Status AllSinks::Finish() {
  over_ = true;
  if (Held()) ShowTable(Now());
  if (options_.progress && stepped_) {
    progress_.Finish(Now(), View());
    TellBudget();
  }
  Flush();
  for (const Status& failure : said_) CONSAC_RETURN_IF_ERROR(failure);
  return Status::Ok();
}

// Of many behaviours that takes its time, which whoever has stopped the run does not have.
void AllSinks::DrawCurves(const std::atomic<bool>& stop) {
  if (options_.directory.empty()) return;
  double stopped = 0.0;
  for (std::size_t b = 0; b < logs_.size(); ++b) {
    if (stop.load(std::memory_order_relaxed) && stopped == 0.0) stopped = Now();
    if (stopped > 0.0 && Now() - stopped > kDrawAfterStop)
      return Line(fmt::format("stopped: {} of {} curves are drawn", b, logs_.size()));
    const Status drawn = logs_[b].Draw(steps_);
    if (!drawn.ok()) Line("warning: there is no curve: " + drawn.message());
  }
}

void AllSinks::Visit(Archive& archive) {
  const double now = Now();
  double elapsed = Elapsed(now);
  archive("elapsed", elapsed);
  archive("steps", steps_);
  for (std::size_t b = 0; b < logs_.size(); ++b) {
    if (logs_.size() == 1)
      logs_[b].Visit(archive);
    else
      archive("behaviour" + std::to_string(b), logs_[b]);
  }
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
  ConsoleOptions console = StandardConsole();
  if (options.quiet) {
    console.stream = stderr;
    console.terminal = console.colour = false;
  }
  console.hold_until = options.hold_until;
  return ReportOn(options, console);
}

}  // namespace consac::run
