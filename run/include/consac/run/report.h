#pragma once
// Everything a training run tells people and tools: console table, progress bar, progress.csv, Monitor CSV,
// TensorBoard events, the picture of the learning curve. The training loop calls it as things happen; each sink
// is a file of its own behind it.

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/file.h"
#include "consac/base/status.h"
#include "consac/env/vector_env.h"
#include "consac/learn/algo/learner.h"
#include "consac/learn/log/update_row.h"

namespace consac::run {

struct EvaluateSummary;  // training.h

/// A behaviour that is reported on.
struct ReportedBehaviour {
  std::string name = "default";  ///< begins its keys, tags and files where there are several
  std::int32_t slots = 1;        ///< its agents; serial_timesteps are steps of one
};

/// What a report shows and where it writes.
struct ReportOptions {
  std::string directory;  ///< the run's folder; "" writes no files
  FolderCheck may_write;  ///< asked before a picture is written into it, whose error is said; empty: always
  std::string world_id;   ///< for the Monitor's header
  std::string algorithm;  ///< "ppo2"; names the TensorBoard folder (PPO2_1, ...) as Stable Baselines does
  learn::LogStyle style = learn::LogStyle::kStableBaselines2;  ///< whose keys and layout
  std::int64_t total_steps = 0;                                ///< for the time left
  std::vector<ReportedBehaviour> behaviours{1};                ///< one or more, in the world's order
  std::int64_t log_interval = 1;                               ///< reports between tables
  bool console_table = true;                                   ///< print the table
  double table_every_s = 1.0;    ///< on a terminal: seconds between tables at least; 0: each is shown
  bool progress = true;          ///< bar on a terminal, a plain line every few seconds otherwise
  bool tensorboard = true;       ///< write event files
  bool engine = false;           ///< the world is an engine's, reached over a wire
  double hold_until = 0.0;       ///< until then [s, Now()] lines wait for what follows, or go with the report
  bool quiet = false;            ///< standard output is a script's: lines go to standard error
  bool append = false;           ///< a resumed run: go on in the files that exist
  std::int64_t resume_step = 0;  ///< with append: rows past this step, of a killed run, are dropped
};

/// An episode that has just ended.
struct EpisodeEnd {
  std::int32_t slot = 0;      ///< which agent
  double reward = 0.0;        ///< sum of the world's own rewards
  std::int64_t length = 0;    ///< steps
  std::int64_t at_step = 0;   ///< agent steps of the run so far
  std::size_t behaviour = 0;  ///< whose agent
};

/// What a step brought to the agents of one behaviour.
struct BehaviourStep {
  std::int64_t agents = 0;  ///< that took it
  double reward = 0.0;      ///< the sum of their rewards
};

/// What a learner tells.
using UpdateReport = learn::UpdateReport;

/// Seconds by what they were spent on, and what was done in them.
struct TimeSpent {
  double world = 0.0;            ///< waiting for the world, while it worked
  double wire = 0.0;             ///< waiting for the world, while it did not (a frame to come, a message on its way)
  double inference = 0.0;        ///< choosing actions
  double learning = 0.0;         ///< learning, while nothing else was waited for
  double other = 0.0;            ///< recording, logging, saving
  std::int64_t rounds = 0;       ///< steps of a whole world
  std::int64_t agent_steps = 0;  ///< steps of single agents

  double sum() const { return world + wire + inference + learning + other; }
  /// Adds `times` times the seconds of `round`, and what was done in it.
  void Add(const TimeSpent& round, double times = 1.0) {
    world += times * round.world;
    wire += times * round.wire;
    inference += times * round.inference;
    learning += times * round.learning;
    other += times * round.other;
    rounds += round.rounds;
    agent_steps += round.agent_steps;
  }
};

/// All sinks of one run. Failing to write (disk full) is reported once, loudly, and never stops the training.
class Report {
 public:
  /// Opens the files; the error names the one that cannot be opened.
  static Result<std::unique_ptr<Report>> Open(const ReportOptions& options);
  virtual ~Report() = default;
  /// An episode ended. Never allocates once warm.
  virtual void OnEpisode(const EpisodeEnd& episode) = 0;
  /// Learners have finished updates, `steps` agent steps into the run: each behaviour at most once.
  virtual void OnUpdates(std::span<const UpdateReport> updates, std::int64_t steps) = 0;
  /// Cheap; call every step with the agent steps so far and what the step brought to each behaviour: refreshes the
  /// progress bar at most ten times a second, and feeds the curve of worlds whose episodes do not end.
  virtual void OnStep(std::int64_t steps, std::span<const BehaviourStep> behaviours) = 0;
  /// Numbers that the game has noted; the mean of each since its latest report stands beside the numbers of the next
  /// update, as "game/NAME". Those of a new name beyond 256 are left out.
  virtual void OnStatistics(std::span<const Statistic> noted) = 0;
  /// What rounds have taken since it was last told, one or several; told now and then as the budget of a step.
  virtual void OnTime(const TimeSpent& rounds) = 0;
  /// The models of now were judged, `steps` agent steps into the run: one verdict per behaviour, in the world's order.
  virtual void OnEvaluation(std::span<const EvaluateSummary> verdicts, std::int64_t steps) = 0;
  /// Prints a line without breaking the bar.
  virtual void Line(std::string_view line) = 0;
  /// Writes everything out and shows the latest table if it was held back.
  virtual Status Finish() = 0;
  /// Draws curve.svg and curve.png of the mean episode reward of each behaviour; a line says where that cannot be done.
  /// Once `stop` is set what is not drawn within two seconds is left out, and a line says so.
  virtual void DrawCurves(const std::atomic<bool>& stop) = 0;
  /// Mean reward of the last 100 episodes of a behaviour; NaN before the first.
  virtual double mean_episode_reward(std::size_t behaviour) const = 0;
  /// Episodes of a behaviour that have ended.
  virtual std::int64_t episodes(std::size_t behaviour) const = 0;
  /// Mean length of the last 100 episodes of a behaviour; NaN before the first.
  virtual double mean_episode_length(std::size_t behaviour) const = 0;
  /// Episode window and clocks, for exact resume of the numbers shown.
  virtual void Visit(Archive& archive) = 0;
};

}  // namespace consac::run
