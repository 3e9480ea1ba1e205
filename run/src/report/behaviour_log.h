#pragma once
// What a report tells of one behaviour: its episodes, the numbers of its updates, its learning curve. Where a run has
// several, whatever is written of one begins with its name and a slash: "hunter/ep_reward_mean"; alone, nothing does.

#include <memory>
#include <string>
#include <string_view>

#include "consac/learn/log/episode_means.h"
#include "consac/learn/log/tensorboard.h"
#include "consac/learn/log/update_row.h"
#include "consac/run/report.h"
#include "report/curve.h"
#include "report/curve_drawing.h"
#include "report/monitor_csv.h"
#include "report/progress.h"

namespace consac::run {

/// One behaviour's part of the report.
class BehaviourLog {
 public:
  /// Behaviour `b` of `options.behaviours`.
  BehaviourLog(const ReportOptions& options, std::size_t b);
  /// Opens its Monitor file.
  Status OpenFiles(double wall_time, learn::OpenMode mode);

  /// An episode ended, `seconds` after the training began. `events` may be null. Never allocates once warm.
  void OnEpisode(const EpisodeEnd& episode, double seconds, learn::EventWriter* events, double wall_time);
  /// Some of its agents took a step, `steps` steps into the run. Never allocates.
  void OnStep(std::int64_t steps, const BehaviourStep& step) { step_curve_.Add(steps, step.reward, step.agents); }
  /// Its learner has reported: row() is made anew.
  void OnUpdate(const UpdateReport& update, const learn::Moment& now) { numbers_.Make(update, now, episodes_); }
  /// The same numbers to TensorBoard.
  void WriteScalars(const UpdateReport& update, std::int64_t steps, double wall_time, learn::EventWriter& events) {
    numbers_.WriteScalars(update, steps, wall_time, events);
  }
  /// Its model was judged: adds the numbers to `row`, and to TensorBoard where `events` is not null.
  void OnEvaluation(const EvaluateSummary& verdict, std::int64_t steps, double wall_time, learn::EventWriter* events,
                    learn::Row* row);
  /// The numbers of its latest update under their keys, but for the steps of the run, which all behaviours share.
  const learn::Row& row() const { return numbers_.row(); }

  /// Mean reward and length of the last 100 episodes.
  const learn::EpisodeMeans& episodes() const { return episodes_; }
  /// What the progress line shows of it, `steps` steps into the run.
  RewardView Reward(std::int64_t steps) const;
  /// Draws curve.svg and curve.png.
  Status Draw(std::int64_t steps) const;
  /// Its Monitor file; null when none is written.
  MonitorCsv* monitor() { return monitor_csv_.get(); }
  /// Everything that a resumed run goes on with.
  void Visit(Archive& archive);

 private:
  bool IsSb2() const { return options_.style == learn::LogStyle::kStableBaselines2; }
  std::string File(const std::string& name) const;
  bool EpisodesStopped(std::int64_t steps) const;

  const ReportOptions& options_;
  const ReportedBehaviour& behaviour_;
  const bool alone_;
  std::int32_t slots_of_all_ = 0;  // agents of all behaviours
  std::unique_ptr<MonitorCsv> monitor_csv_;

  // Saved in checkpoints. Times are seconds of training.
  learn::EpisodeMeans episodes_;
  EpisodeCurve episode_curve_;
  StepCurve step_curve_;
  learn::UpdateRow numbers_;
  std::int64_t last_episode_step_ = 0;
};

}  // namespace consac::run
