#pragma once
// One run under way: stage, act, step, record, learn, report, checkpoint; the same for a world in this process and for
// an engine. Private to run.

#include <atomic>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "consac/base/refusals.h"
#include "consac/learn/algo/learn_pieces.h"
#include "consac/learn/algo/learner.h"
#include "consac/run/report.h"
#include "consac/run/run_directory.h"
#include "consac/run/shortage.h"
#include "consac/run/thread_pool.h"
#include "consac/run/training.h"
#include "crew.h"
#include "round_clock.h"
#include "trainee.h"

namespace consac::run {

/// Who says how long the training is.
enum class Length : std::uint8_t { kOfCaller, kOfEngine };

/// What a run of this configuration does with a run of its name.
inline ExistingRun ExistingRunOf(const RunConfig& config) {
  return config.resume ? ExistingRun::kResume : config.force ? ExistingRun::kOverwrite : ExistingRun::kRefuse;
}

/// Whether what could not be saved is told of: at a run's end its last word does.
enum class Telling : std::uint8_t { kNow, kAtTheEnd };

/// What is said where `config` relabels goals and `world` cannot price them.
Status CannotPrice(const RunConfig& config, const learn::Algorithm& algorithm, const std::string& world);

/// A world of a run, and how it is reached again.
struct WorldSource {
  std::unique_ptr<WorldLink> link;
  Worker::Connect connect;  ///< null: cannot be done
};

/// One run under way.
class Training {
 public:
  /// `config` with name and steps known; `stop` must outlive this.
  Training(RunConfig config, Length length, const std::atomic<bool>& stop)
      : config_(std::move(config)), length_(length), stop_(stop), pool_(config_.threads) {}

  /// Makes learners for the worlds, which must offer the same behaviours, opens the run's folder and logs, restores
  /// what --resume asks for.
  Status Start(std::vector<WorldSource> worlds);
  /// Whether a run that is to be overwritten is still there: until this one's first step.
  bool replaces() const { return directory_ != nullptr && directory_->replaces(); }
  /// Where the first step was not come to, for `why`: puts a run back that was to be overwritten. Says so behind `why`.
  Status GiveUp(const Status& why);
  /// Trains until all steps are taken, `stop` is set or the last world fails.
  Status Loop();
  /// Agents of all behaviours in all worlds: so many steps are taken at once.
  std::int64_t slots() const { return slots_; }
  /// Writes checkpoint, models and logs, whatever ended the loop.
  Result<RunSummary> Finish(double seconds);
  /// Where lines go.
  Report& report() { return *report_; }
  /// Agent steps of one behaviour that a round of learning needs.
  std::int64_t steps_per_update() const;
  /// Bytes that what the learners remember takes once full.
  std::int64_t memory_bytes() const;
  /// As resolved.
  const RunConfig& config() const { return config_; }

 private:
  std::int64_t steps() const;
  std::string ModelPath(const BehaviourSpec& behaviour) const;
  Status SaveModels(const std::string& folder) const;
  Status SaveModel(PolicyData data, const std::string& folder, const BehaviourSpec& behaviour) const;
  Status LoadDemonstration();
  Status MakeLearners();
  WorldLink* WithoutPrices();
  Status PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards);
  learn::LearnerOptions OptionsFor(std::size_t b, const BehaviourSpec& behaviour);
  std::int64_t ShareOfSteps(std::int64_t slots) const;
  Status Restore();
  Status OpenReport(bool resumed);
  Status WriteConfig() const;
  Status AddWorkers(std::vector<WorldSource> worlds);
  const EnvSpec& spec() const { return spec_; }
  std::size_t steps_under_way() const { return crew_.under_way() - connecting_; }
  bool Overlaps() const { return IsUrl(config_.world) && !config_.lockstep; }
  bool LearningDue() const;
  bool LearnedNothing() const;
  Status ResetWorlds();
  Status BeginWorlds();
  void Send(std::size_t worker, Where where);
  void SendIdle();
  Status Handle(const Crew::Outcome& outcome);
  Status Take(Worker& worker);
  Status Lose(const Crew::Outcome& outcome);
  Status LearnAndGoOn(std::size_t worker);
  void LearnRound(learn::Learner& learner, learn::LearnPieces& pieces) const;
  Status LearnWithoutWorld();
  Status AfterRound();
  void LearnWhatIsDue();
  void ReportUpdates();
  void AccountFor(const Crew::Outcome& outcome);
  void TellTime();
  void PlanEvaluation();
  Status CheckEvaluation();
  bool EvaluationDue() const { return config_.eval_every > 0 && steps() >= next_evaluation_; }
  void EvaluateIfDue();
  EvaluateOptions EvaluationOptions();
  Status Evaluation();
  Status CheckBestFolder() const;
  Status SaveBest();
  void LookAtEpisodes();
  void ReachGoal(const std::string& means);
  Status StartFromModels();
  std::vector<PolicyData> Snapshots() const;
  bool CheckpointDue() const;
  Status Save(Telling telling);
  void TellFailure(const std::string& what, const Status& status, bool* told);
  void Tell(std::string_view line);
  Status SaveBeginning();
  void KeepReplacedModels() const;
  bool Over() const { return goal_reached_ || steps() >= config_.steps; }
  Status Checkpoint();
  std::string Description() const;
  std::string Identity() const;
  Status CheckIdentity(const StateMap& state) const;
  std::string Offer() const;
  Status CheckOffer(const StateMap& state);
  void VisitLearners(Archive& archive);
  void Visit(Archive& archive);
  std::size_t LargestCheckpoint();
  Status CannotResume(const Status& why) const;
  Status CheckSteps() const;
  Status CheckMoreToTrain() const;
  std::size_t SavingBytes();
  Status CheckCheckpointFits();

  RunConfig config_;
  const Length length_;
  const std::atomic<bool>& stop_;
  ThreadPool pool_;
  std::unique_ptr<MemoryReserve> reserve_;  // what saving takes
  std::unique_ptr<RunDirectory> directory_;
  std::unique_ptr<Report> report_;
  // One of several engines may come and go at every step.
  Refusals losses_{[this](std::string_view line) { Tell(line); }},
      returns_{[this](std::string_view line) { Tell(line); }};
  std::optional<Demonstration> demonstration_;
  std::vector<Trainee> trainees_;  // one per behaviour of the world, in its order
  EnvSpec spec_;                   // of the first world, which the others equal but for their number of environments
  Crew crew_;
  std::vector<std::uint8_t> lost_;      // per worker: it has no connection
  std::size_t connecting_ = 0;          // workers that are trying to get one
  std::int64_t slots_ = 0;              // agents of all behaviours
  std::int64_t done_ = 0, asked_ = 0;   // agent steps recorded; these and those under way
  std::vector<UpdateReport> updates_;   // that are being told of
  std::vector<BehaviourStep> brought_;  // by the latest step
  std::vector<Statistic> noted_;        // by the game, in the latest step
  RoundClock clock_;
  const learn::Algorithm* algorithm_ = nullptr;
  learn::LogStyle log_style_ = learn::LogStyle::kStableBaselines2;
  bool restored_ = false;  // from a checkpoint, be it of step 0
  std::int64_t restored_steps_ = 0;
  std::int64_t next_evaluation_ = 0;                                   // steps at which it is due
  double best_evaluation_ = -std::numeric_limits<double>::infinity();  // mean reward, summed over behaviours
  std::optional<double> goal_;                                         // config_.stop_reward
  bool goal_reached_ = false;
  double reached_goal_ = -std::numeric_limits<double>::infinity();  // the highest that has ended this run
  std::int64_t episodes_looked_at_ = 0;  // of all behaviours, when their mean was last compared with it
  double checkpoint_time_ = 0.0, saving_seconds_ = 0.0;
  bool checkpoint_failed_ = false, model_failed_ = false, best_failed_ = false;
  Status evaluation_, best_;  // what became of the latest evaluation, and of the latest model that was to be kept
};

}  // namespace consac::run
