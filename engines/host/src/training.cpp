// A learner in this process drives the world. The engine's thread chooses actions and records what came of them, which
// takes microseconds; learning is a job of a thread of its own. Learners of rounds (ppo, a2c) are the job's for a whole
// round. Those that learn at every step (dqn) are shared: the job has them for one gradient step at a time, and where
// the engine waits for it anyway and it is short, the engine's thread learns at once and hands nothing over; where only
// that thread may say what other goals would have paid, it learns a gradient step at least in every Poll, and all of
// it.
#include <algorithm>
#include <optional>
#include <utility>

#include "consac/base/hooks.h"
#include "consac/env/parameter_laws.h"
#include "consac/learn/algo/learn_pieces.h"
#include "consac/learn/algo/learner.h"
#include "consac/policy/policy.h"
#include "consac/policy/training_facts.h"
#include "learning_thread.h"
#include "training_log.h"
#include "turn.h"

namespace consac::host {
namespace {

constexpr double kAtOnce = 0.5e-3;  // s that the engine's thread learns for between steps
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
    const std::size_t models = options_.start_from.size(), behaviours = world_.spec().behaviours.size();
    if (models != 0 && models != behaviours) {
      return {StatusCode::kInvalidArgument, "start_from has " + std::to_string(models) + " models for " +
                                                std::to_string(behaviours) + " behaviours; give one for each"};
    }
    for (std::size_t b = 0; b < world_.spec().behaviours.size(); ++b) {
      learn::LearnerOptions options;
      options.behaviour = world_.spec().behaviours[b];
      options.seed = learn::BehaviourSeed(options_.seed, b);
      options.total_steps = ShareOfSteps(b);
      options.max_bytes = kMostLearnerBytes;
      if (world_.prices_goals_of(b)) {
        options.price_goals = [this, b](const std::byte* observations, std::int64_t rows, float* rewards) {
          world_.PriceGoals(b, observations, rows, rewards);
          return Status::Ok();
        };
      }
      here_only_ = here_only_ || world_.prices_here_only(b);
      Result<std::unique_ptr<learn::Learner>> learner = (*algorithm)->create(options, values);
      if (!learner.ok()) return learner.status();
      if (models != 0) CONSAC_RETURN_IF_ERROR(StartFrom(options_.start_from[b], b, learner->get()));
      pupils_.push_back({std::move(*learner), std::nullopt, std::nullopt, false});
      CONSAC_RETURN_IF_ERROR(Learned(b));
    }
    Result<std::vector<ParameterLaw>> laws = ParseParameterLaws(options_.environment_parameters);
    if (!laws.ok()) return laws.status();
    CONSAC_RETURN_IF_ERROR(CheckParameterLaws(*laws, world_.spec().parameters));
    if (!laws->empty()) chooser_.emplace(std::move(*laws), world_.spec().parameters, options_.seed, 0);
    options_.start_from.clear();  // models are large, and are not begun with again
    if (!options_.log_folder.empty()) {
      Result<std::unique_ptr<TrainingLog>> log = TrainingLog::Open(
          options_.log_folder, options_.algorithm, learn::LogStyleOf(**algorithm, values), world_.spec());
      if (!log.ok()) return log.status();
      log_ = *std::move(log);
    }
    at_every_step_ = pupils_[0].learner->steps_per_update() == 0;
    TakeOverLearned();
    return Status::Ok();
  }

  Status Poll(double wait_s) override {
    if (!world_.settled()) return Status::Ok();
    const double began = Now();
    if (phase_ == Phase::kBegin) {
      turn_.Reset(options_.seed);
      ChooseForAll();
      phase_ = Phase::kFirst;
      return Status::Ok();
    }
    if (phase_ == Phase::kFirst)
      BeginEveryone();
    else if (phase_ == Phase::kRecord)
      CONSAC_RETURN_IF_ERROR(Record());
    else if (std::exchange(unrecorded_, false))
      PassOverStep();
    if (phase_ == Phase::kLearning && thread_.Done(Waits() ? wait_s : 0.0)) CONSAC_RETURN_IF_ERROR(EndLearning());
    if (log_ != nullptr) log_->Write();  // no learner waits for a disk: nobody's are held here
    if (phase_ == Phase::kLearning && Waits()) return Status::Ok();
    if (phase_ == Phase::kFinished) EndChoosing();
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
    if (failed_ || (phase_ == Phase::kLearning && !at_every_step_)) return pupils_[b].policy->ToFile();
    const auto mine = sharing_.Mine();
    Result<Policy> now = Policy::Create(Snapshot(b), 1);
    if (!now.ok()) return now.status();
    return now->ToFile();
  }

 private:
  enum class Phase : std::uint8_t {
    kBegin,     // nothing was asked for yet
    kFirst,     // episodes begin
    kRecord,    // a step that is learned from is under way
    kLearning,  // the job learns; steps that are under way meanwhile are not learned from
    kFinished,  // all steps are taken
  };

  bool Waits() const { return options_.while_learning == WhileLearning::kWait; }
  /// Only while the learners are this thread's, here and below.
  std::int64_t steps_learned_from() const {
    std::int64_t steps = 0;
    for (const Pupil& pupil : pupils_) steps += pupil.learner->steps();
    return steps;
  }
  bool LearningDue() const {
    return std::any_of(pupils_.begin(), pupils_.end(), [](const Pupil& pupil) { return pupil.learner->LearningDue(); });
  }
  /// Of total_steps, by the number of agents.
  std::int64_t ShareOfSteps(std::size_t b) const {
    const std::int64_t places = std::max(1, world_.places()), slots = world_.spec().behaviours[b].slots;
    return options_.total_steps / places * slots + options_.total_steps % places * slots / places;
  }

  /// The weights of a model; optimiser, random numbers and counts begin anew.
  Status StartFrom(std::span<const std::byte> bytes, std::size_t b, learn::Learner* learner) const {
    const BehaviourSpec& behaviour = world_.spec().behaviours[b];
    const Result<Policy> model = Policy::FromBytes(bytes);
    Status status = model.ok() ? model->Fits(behaviour) : model.status();
    if (status.ok()) status = learner->StartFrom(model->data());
    if (status.ok()) return status;
    return {status.code(), "behaviour '" + behaviour.name + "' cannot begin with this model: " + status.message()};
  }

  void ChooseForAll() {
    for (std::int32_t i = 0; chosen() && i < world_.spec().environments(); ++i)
      world_.SetParameters(i, chooser_->Choose(learned_from_));
  }
  bool chosen() const { return chooser_.has_value(); }
  /// After a step that nobody learns from: its episodes are drawn for as well, and written down while others are
  /// learned from.
  void PassOverStep() {
    for (std::size_t b = 0; (chosen() || log_ != nullptr) && b < pupils_.size(); ++b) ChooseNext(b, turn_.Outcome(b));
    WriteStep();
  }
  /// From the next episode on the world is as its declaration says: who acts then is in no training.
  void EndChoosing() {
    if (!chosen()) return;
    SetDefaultParameters(world_);
    chooser_.reset();
  }

  /// What came of the step, into the log. After Outcome.
  void WriteStep() {
    if (log_ == nullptr) return;
    log_->Note(turn_.TakeNoted());
    for (std::size_t b = 0; b < pupils_.size(); ++b) log_->Add(b, turn_.Latest(b), learned_from_);
  }
  /// What the learners have reported since, likewise; while they are this thread's.
  void WriteReports() {
    for (std::size_t b = 0; log_ != nullptr && b < pupils_.size(); ++b)
      log_->Look(b, *pupils_[b].learner, learned_from_);
  }
  /// For the episodes behind those that have begun with the step that `outcome` is of.
  void ChooseNext(std::size_t b, const Batch& outcome) {
    if (!chosen() || chooser_->fixed()) return;
    const auto agents = static_cast<std::int32_t>(world_.spec().behaviours[b].agents.size());
    for (std::size_t row = 0; row < outcome.slots.size(); ++row) {
      if ((outcome.terminated[row] | outcome.truncated[row]) != 0)
        world_.SetParameters(outcome.slots[row] / agents, chooser_->Choose(learned_from_));
    }
  }

  void BeginEveryone() {
    if (chosen() && !chooser_->fixed()) ChooseForAll();  // for the episodes behind those that begin now
    for (std::size_t b = 0; b < pupils_.size(); ++b) {
      const Batch& first = turn_.First(b);
      if (first.rows() > 0) pupils_[b].learner->Begin(first);
    }
    phase_ = Phase::kRecord;
  }

  Status Record() {
    const auto mine = sharing_.Mine();
    for (std::size_t b = 0; b < pupils_.size(); ++b) {
      const Batch& outcome = turn_.Outcome(b);
      if (outcome.rows() > 0) pupils_[b].learner->Record(outcome);
      ChooseNext(b, outcome);
      const Batch& arrived = turn_.Arrived(b);
      if (arrived.rows() > 0) pupils_[b].learner->Begin(arrived);
    }
    learned_from_ = steps_learned_from();
    WriteStep();
    if (at_every_step_) return GoOnLearning();
    if (LearningDue()) {
      phase_ = Phase::kLearning;
      thread_.Begin([this] { LearnRound(); });
    } else if (learned_from_ >= options_.total_steps) {
      phase_ = Phase::kFinished;
    }
    return Status::Ok();
  }

  /// The job of learners of rounds.
  void LearnRound() {
    for (std::size_t b = 0; b < pupils_.size(); ++b) {
      learn::Learner& learner = *pupils_[b].learner;
      learn::LearnPieces pieces;
      while (learner.Learn(pieces.budget())) {
        if (thread_.stopping()) return;
        pieces.Look(Now());
      }
      if (health_.ok()) health_ = learner.health();
      const Status learned = Learned(b);
      if (health_.ok()) health_ = learned;
    }
  }

  /// One gradient step of each learner that has one to take; whether more are due.
  bool LearnStep() {
    const double began = Now();
    bool more = false;
    for (Pupil& pupil : pupils_) {
      more = pupil.learner->Learn({1}) || more;
      if (health_.ok()) health_ = pupil.learner->health();
    }
    step_seconds_ = Now() - began;
    return more && health_.ok();
  }

  /// The job of learners that learn at every step.
  void LearnSteps() {
    for (bool more = true; more && !thread_.stopping();) {
      const auto job = sharing_.Job();
      more = LearnStep();
    }
  }

  /// Of learners that learn at every step, after a step that they were told of, or when their job has ended.
  Status GoOnLearning() {
    bool due = LearningDue();
    const bool idle = thread_.Done(0.0);
    const double end = Now() + kAtOnce;
    if (due && here_only_) due = LearnStep();
    while (due && idle && Waits() && health_.ok() && Now() + step_seconds_ < end) due = LearnStep();
    WriteReports();
    if (idle && !health_.ok()) return Fail();
    if (due && idle && !here_only_) thread_.Begin([this] { LearnSteps(); });
    for (Pupil& pupil : pupils_) {
      pupil.has_learned = pupil.learner->updates() > 0;
      updates_ = std::max(updates_, pupil.learner->updates());
    }
    const bool over = learned_from_ >= options_.total_steps, was_over = over && phase_ == Phase::kLearning && !Waits();
    phase_ = (due || !idle) && (over || Waits()) ? Phase::kLearning : over ? Phase::kFinished : Phase::kRecord;
    if (phase_ == Phase::kRecord || (phase_ == Phase::kLearning && (was_over || Waits()))) return Status::Ok();
    health_ = ActByWhatIsLearned();
    return health_.ok() ? health_ : Fail();
  }

  PolicyData Snapshot(std::size_t b) const {
    PolicyData data = pupils_[b].learner->Snapshot();
    data.training_json = WithAlgorithm(data.training_json, options_.algorithm);
    return data;
  }

  Status ActByWhatIsLearned() {
    for (std::size_t b = 0; b < pupils_.size(); ++b) CONSAC_RETURN_IF_ERROR(Learned(b));
    TakeOverLearned();
    return Status::Ok();
  }

  /// Said once; the agents go on by the last model that is one.
  Status Fail() {
    failed_ = true;
    phase_ = Phase::kFinished;
    if (at_every_step_) (void)ActByWhatIsLearned();
    return health_;
  }

  Status Learned(std::size_t b) {
    Result<Policy> policy = Policy::Create(Snapshot(b), world_.spec().behaviours[b].slots);
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

  /// The learners are this thread's again. Those of rounds go on from where the agents are now.
  Status EndLearning() {
    const auto mine = sharing_.Mine();
    if (at_every_step_) return GoOnLearning();
    WriteReports();
    if (!health_.ok()) return Fail();
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
    const auto mine = sharing_.Mine();
    for (std::size_t b = 0; b < pupils_.size(); ++b) {
      Batch& batch = turn_.ToAct(b);
      if (batch.rows() == 0) continue;
      if (phase_ == Phase::kRecord) {
        pupils_[b].learner->Act(batch);
      } else {
        const ActionMode mode = phase_ == Phase::kFinished ? ActionMode::kDeterministic : ActionMode::kSample;
        pupils_[b].policy->Act(turn_.RowsOf(b), mode, rng_, batch.actions);
      }
    }
    unrecorded_ = phase_ != Phase::kRecord;
    if (phase_ == Phase::kFinished) log_.reset();
    if (log_ != nullptr) log_->Note(turn_.TakeNoted());  // while a model learned, too
    turn_.Step();
  }

  TickWorld& world_;
  Turn turn_;
  TrainOptions options_;  // start_from is empty once everybody has begun
  Rng rng_;
  std::optional<ParameterChooser> chooser_;
  std::vector<Pupil> pupils_;
  Phase phase_ = Phase::kBegin;
  bool unrecorded_ = false;     // the step under way is not learned from
  bool at_every_step_ = false;  // the learners learn
  bool here_only_ = false;      // and only this thread may price goals: the job is never begun
  mutable Sharing sharing_;     // of those, and of what follows, with the job
  Status health_;               // the job's, while one is under way
  double step_seconds_ = 0.0;   // the latest gradient step took; likewise
  bool failed_ = false;
  std::int64_t updates_ = 0, learned_from_ = 0;
  Meter meter_;
  std::unique_ptr<TrainingLog> log_;  // null where nothing is written
  LearningThread thread_;             // last: its job uses what is above
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
