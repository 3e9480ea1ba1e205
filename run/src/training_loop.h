#pragma once
// One run under way: stage, act, step, record, learn, report, checkpoint; the same for a world in this process and for
// an engine. Private to run.

#include <atomic>
#include <memory>
#include <vector>

#include "consac/env/buffer.h"
#include "consac/learn/algo/learner.h"
#include "consac/run/report.h"
#include "consac/run/run_directory.h"
#include "consac/run/thread_pool.h"
#include "consac/run/training.h"
#include "data_watch.h"
#include "episode_sums.h"
#include "link.h"

namespace consac::run {

/// What is learned for one behaviour.
struct Trainee {
  std::unique_ptr<learn::Learner> learner;
  BatchBuffer first;  // where first observations arrive
  EpisodeSums episodes;
  DataWatch watch;
  std::int64_t reported_updates = 0;
};

/// Who says how long the training is.
enum class Length : std::uint8_t { kOfCaller, kOfEngine };

/// One run under way.
class Training {
 public:
  /// `config` with name and steps known; `stop` must outlive this.
  Training(RunConfig config, Length length, const std::atomic<bool>& stop)
      : config_(std::move(config)), length_(length), stop_(stop), pool_(config_.threads) {}

  /// Makes learners for the world, opens the run's folder and logs, restores what --resume asks for.
  Status Start(std::unique_ptr<WorldLink> link);
  /// Trains until all steps are taken, `stop` is set or the world fails.
  Status Loop();
  /// Writes checkpoint, model and logs, whatever ended the loop.
  Result<RunSummary> Finish(double seconds);
  /// Where lines go.
  Report& report() { return *report_; }
  /// Agent steps that a round of learning needs.
  std::int64_t steps_per_update() const { return trainees_[0].learner->steps_per_update(); }
  /// As resolved.
  const RunConfig& config() const { return config_; }

 private:
  std::int64_t steps() const;
  std::string ModelPath(const std::string& behaviour) const;
  Status SaveModel();
  Status MakeLearners();
  std::int64_t ShareOfSteps(const BehaviourSpec& behaviour) const;
  Status Restore();
  Status OpenReport(bool resumed);
  Status WriteConfig() const;
  void LearnWhatIsDue();
  bool CheckpointDue() const;
  Status Checkpoint();
  std::string Description() const;
  void Visit(Archive& archive);

  RunConfig config_;
  const Length length_;
  const std::atomic<bool>& stop_;
  ThreadPool pool_;
  std::unique_ptr<WorldLink> link_;
  std::unique_ptr<RunDirectory> directory_;
  std::unique_ptr<Report> report_;
  std::vector<Trainee> trainees_;  // one per behaviour of the world, in its order
  std::int64_t slots_ = 0;         // agents of all behaviours
  std::vector<Batch> batches_;
  const learn::Algorithm* algorithm_ = nullptr;
  bool restored_ = false;  // from a checkpoint, be it of step 0
  std::int64_t restored_steps_ = 0, checkpoint_updates_ = 0;
  double checkpoint_time_ = 0.0;
  bool save_failed_ = false;
};

}  // namespace consac::run
