// A learner in this process drives the world. The engine's thread chooses actions and records what came of them, which
// takes microseconds; learning is a job of a thread of its own. Whoever has the learners is alone with them: the
// engine's thread, or the job.
#include <optional>

#include "consac/learn/algo/learner.h"
#include "consac/policy/policy.h"
#include "learning_thread.h"
#include "turn.h"

namespace consac::host {
namespace {

constexpr std::int64_t kPiece = 64;                                // gradient steps between looks at whether to stop
constexpr std::int64_t kMostLearnerBytes = std::int64_t{4} << 30;  // the engine needs memory too

/// One behaviour's learner, and the model that acts where the learner may not be asked.
struct Pupil {
  std::unique_ptr<learn::Learner> learner;
  std::optional<Policy> policy;   // of the latest update
  std::optional<Policy> learned;  // of the job that has just ended
  bool has_learned = false;       // the policy is of an update, not of the beginning
};

class TrainingDriver final : public Driver {
 public:
  TrainingDriver(TickWorld& world, const TrainOptions& options)
      : world_(world), turn_(world), options_(options), rng_(options.seed, StreamId("acting_while_learning")) {}

  /// The thread to learn on, and a learner for each behaviour.
  Status Begin() {
    CONSAC_RETURN_IF_ERROR(thread_.Start());
    const Result<const learn::Algorithm*> algorithm = learn::FindAlgorithm(options_.algorithm);
    if (!algorithm.ok()) return algorithm.status();
    learn::HyperparameterSet values((*algorithm)->hyperparameters);
    for (const auto& [name, text] : options_.hyperparameters) CONSAC_RETURN_IF_ERROR(values.Set(name, text));
    for (std::size_t b = 0; b < world_.spec().behaviours.size(); ++b) {
      learn::LearnerOptions options;
      options.behaviour = world_.spec().behaviours[b];
      options.seed = learn::BehaviourSeed(options_.seed, b);
      options.total_steps = ShareOfSteps(b);
      options.max_bytes = kMostLearnerBytes;
      Result<std::unique_ptr<learn::Learner>> learner = (*algorithm)->create(options, values);
      if (!learner.ok()) return learner.status();
      pupils_.push_back({std::move(*learner), std::nullopt, std::nullopt, false});
      CONSAC_RETURN_IF_ERROR(Learned(b));
    }
    TakeOverLearned();
    return Status::Ok();
  }

  Status Poll(double wait_s) override {
    if (!world_.settled()) return Status::Ok();
    const double began = Now();
    if (phase_ == Phase::kBegin) {
      turn_.Reset(options_.seed);
      phase_ = Phase::kFirst;
      return Status::Ok();
    }
    if (phase_ == Phase::kFirst)
      BeginEveryone();
    else if (phase_ == Phase::kRecord)
      Record();
    if (phase_ == Phase::kLearning && thread_.Done(Waits() ? wait_s : 0.0)) CONSAC_RETURN_IF_ERROR(EndLearning());
    if (phase_ == Phase::kLearning && Waits()) return Status::Ok();
    AskForStep();
    meter_.Note(world_.tally().steps, began);
    return Status::Ok();
  }

  bool finished() const override { return phase_ == Phase::kFinished && !failed_; }

  Progress progress() const override {
    Progress progress;
    progress.state = failed_                      ? "learning has failed; acting by the last model"
                     : phase_ == Phase::kFinished ? "trained; acting by the model"
                     : phase_ == Phase::kLearning ? "learning"
                                                  : "collecting";
    progress.tally = world_.tally();
    progress.steps = learned_from_;
    progress.total_steps = options_.total_steps;
    progress.updates = updates_;
    meter_.Tell(&progress);
    return progress;
  }

  bool learned(std::size_t b) const override { return b < pupils_.size() && pupils_[b].has_learned; }

  Result<ModelFile> Model(std::size_t b) const override {
    if (b >= pupils_.size()) return Driver::Model(b);
    if (phase_ == Phase::kLearning || failed_) return pupils_[b].policy->ToFile();
    Result<Policy> now = Policy::Create(pupils_[b].learner->Snapshot(), 1);
    if (!now.ok()) return now.status();
    return now->ToFile();
  }

 private:
  enum class Phase : std::uint8_t {
    kBegin,     // nothing was asked for yet
    kFirst,     // episodes begin
    kRecord,    // a step that is learned from is under way
    kLearning,  // the learners are the job's; steps that are under way meanwhile are not learned from
    kFinished,  // all steps are taken
  };

  bool Waits() const { return options_.while_learning == WhileLearning::kWait; }
  /// Only while the learners are this thread's.
  std::int64_t steps_learned_from() const {
    std::int64_t steps = 0;
    for (const Pupil& pupil : pupils_) steps += pupil.learner->steps();
    return steps;
  }
  /// Of total_steps, by the number of agents.
  std::int64_t ShareOfSteps(std::size_t b) const {
    const std::int64_t places = std::max(1, world_.places()), slots = world_.spec().behaviours[b].slots;
    return options_.total_steps / places * slots + options_.total_steps % places * slots / places;
  }

  void BeginEveryone() {
    for (std::size_t b = 0; b < pupils_.size(); ++b) {
      const Batch& first = turn_.First(b);
      if (first.rows() > 0) pupils_[b].learner->Begin(first);
    }
    phase_ = Phase::kRecord;
  }

  void Record() {
    bool due = false;
    for (std::size_t b = 0; b < pupils_.size(); ++b) {
      const Batch& outcome = turn_.Outcome(b);
      if (outcome.rows() > 0) pupils_[b].learner->Record(outcome);
      const Batch& arrived = turn_.Arrived(b);
      if (arrived.rows() > 0) pupils_[b].learner->Begin(arrived);
      due = due || pupils_[b].learner->LearningDue();
    }
    learned_from_ = steps_learned_from();
    if (due) {
      phase_ = Phase::kLearning;
      thread_.Begin([this] { Learn(); });
    } else if (learned_from_ >= options_.total_steps) {
      phase_ = Phase::kFinished;
    }
  }

  /// The job.
  void Learn() {
    for (std::size_t b = 0; b < pupils_.size(); ++b) {
      learn::Learner& learner = *pupils_[b].learner;
      while (learner.Learn({kPiece})) {
        if (thread_.stopping()) return;
      }
      if (health_.ok()) health_ = learner.health();
      const Status learned = Learned(b);
      if (health_.ok()) health_ = learned;
    }
  }

  Status Learned(std::size_t b) {
    Result<Policy> policy = Policy::Create(pupils_[b].learner->Snapshot(), world_.spec().behaviours[b].slots);
    if (!policy.ok()) return policy.status();
    pupils_[b].learned = std::move(*policy);
    return Status::Ok();
  }

  void TakeOverLearned() {
    for (Pupil& pupil : pupils_) {
      if (pupil.learned.has_value()) std::swap(pupil.policy, pupil.learned);
      pupil.learned.reset();
      pupil.has_learned = pupil.learner->updates() > 0;
    }
  }

  /// The learners are this thread's again. They go on from where the agents are now.
  Status EndLearning() {
    failed_ = !health_.ok();
    if (failed_) {
      phase_ = Phase::kFinished;
      return health_;
    }
    ++updates_;
    TakeOverLearned();
    phase_ = learned_from_ >= options_.total_steps ? Phase::kFinished : Phase::kRecord;
    for (std::size_t b = 0; b < pupils_.size() && !Waits(); ++b) {
      const Batch& here = turn_.First(b);
      if (here.rows() > 0) pupils_[b].learner->Begin(here);
    }
    return Status::Ok();
  }

  void AskForStep() {
    for (std::size_t b = 0; b < pupils_.size(); ++b) {
      Batch& batch = turn_.ToAct(b);
      if (batch.rows() == 0) continue;
      if (phase_ == Phase::kRecord) {
        pupils_[b].learner->Act(batch);
      } else {
        const ActionMode mode = phase_ == Phase::kFinished ? ActionMode::kDeterministic : ActionMode::kSample;
        pupils_[b].policy->Act(batch.observations, batch.action_masks, batch.rows(), mode, rng_, batch.actions);
      }
    }
    turn_.Step();
  }

  TickWorld& world_;
  Turn turn_;
  const TrainOptions options_;
  Rng rng_;
  std::vector<Pupil> pupils_;
  Phase phase_ = Phase::kBegin;
  Status health_;  // the job's, while one is under way
  bool failed_ = false;
  std::int64_t updates_ = 0, learned_from_ = 0;
  Meter meter_;
  LearningThread thread_;  // last: its job uses what is above
};

}  // namespace

Result<std::unique_ptr<Driver>> Train(TickWorld& world, const TrainOptions& options) {
  CONSAC_RETURN_IF_ERROR(world.EveryoneJoined());
  if (options.total_steps < 1) {
    return Status{StatusCode::kInvalidArgument,
                  "total_steps is " + std::to_string(options.total_steps) + "; give at least 1"};
  }
  auto driver = std::make_unique<TrainingDriver>(world, options);
  CONSAC_RETURN_IF_ERROR(driver->Begin());
  return std::unique_ptr<Driver>(std::move(driver));
}

}  // namespace consac::host
