#include "training_log.h"

#include <utility>

#include "consac/base/hooks.h"
#include "consac/learn/log/training_folder.h"

namespace consac::host {
TrainingLog::TrainingLog(learn::LogStyle style, const EnvSpec& spec) : style_(style), began_(Now()) {
  for (const BehaviourSpec& behaviour : spec.behaviours) {
    const auto slots = static_cast<std::size_t>(behaviour.slots);
    behaviours_.push_back({{style, behaviour.name, spec.behaviours.size() == 1, behaviour.slots},
                           {},
                           std::vector<double>(slots),
                           std::vector<std::int64_t>(slots)});
  }
}

Result<std::unique_ptr<TrainingLog>> TrainingLog::Open(const std::string& folder, std::string algorithm,
                                                       learn::LogStyle style, const EnvSpec& spec) {
  const Result<std::string> path = learn::MakeTrainingFolder(folder, std::move(algorithm));
  if (!path.ok()) return path.status();
  std::unique_ptr<TrainingLog> log(new TrainingLog(style, spec));
  Result<std::unique_ptr<learn::ProgressCsv>> csv = learn::ProgressCsv::Open(*path + "/progress.csv", {});
  if (!csv.ok()) return csv.status();
  log->csv_ = std::move(*csv);
  const double now = learn::WallTime();
  Result<std::unique_ptr<learn::EventWriter>> events =
      learn::EventWriter::Open(*path + "/" + learn::EventFileName(static_cast<std::int64_t>(now)), now);
  if (!events.ok()) return events.status();
  log->events_ = std::move(*events);
  return log;
}

// What ended behind the last report is in the events alone.
TrainingLog::~TrainingLog() {
  if (events_ == nullptr) return;
  Write();
  events_->Flush();
  SayFailure();
}

void TrainingLog::Note(std::span<const Statistic> noted) {
  const std::string left_out = game_.Add(noted);
  if (left_out.empty() || std::exchange(said_names_, true)) return;
  Log(LogLevel::kWarning, "the game notes more than " + std::to_string(learn::GameStatistics::kMostNames) +
                              " names; '" + left_out + "' and others are left out of the log");
}

void TrainingLog::Add(std::size_t b, const Batch& outcome, std::int64_t steps) {
  Told& told = behaviours_[b];
  for (std::size_t row = 0; row < outcome.slots.size(); ++row) {
    const auto slot = static_cast<std::size_t>(outcome.slots[row]);
    told.rewards[slot] += static_cast<double>(outcome.rewards[row]);
    ++told.lengths[slot];
    if ((outcome.terminated[row] | outcome.truncated[row]) == 0) continue;
    told.episodes.Add(told.rewards[slot], told.lengths[slot]);
    if (style_ == learn::LogStyle::kStableBaselines2)
      events_->Scalar(learn::WallTime(), steps, told.numbers.Key("episode_reward"), told.rewards[slot]);
    told.rewards[slot] = 0.0;
    told.lengths[slot] = 0;
  }
}

void TrainingLog::Look(std::size_t b, const learn::Learner& learner, std::int64_t steps) {
  Told& told = behaviours_[b];
  if (std::exchange(told.reports, learner.reports()) == learner.reports()) return;
  const learn::UpdateReport update{b, learner.metrics(), learner.updates(), learner.steps_per_update(),
                                   learner.reports()};
  const double now = learn::WallTime();
  if (row_.empty()) {
    row_.push_back({learn::StepsKey(style_), static_cast<double>(steps), learn::CellKind::kInteger});
    game_.Tell();
    for (const learn::Cell& cell : game_.row()) events_->Scalar(now, steps, cell.key, cell.value);
    row_.insert(row_.end(), game_.row().begin(), game_.row().end());
  }
  told.numbers.Make(update, {steps, Now() - began_}, told.episodes);
  told.numbers.WriteScalars(update, steps, now, *events_);
  row_.insert(row_.end(), told.numbers.row().begin(), told.numbers.row().end());
}

void TrainingLog::Write() {
  if (row_.empty()) return;
  learn::SortByKey(&row_);
  csv_->Append(row_);
  row_.clear();
  events_->Flush();
  SayFailure();
}

void TrainingLog::SayFailure() {
  const Status& failed = csv_->status().ok() ? events_->status() : csv_->status();
  if (failed.ok() || std::exchange(said_, true)) return;
  Log(LogLevel::kWarning, failed.message() + "; the training goes on, but this log has a gap");
}

}  // namespace consac::host
