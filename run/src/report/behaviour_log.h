#pragma once
// What a report tells of one behaviour: its episodes, the numbers of its updates, its learning curve. Where a run has
// several, whatever is written of one begins with its name and a slash: "hunter/ep_reward_mean"; alone, nothing does.

#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "consac/run/report.h"
#include "report/curve.h"
#include "report/curve_drawing.h"
#include "report/episodes.h"
#include "report/monitor_csv.h"
#include "report/progress.h"
#include "report/row.h"
#include "report/tensorboard.h"

namespace consac::run {

/// Where a run is when one of its learners reports.
struct Moment {
  std::int64_t steps = 0;  ///< agent steps of all behaviours
  double seconds = 0.0;    ///< of training
};

/// One behaviour's part of the report.
class BehaviourLog {
 public:
  /// Behaviour `b` of `options.behaviours`.
  BehaviourLog(const ReportOptions& options, std::size_t b);
  /// Opens its Monitor file.
  Status OpenFiles(double wall_time, OpenMode mode);

  /// An episode ended, `seconds` after the training began. `events` may be null. Never allocates once warm.
  void OnEpisode(const EpisodeEnd& episode, double seconds, EventWriter* events, double wall_time);
  /// Some of its agents took a step, `steps` steps into the run. Never allocates.
  void OnStep(std::int64_t steps, const BehaviourStep& step) { step_curve_.Add(steps, step.reward, step.agents); }
  /// Its learner has reported: row() is made anew.
  void OnUpdate(const UpdateReport& update, const Moment& now);
  /// The same numbers to TensorBoard.
  void WriteScalars(const UpdateReport& update, std::int64_t steps, double wall_time, EventWriter& events);
  /// Its model was judged: adds the numbers to `row`, and to TensorBoard where `events` is not null.
  void OnEvaluation(const EvaluateSummary& verdict, std::int64_t steps, double wall_time, EventWriter* events,
                    Row* row);
  /// The numbers of its latest update under their keys, but for the steps of the run, which all behaviours share.
  const Row& row() const { return row_; }

  /// Mean reward and length of the last 100 episodes.
  const EpisodeWindow& episodes() const { return episodes_; }
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
  std::string_view Key(std::string_view key);
  void Put(std::string_view key, double value, CellKind kind) { row_.push_back({Key(key), value, kind}); }
  void FillSb2(const UpdateReport& update, const Moment& now);
  void FillSb3(const UpdateReport& update, const Moment& now);
  bool EpisodesStopped(std::int64_t steps) const;

  const ReportOptions& options_;
  const ReportedBehaviour& behaviour_;
  const bool alone_;
  std::int32_t slots_of_all_ = 0;                         // agents of all behaviours
  std::map<std::string, std::string, std::less<>> keys_;  // as the learner says them: as they are written
  std::unique_ptr<MonitorCsv> monitor_csv_;
  Row row_;

  // Saved in checkpoints. Times are seconds of training.
  EpisodeWindow episodes_;
  EpisodeCurve episode_curve_;
  StepCurve step_curve_;
  double update_started_ = 0.0;
  std::int64_t update_started_steps_ = 0, last_episode_step_ = 0;
};

}  // namespace consac::run
