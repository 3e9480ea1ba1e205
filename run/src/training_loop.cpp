#include "training_loop.h"

#include <algorithm>
#include <utility>

#include "consac/base/file.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"

namespace consac::run {
namespace {

constexpr double kRest = 2.0;  // s for steps under way to end before what is kept for saving is given free

}  // namespace

std::int64_t Training::steps() const {
  std::int64_t sum = 0;
  for (const Trainee& trainee : trainees_) sum += trainee.learner->steps();
  return sum;
}

std::int64_t Training::steps_per_update() const {
  std::int64_t longest = 0;
  for (const Trainee& trainee : trainees_) longest = std::max(longest, trainee.learner->steps_per_update());
  return longest;
}

std::int64_t Training::memory_bytes() const {
  std::int64_t sum = 0;
  for (const Trainee& trainee : trainees_) sum += trainee.learner->memory_bytes();
  return sum;
}

// Each world's slots follow those of the world before it.
Status Training::AddWorkers(std::vector<WorldSource> worlds) {
  spec_ = worlds[0].link->spec();
  const EnvSpec& first = spec_;
  const Result<std::vector<ParameterLaw>> laws = ParseParameterLaws(config_.environment_parameters);
  if (!laws.ok()) return laws.status();
  std::vector<std::int32_t> first_slots(first.behaviours.size());
  for (WorldSource& world : worlds) {
    const EnvSpec& offered = world.link->spec();
    std::string path;
    const Status same =
        protocol2::CompareBehaviours(protocol2::BehavioursJson(first), protocol2::BehavioursJson(offered), &path);
    if (!same.ok() || offered.behaviours.size() != first.behaviours.size()) {
      return {StatusCode::kInvalidArgument,
              "engines that train one model must offer the same; " + world.link->description() +
                  " differs: " + (same.ok() ? "it has more behaviours" : protocol2::FaultText(same))};
    }
    const std::vector<BehaviourSpec> behaviours = offered.behaviours;
    CONSAC_RETURN_IF_ERROR(CheckEnvironmentParameters(*laws, *world.link));
    crew_.Add(std::make_unique<Worker>(std::move(world.link), first_slots, std::move(world.connect)));
    const auto index = static_cast<std::uint32_t>(crew_.size() - 1);
    if (!laws->empty())
      crew_[index].UseParameters({ParameterChooser(*laws, first.parameters, config_.seed, index), &done_});
    lost_.push_back(0);
    for (std::size_t b = 0; b < behaviours.size(); ++b) first_slots[b] += behaviours[b].slots;
  }
  return Status::Ok();
}

Status Training::OpenReport(bool resumed) {
  ReportOptions options;
  options.directory = directory_->path();
  options.may_write = [this] { return directory_->CheckOurs(); };
  options.world_id = spec().id.empty() ? config_.world : spec().id;
  options.algorithm = config_.algorithm;
  options.style = log_style_;
  options.total_steps = config_.steps;
  options.behaviours.clear();
  for (std::size_t b = 0; b < trainees_.size(); ++b)
    options.behaviours.push_back({spec().behaviours[b].name, trainees_[b].episodes.slots()});
  options.engine = IsUrl(config_.world);
  options.log_interval = config_.log_interval;
  options.console_table = config_.table;
  options.table_every_s = config_.table_every_s;
  options.progress = config_.progress;
  options.tensorboard = config_.tensorboard;
  options.quiet = config_.quiet;
  options.hold_until = config_.hold_until;
  options.append = resumed;
  options.resume_step = restored_steps_;
  Result<std::unique_ptr<Report>> report = Report::Open(options);
  if (!report.ok()) return report.status();
  report_ = std::move(*report);
  return Status::Ok();
}

Status Training::WriteConfig() const {
  const std::string yaml = WriteYaml(config_);
  return directory_->Write(directory_->File("config.yaml"), std::as_bytes(std::span(yaml)));
}

Status Training::Start(std::vector<WorldSource> worlds) {
  CONSAC_RETURN_IF_ERROR(AddWorkers(std::move(worlds)));
  CONSAC_RETURN_IF_ERROR(MakeLearners());
  CONSAC_RETURN_IF_ERROR(CheckCheckpointFits());
  // Before the folder, where --force takes an earlier run away, be it the one to begin with.
  CONSAC_RETURN_IF_ERROR(CheckEvaluation());
  if (!config_.resume) CONSAC_RETURN_IF_ERROR(StartFromModels());
  Result<std::unique_ptr<RunDirectory>> directory =
      RunDirectory::Open(config_.directory, config_.name, ExistingRunOf(config_));
  if (!directory.ok()) return directory.status();
  directory_ = std::move(*directory);
  KeepReplacedModels();
  if (config_.eval_every > 0) CONSAC_RETURN_IF_ERROR(CheckBestFolder());
  if (double goal = 0.0; ParseHumanNumber(config_.stop_reward, &goal)) goal_ = goal;
  if (config_.resume) {
    CONSAC_RETURN_IF_ERROR(Restore());  // one that is refused leaves config.yaml as it was
    CONSAC_RETURN_IF_ERROR(WriteConfig());
  } else {
    CONSAC_RETURN_IF_ERROR(WriteConfig());  // by which a run is known, whenever it is killed
    CONSAC_RETURN_IF_ERROR(OpenReport(false));
  }

  done_ = steps();  // by which parameters of the world may go
  const bool world_restored = restored_ && !IsUrl(config_.world);
  if (!world_restored) CONSAC_RETURN_IF_ERROR(ResetWorlds());  // before which an engine prices no goals
  if (algorithm_->needs_world) LearnWhatIsDue();
  if (!world_restored) CONSAC_RETURN_IF_ERROR(BeginWorlds());
  if (directory_->replaces()) CONSAC_RETURN_IF_ERROR(SaveBeginning());
  if (!algorithm_->needs_world) CONSAC_RETURN_IF_ERROR(directory_->RemoveReplaced());
  if (next_evaluation_ == 0) PlanEvaluation();
  reserve_ = std::make_unique<MemoryReserve>(kFirstAid, SavingBytes());
  checkpoint_time_ = Now();
  return Status::Ok();
}

// What has begun and not come to a step: a run that was to be overwritten is put back.
Status Training::GiveUp(const Status& why) {
  report_.reset();  // whose files go
  if (directory_ == nullptr || !directory_->replaces()) return why;
  const Status back = directory_->PutBack();
  if (!back.ok()) return {why.code(), why.message() + "; and then: " + back.message()};
  return {why.code(), why.message() + "; the run that was to be overwritten is as it was"};
}

Status Training::ResetWorlds() {
  std::uint64_t seed = config_.seed;
  for (std::size_t i = 0; i < crew_.size(); ++i) {
    CONSAC_RETURN_IF_ERROR(crew_[i].Reset(seed));
    seed += static_cast<std::uint64_t>(crew_[i].link().spec().environments());
  }
  return Status::Ok();
}

// A resumed run with engines: its episodes begin anew.
Status Training::BeginWorlds() {
  for (Trainee& trainee : trainees_) trainee.episodes.Clear();
  for (std::size_t i = 0; i < crew_.size(); ++i) CONSAC_RETURN_IF_ERROR(crew_[i].Begin(trainees_));
  return Status::Ok();
}

// In pieces, so that Ctrl-C need not wait for the end of a long update: what is left of it is learned on resume.
void Training::LearnWhatIsDue() {
  for (Trainee& trainee : trainees_) {
    learn::LearnPieces pieces;
    while (trainee.learner->Learn(pieces.budget())) {
      if (stop_.load(std::memory_order_relaxed) || !trainee.learner->health().ok()) return ReportUpdates();
      crew_.KeepAlive();
      pieces.Look(Now());
    }
  }
  ReportUpdates();
}

// Behaviours that learned at the same step are told of together.
void Training::ReportUpdates() {
  updates_.clear();
  for (std::size_t b = 0; b < trainees_.size(); ++b) {
    const learn::Learner& learner = *trainees_[b].learner;
    if (learner.reports() == trainees_[b].reports) continue;
    trainees_[b].reports = learner.reports();
    updates_.push_back({b, learner.metrics(), learner.updates(), learner.steps_per_update(), learner.reports()});
  }
  if (!updates_.empty()) report_->OnUpdates(updates_, steps());
}

bool Training::LearnedNothing() const {
  const auto learns = [](const Trainee& trainee) { return !trainee.frozen; };
  return std::ranges::any_of(trainees_, learns) && std::ranges::none_of(trainees_, [&](const Trainee& trainee) {
           return learns(trainee) && trainee.learner->updates() > 0;
         });
}

bool Training::LearningDue() const {
  return std::any_of(trainees_.begin(), trainees_.end(),
                     [](const Trainee& trainee) { return trainee.learner->LearningDue(); });
}

// The worker chooses its actions and takes its step, unless enough are under way.
void Training::Send(std::size_t worker, Where where) {
  if (asked_ >= config_.steps || goal_reached_ || stop_.load(std::memory_order_relaxed)) return;
  crew_[worker].Act(trainees_, crew_.size() > 1 || Overlaps() ? Rows::kOwn : Rows::kLearners);
  clock_.Spend(&TimeSpent::inference);
  asked_ += crew_[worker].rows();
  crew_.Step(worker, asked_ >= config_.steps ? MoreSteps::kLast : MoreSteps::kYes, where);
}

// What a worker comes back with: a step, a failure, a new connection.
Status Training::Handle(const Crew::Outcome& outcome) {
  if (!outcome.connected_anew) {
    if (outcome.status.code() == StatusCode::kResourceExhausted) return outcome.status;  // not for want of an engine
    if (!outcome.status.ok()) return Lose(outcome);
    return Take(crew_[outcome.worker]);
  }
  --connecting_;
  if (outcome.status.ok()) {
    lost_[outcome.worker] = 0;
    crew_[outcome.worker].Adopt();
    CONSAC_RETURN_IF_ERROR(crew_[outcome.worker].Begin(trainees_));
    returns_.Say("an engine is back: " + crew_[outcome.worker].link().description());
  } else if (outcome.status.code() != StatusCode::kCancelled) {
    report_->Line("warning: an engine is given up: " + outcome.status.message());
  }
  return Status::Ok();
}

Status Training::Take(Worker& worker) {
  CONSAC_RETURN_IF_ERROR(worker.TakeOutcome(trainees_));
  CONSAC_RETURN_IF_ERROR(directory_->RemoveReplaced());
  done_ += worker.rows();
  clock_.CountStep(worker.rows());
  brought_.assign(trainees_.size(), {});
  for (std::size_t b = 0; b < trainees_.size(); ++b) {
    const Batch& batch = worker.batches()[b];
    trainees_[b].episodes.Add(batch, done_, *report_);
    brought_[b].agents = batch.rows();
    for (std::int64_t i = 0; i < batch.rows(); ++i) brought_[b].reward += batch.rewards[static_cast<std::size_t>(i)];
  }
  noted_.clear();
  worker.link().TakeStatistics(&noted_);
  if (!noted_.empty()) report_->OnStatistics(noted_);
  report_->OnStep(done_, brought_);
  return worker.Record(trainees_);
}

void Training::Tell(std::string_view line) {
  if (report_ != nullptr) report_->Line(std::string(line));
}

// One world of several is lost: the others go on while it is tried again. Its step was not taken.
Status Training::Lose(const Crew::Outcome& outcome) {
  Worker& worker = crew_[outcome.worker];
  asked_ -= worker.rows();
  lost_[outcome.worker] = 1;
  const bool last = std::all_of(lost_.begin(), lost_.end(), [](std::uint8_t lost) { return lost != 0; });
  if (last || stop_.load(std::memory_order_relaxed)) return outcome.status;
  for (std::size_t b = 0; b < trainees_.size(); ++b) trainees_[b].episodes.Clear(worker.slots(b));
  losses_.Say("warning: an engine is lost: " + outcome.status.message() + "; the others go on, it is tried again");
  crew_.ConnectAnew(outcome.worker, config_.seed + static_cast<std::uint64_t>(done_), stop_);
  ++connecting_;
  return Status::Ok();
}

// Learning overlaps the next step of the worker whose outcome made it due; in lock step all wait for all.
Status Training::LearnAndGoOn(std::size_t worker) {
  clock_.Watch();
  clock_.Spend(&TimeSpent::other);
  if (Overlaps()) {
    Send(worker, Where::kAside);
  } else {
    while (steps_under_way() > 0) CONSAC_RETURN_IF_ERROR(Handle(crew_.Next()));
  }
  clock_.Spend(&TimeSpent::other);
  LearnWhatIsDue();
  clock_.Spend(&TimeSpent::learning);
  return Status::Ok();
}

void Training::SendIdle() {
  if (LearningDue()) return;  // stopped in the middle of it
  const Where where = crew_.size() == 1 ? Where::kHere : Where::kAside;
  for (std::size_t i = 0; i < crew_.size(); ++i) {
    if (!crew_.busy(i) && lost_[i] == 0) Send(i, where);
  }
}

// The learners say how long. How quick they are decides how often `stop_` is looked at, and nothing else.
Status Training::LearnWithoutWorld() {
  learn::LearnPieces pieces;
  while (LearningDue() && !goal_reached_ && !stop_.load(std::memory_order_relaxed)) {
    for (const Trainee& trainee : trainees_) LearnRound(*trainee.learner, pieces);
    clock_.Spend(&TimeSpent::learning);
    done_ = asked_ = steps();
    brought_.assign(trainees_.size(), {});
    report_->OnStep(done_, brought_);
    CONSAC_RETURN_IF_ERROR(AfterRound());
  }
  return Status::Ok();
}

Status Training::AfterRound() {
  ReportUpdates();  // of a learner that reports without learning just now
  for (const Trainee& trainee : trainees_) CONSAC_RETURN_IF_ERROR(trainee.learner->health());
  CONSAC_RETURN_IF_ERROR(reserve_->health());
  if (EvaluationDue()) clock_.Watch();
  EvaluateIfDue();
  losses_.Look();
  returns_.Look();
  if (CheckpointDue()) {
    clock_.Watch();
    const double before = Now();
    (void)Save(Telling::kNow);
    saving_seconds_ += Now() - before;
    CONSAC_RETURN_IF_ERROR(directory_->CheckOurs());
  }
  TellTime();
  return Status::Ok();
}

Status Training::Loop() {
  done_ = asked_ = steps();
  if (EvaluationDue()) EvaluateIfDue();  // which a stop has interrupted
  clock_.Start();
  if (!algorithm_->needs_world) return LearnWithoutWorld();
  for (const Trainee& trainee : trainees_) CONSAC_RETURN_IF_ERROR(trainee.learner->health());  // of what was due
  while (true) {
    clock_.BeginRound();
    SendIdle();
    if (steps_under_way() == 0) break;
    const Crew::Outcome outcome = crew_.Next();
    AccountFor(outcome);
    // A step that was asked for ahead of learning which was stopped in the middle has no place.
    if (LearningDue()) {
      if (outcome.connected_anew) --connecting_;
      continue;
    }
    CONSAC_RETURN_IF_ERROR(Handle(outcome));
    if (LearningDue()) CONSAC_RETURN_IF_ERROR(LearnAndGoOn(outcome.worker));
    CONSAC_RETURN_IF_ERROR(AfterRound());
  }
  clock_.Watch();
  TellTime();
  return Status::Ok();
}

void Training::AccountFor(const Crew::Outcome& outcome) {
  const double share = outcome.connected_anew ? 0.0 : crew_[outcome.worker].world_share();
  clock_.Spend(share, &TimeSpent::world, &TimeSpent::wire);
}

void Training::TellTime() {
  clock_.Spend(&TimeSpent::other);
  const bool in_process = crew_.size() == 1 && !crew_[0].link().behind_connection();
  const NextRounds next = in_process ? NextRounds::kAlike : NextRounds::kOfTheirOwn;
  if (const std::optional<TimeSpent> spent = clock_.EndRound(next); spent.has_value()) report_->OnTime(*spent);
}

Result<RunSummary> Training::Finish(double seconds) {
  if (reserve_->ran_short()) crew_.Rest(kRest);  // or a step under way would take what saving needs
  reserve_->Release();
  for (const Trainee& trainee : trainees_) {
    const std::string found = trainee.watch.Summary();
    if (!found.empty()) report_->Line("warning: what the world sent: " + found);
  }
  CONSAC_RETURN_IF_ERROR(directory_->RemoveReplaced());
  const Status saved = Save(Telling::kAtTheEnd);
  CONSAC_RETURN_IF_ERROR(directory_->CheckOurs());  // or it would be said of every curve, too
  const Status report = report_->Finish();
  if (!reserve_->ran_short()) {
    reserve_.reset();  // nothing is left to save: drawing may have it
    report_->DrawCurves(stop_);
  }
  CONSAC_RETURN_IF_ERROR(saved);
  const Status evaluation = {evaluation_.code(), "the last evaluation failed: " + evaluation_.message()};
  const Status best = {best_.code(), "the best model could not be saved: " + best_.message()};
  for (const Status& beside : {report, best, evaluation}) {
    if (!beside.ok())
      return Status{beside.code(), beside.message() + "; what was learned is saved in '" + directory_->path() + "'"};
  }
  RunSummary summary;
  summary.directory = directory_->path();
  summary.steps = steps();
  summary.seconds = seconds;
  summary.saving_seconds = saving_seconds_;
  summary.interrupted = !goal_reached_ && (summary.steps < config_.steps || EvaluationDue());
  for (const Trainee& trainee : trainees_) summary.interrupted = summary.interrupted || trainee.learner->LearningDue();
  if (!summary.interrupted && summary.steps >= steps_per_update() && LearnedNothing()) {
    report_->Line("warning: nothing was learned in " + std::to_string(summary.steps) +
                  " steps; raise --steps, or look at what " + Quote(config_.algorithm) +
                  " waits for (learning_starts, train_freq, gradient_steps)");
  }
  StateHasher hasher;
  for (std::size_t b = 0; b < trainees_.size(); ++b) {
    const learn::Learner& learner = *trainees_[b].learner;
    const BehaviourSpec& behaviour = spec().behaviours[b];
    summary.models.push_back(
        {behaviour.name, ModelPath(behaviour), learner.updates(), report_->mean_episode_reward(b)});
    PolicyData data = learner.Snapshot();
    hasher("parameters", data.parameters);
    hasher("log_std", data.log_std);
  }
  summary.weights_hash = hasher.hash();
  return summary;
}

}  // namespace consac::run
