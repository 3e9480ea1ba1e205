#include "training_loop.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "consac/base/file.h"
#include "consac/nn/kernels.h"
#include "consac/protocol/protocol2.h"
#include "consac/run/path.h"

namespace consac::run {
namespace {

constexpr std::int64_t kLearnPiece = 64;  // optimiser steps between looks at `stop`

}  // namespace

std::int64_t Training::steps() const {
  std::int64_t sum = 0;
  for (const Trainee& trainee : trainees_) sum += trainee.learner->steps();
  return sum;
}

// Of config_.steps, the steps of one behaviour's agents: what its learner's schedules run over.
std::int64_t Training::ShareOfSteps(std::int64_t slots) const {
  const double share = static_cast<double>(slots) / static_cast<double>(slots_);
  return static_cast<std::int64_t>(static_cast<double>(config_.steps) * share + 0.5);
}

Status Training::MakeLearners() {
  const Result<const learn::Algorithm*> algorithm = learn::FindAlgorithm(config_.algorithm);
  if (!algorithm.ok()) return algorithm.status();
  algorithm_ = *algorithm;
  learn::HyperparameterSet values(algorithm_->hyperparameters);
  for (const auto& [name, text] : config_.hyperparameters) CONSAC_RETURN_IF_ERROR(values.Set(name, text));
  std::vector<BehaviourSpec> behaviours = spec().behaviours;
  for (std::size_t b = 0; b < behaviours.size(); ++b) {
    behaviours[b].slots = 0;
    for (std::size_t i = 0; i < crew_.size(); ++i) behaviours[b].slots += crew_[i].link().spec().behaviours[b].slots;
    slots_ += behaviours[b].slots;
  }
  for (const BehaviourSpec& behaviour : behaviours) {
    learn::LearnerOptions options;
    options.behaviour = behaviour;
    options.seed = config_.seed;
    options.total_steps = ShareOfSteps(behaviour.slots);
    options.executor = pool_.executor();
    Result<std::unique_ptr<learn::Learner>> learner = algorithm_->create(options, values);
    if (!learner.ok()) return learner.status();
    trainees_.push_back({std::move(*learner), EpisodeSums(behaviour.slots),
                         DataWatch(behaviour, DataWatchOptions::Of(config_, spec()))});
  }
  return Status::Ok();
}

// Each world's slots follow those of the world before it.
Status Training::AddWorkers(std::vector<WorldSource> worlds) {
  spec_ = worlds[0].link->spec();
  const EnvSpec& first = spec_;
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
    crew_.Add(std::make_unique<Worker>(std::move(world.link), first_slots, std::move(world.connect)));
    lost_.push_back(0);
    for (std::size_t b = 0; b < behaviours.size(); ++b) first_slots[b] += behaviours[b].slots;
  }
  return Status::Ok();
}

void Training::Visit(Archive& archive) {
  for (Trainee& trainee : trainees_) {
    const std::string name =
        trainees_.size() == 1 ? "learner" : "learner" + std::to_string(&trainee - trainees_.data());
    archive(name, *trainee.learner);
    archive(name + "_episodes", trainee.episodes);
  }
  if (!IsUrl(config_.world)) archive("world", crew_[0].link());
  archive("report", *report_);
}

Status Training::OpenReport(bool resumed) {
  ReportOptions options;
  options.directory = directory_->path();
  options.world_id = spec().id.empty() ? config_.world : spec().id;
  options.algorithm = config_.algorithm;
  options.style = algorithm_->log_style;
  options.total_steps = config_.steps;
  options.slots = trainees_[0].episodes.slots();
  options.engine = IsUrl(config_.world);
  options.log_interval = config_.log_interval;
  options.console_table = config_.table;
  options.progress = config_.progress;
  options.tensorboard = config_.tensorboard;
  options.append = resumed;
  options.resume_step = restored_steps_;
  Result<std::unique_ptr<Report>> report = Report::Open(options);
  if (!report.ok()) return report.status();
  report_ = std::move(*report);
  return Status::Ok();
}

// The report needs to know where a resumed run stands before it opens its files, and is itself part of the state:
// so the state is read once for the step count and once more with the report there.
Status Training::Restore() {
  const Result<StateMap> state = directory_->LoadCheckpoint();
  if (!state.ok()) {
    if (state.status().code() != StatusCode::kNotFound) return state.status();
    std::error_code ignored;
    if (std::filesystem::exists(ToPath(ModelPath(spec().behaviours[0].name)), ignored)) {
      return {StatusCode::kDataLoss, "run '" + directory_->path() +
                                         "' has a model but no checkpoint to go on from; train anew under another "
                                         "--name, or over it with --force"};
    }
    CONSAC_RETURN_IF_ERROR(OpenReport(false));  // killed before its first checkpoint: from the start
    return Status::Ok();
  }
  const auto at = state->find("steps");
  if (at != state->end() && at->second.bytes.size() == sizeof(restored_steps_)) {
    std::memcpy(&restored_steps_, at->second.bytes.data(), sizeof(restored_steps_));
  }
  // A finished run that an engine asks to train again trains that much longer.
  if (length_ == Length::kOfEngine && restored_steps_ >= config_.steps) {
    config_.steps = restored_steps_ + crew_[0].link().request().training_length;
    CONSAC_RETURN_IF_ERROR(WriteConfig());
  }
  const auto kernels = state->find("instruction_set");
  if (kernels != state->end()) {
    const std::string then(reinterpret_cast<const char*>(kernels->second.bytes.data()), kernels->second.bytes.size());
    if (then != nn::InstructionSet()) {
      Log(LogLevel::kWarning, "this run was trained with " + then + " kernels and goes on with " +
                                  std::string(nn::InstructionSet()) + "; results will differ in the last digits");
    }
  }
  restored_ = true;
  CONSAC_RETURN_IF_ERROR(OpenReport(true));
  StateReader reader(*state);
  Visit(reader);
  if (!reader.status().ok())
    return {reader.status().code(), "cannot resume '" + directory_->path() + "': " + reader.status().message()};
  for (std::size_t i = 0; i < trainees_.size(); ++i) {
    trainees_[i].learner->SetTotalSteps(ShareOfSteps(trainees_[i].episodes.slots()));
    trainees_[i].reported_updates = trainees_[i].learner->updates();
  }
  checkpoint_updates_ = trainees_[0].learner->updates();
  if (config_.table) report_->Line("going on from step " + std::to_string(restored_steps_));
  return Status::Ok();
}

Status Training::WriteConfig() const {
  const std::string yaml = WriteYaml(config_);
  return WriteFileAtomically(directory_->File("config.yaml"), std::as_bytes(std::span(yaml)));
}

Status Training::Start(std::vector<WorldSource> worlds) {
  CONSAC_RETURN_IF_ERROR(AddWorkers(std::move(worlds)));
  CONSAC_RETURN_IF_ERROR(MakeLearners());
  const ExistingRun existing = config_.resume  ? ExistingRun::kResume
                               : config_.force ? ExistingRun::kOverwrite
                                               : ExistingRun::kRefuse;
  Result<std::unique_ptr<RunDirectory>> directory = RunDirectory::Open(config_.directory, config_.name, existing);
  if (!directory.ok()) return directory.status();
  directory_ = std::move(*directory);
  CONSAC_RETURN_IF_ERROR(WriteConfig());
  if (config_.resume)
    CONSAC_RETURN_IF_ERROR(Restore());
  else
    CONSAC_RETURN_IF_ERROR(OpenReport(false));

  LearnWhatIsDue();
  const bool world_restored = restored_ && !IsUrl(config_.world);
  if (!world_restored) CONSAC_RETURN_IF_ERROR(BeginWorlds());
  checkpoint_time_ = Now();
  return Status::Ok();
}

// A resumed run with engines: its episodes begin anew.
Status Training::BeginWorlds() {
  for (Trainee& trainee : trainees_) trainee.episodes.Clear();
  std::uint64_t seed = config_.seed;
  for (std::size_t i = 0; i < crew_.size(); ++i) {
    CONSAC_RETURN_IF_ERROR(crew_[i].Reset(seed));
    CONSAC_RETURN_IF_ERROR(crew_[i].Begin(trainees_));
    seed += static_cast<std::uint64_t>(crew_[i].link().spec().environments());
  }
  return Status::Ok();
}

// In pieces, so that Ctrl-C need not wait for the end of a long update: what is left of it is learned on resume.
void Training::LearnWhatIsDue() {
  for (Trainee& trainee : trainees_) {
    while (trainee.learner->Learn({kLearnPiece})) {
      if (stop_.load(std::memory_order_relaxed)) return;
      for (std::size_t i = 0; i < crew_.size(); ++i) {
        if (crew_.at_rest(i)) crew_[i].link().KeepAlive();
      }
    }
    if (trainee.learner->updates() == trainee.reported_updates) continue;
    trainee.reported_updates = trainee.learner->updates();
    report_->OnUpdate(trainee.learner->metrics(), steps(), trainee.learner->updates(),
                      trainee.learner->steps_per_update());
  }
}

bool Training::LearningDue() const {
  return std::any_of(trainees_.begin(), trainees_.end(),
                     [](const Trainee& trainee) { return trainee.learner->LearningDue(); });
}

// The worker chooses its actions and takes its step, unless enough are under way.
void Training::Send(std::size_t worker, Where where) {
  if (asked_ >= config_.steps || stop_.load(std::memory_order_relaxed)) return;
  const double start = Now();
  const Rows rows = crew_.size() == 1 && where == Where::kHere ? Rows::kLearners : Rows::kOwn;
  crew_[worker].Act(trainees_, rows);
  spent_.inference += Now() - start;
  asked_ += crew_[worker].rows();
  crew_.Step(worker, asked_ >= config_.steps ? MoreSteps::kLast : MoreSteps::kYes, where);
}

// What a worker comes back with: a step, a failure, a new connection.
Status Training::Handle(const Crew::Outcome& outcome) {
  if (!outcome.connected_anew) {
    if (!outcome.status.ok()) return Lose(outcome);
    return Take(crew_[outcome.worker]);
  }
  --connecting_;
  if (outcome.status.ok()) {
    lost_[outcome.worker] = 0;
    crew_[outcome.worker].Adopt();
    CONSAC_RETURN_IF_ERROR(crew_[outcome.worker].Begin(trainees_));
    report_->Line("an engine is back: " + crew_[outcome.worker].link().description());
  } else if (outcome.status.code() != StatusCode::kCancelled) {
    report_->Line("warning: an engine is given up: " + outcome.status.message());
  }
  return Status::Ok();
}

Status Training::Take(Worker& worker) {
  CONSAC_RETURN_IF_ERROR(worker.Record(trainees_));
  done_ += worker.rows();
  double reward = 0.0;
  for (std::size_t b = 0; b < trainees_.size(); ++b) {
    const Batch& batch = worker.batches()[b];
    trainees_[b].episodes.Add(batch, done_, *report_);
    for (std::int64_t i = 0; i < batch.rows(); ++i) reward += batch.rewards[static_cast<std::size_t>(i)];
  }
  report_->OnStep(done_, reward);
  spent_.agent_steps += worker.rows();
  ++spent_.rounds;
  return Status::Ok();
}

// One world of several is lost: the others go on while it is tried again. Its step was not taken.
Status Training::Lose(const Crew::Outcome& outcome) {
  Worker& worker = crew_[outcome.worker];
  asked_ -= worker.rows();
  lost_[outcome.worker] = 1;
  const bool last = std::all_of(lost_.begin(), lost_.end(), [](std::uint8_t lost) { return lost != 0; });
  if (last || stop_.load(std::memory_order_relaxed)) return outcome.status;
  for (std::size_t b = 0; b < trainees_.size(); ++b) trainees_[b].episodes.Clear(worker.slots(b));
  report_->Line("warning: an engine is lost: " + outcome.status.message() + "; the others go on, it is tried again");
  crew_.ConnectAnew(outcome.worker, config_.seed + static_cast<std::uint64_t>(done_), stop_);
  ++connecting_;
  return Status::Ok();
}

// Learning overlaps the next step of the worker whose outcome made it due; in lock step all wait for all.
Status Training::LearnAndGoOn(std::size_t worker) {
  if (IsUrl(config_.world) && !config_.lockstep) {
    Send(worker, Where::kAside);
  } else {
    while (steps_under_way() > 0) CONSAC_RETURN_IF_ERROR(Handle(crew_.Next()));
  }
  const double start = Now();
  LearnWhatIsDue();
  spent_.learning += Now() - start;
  return Status::Ok();
}

void Training::SendIdle() {
  if (LearningDue()) return;  // stopped in the middle of it
  const Where where = crew_.size() == 1 ? Where::kHere : Where::kAside;
  for (std::size_t i = 0; i < crew_.size(); ++i) {
    if (!crew_.busy(i) && lost_[i] == 0) Send(i, where);
  }
}

Status Training::Loop() {
  done_ = asked_ = steps();
  round_began_ = Now();
  while (true) {
    SendIdle();
    if (steps_under_way() == 0) break;
    const double start = Now();
    const Crew::Outcome outcome = crew_.Next();
    AccountFor(outcome, Now() - start);
    // A step that was asked for ahead of learning which was stopped in the middle has no place.
    if (LearningDue()) {
      if (outcome.connected_anew) --connecting_;
      continue;
    }
    CONSAC_RETURN_IF_ERROR(Handle(outcome));
    if (LearningDue()) CONSAC_RETURN_IF_ERROR(LearnAndGoOn(outcome.worker));
    for (const Trainee& trainee : trainees_) CONSAC_RETURN_IF_ERROR(trainee.learner->health());
    if (CheckpointDue()) (void)Save();
    TellTime();
  }
  return Status::Ok();
}

void Training::AccountFor(const Crew::Outcome& outcome, double waited) {
  const Worker& worker = crew_[outcome.worker];
  const bool known = !outcome.connected_anew && worker.step_seconds() > 0.0;
  const double share = known ? std::min(1.0, worker.world_seconds() / worker.step_seconds()) : 0.0;
  spent_.world += share * waited;
  spent_.wire += (1.0 - share) * waited;
}

void Training::TellTime() {
  const double now = Now();
  spent_.other = 0.0;
  spent_.other = std::max(0.0, now - round_began_ - spent_.sum());
  report_->OnTime(spent_);
  spent_ = {};
  round_began_ = now;
}

bool Training::CheckpointDue() const {
  const std::int64_t updates = trainees_[0].learner->updates();
  if (updates == checkpoint_updates_) return false;  // between updates there is nothing new to lose
  if (config_.checkpoint_every_updates > 0) return updates - checkpoint_updates_ >= config_.checkpoint_every_updates;
  return config_.checkpoint_every_s > 0 && Now() - checkpoint_time_ >= static_cast<double>(config_.checkpoint_every_s);
}

std::string Training::Description() const {
  return nlohmann::json({{"kind", "checkpoint"},
                         {"requires", {"checkpoint"}},
                         {"world", config_.world},
                         {"algorithm", config_.algorithm},
                         {"steps", steps()},
                         {"seed", config_.seed},
                         {"instruction_set", nn::InstructionSet()}})
      .dump();
}

// The checkpoint first: it holds more, and --resume needs it. Then the model, so that whoever kills the training has
// one, whatever became of the checkpoint.
Status Training::Save() {
  const Status checkpoint = Checkpoint(), model = SaveModel();
  checkpoint_time_ = Now();
  checkpoint_updates_ = trainees_[0].learner->updates();
  TellFailure("a checkpoint", checkpoint, &checkpoint_failed_);
  TellFailure("the model", model, &model_failed_);
  return checkpoint.ok() ? model : checkpoint;
}

// Once, until it works again.
void Training::TellFailure(const std::string& what, const Status& status, bool* told) {
  if (!status.ok() && !*told) {
    report_->Line("error: " + what + " could not be saved: " + status.message() +
                  "; training goes on, the last good one stays");
  }
  *told = !status.ok();
}

Status Training::Checkpoint() {
  StateWriter writer;
  std::int64_t at = steps();
  std::string instruction_set(nn::InstructionSet());
  writer("steps", at);
  writer("instruction_set", instruction_set);
  Visit(writer);
  CONSAC_RETURN_IF_ERROR(writer.status());
  return directory_->SaveCheckpoint(at, writer.fields(), Description(), config_.keep_checkpoints);
}

std::string Training::ModelPath(const std::string& behaviour) const {
  return directory_->File(trainees_.size() == 1 ? "model.consac" : behaviour + ".consac");
}

Status Training::SaveModel() {
  for (const Trainee& trainee : trainees_) {
    PolicyData data = trainee.learner->Snapshot();
    nlohmann::json training = nlohmann::json::parse(data.training_json, nullptr, false);
    training["algorithm"] = config_.algorithm;
    training["world"] = spec().id.empty() ? config_.world : spec().id;
    training["seed"] = config_.seed;
    data.training_json = training.dump();
    const std::string path = ModelPath(data.behaviour);
    const Result<Policy> policy = Policy::Create(std::move(data), 1);
    if (!policy.ok()) return policy.status();
    CONSAC_RETURN_IF_ERROR(policy->ToFile(config_.seed).Save(path));
  }
  return Status::Ok();
}

Result<RunSummary> Training::Finish(double seconds) {
  for (const Trainee& trainee : trainees_) {
    const std::string found = trainee.watch.Summary();
    if (!found.empty()) report_->Line("warning: what the world sent: " + found);
  }
  const Status saved = Save(), report = report_->Finish();
  for (const Status& status : {saved, report}) CONSAC_RETURN_IF_ERROR(status);
  RunSummary summary;
  summary.directory = directory_->path();
  summary.model_path = ModelPath(spec().behaviours[0].name);
  summary.steps = steps();
  summary.updates = trainees_[0].learner->updates();
  summary.seconds = seconds;
  summary.mean_episode_reward = report_->mean_episode_reward();
  summary.interrupted = summary.steps < config_.steps;
  for (const Trainee& trainee : trainees_) summary.interrupted = summary.interrupted || trainee.learner->LearningDue();
  StateHasher hasher;
  for (const Trainee& trainee : trainees_) {
    PolicyData data = trainee.learner->Snapshot();
    hasher("parameters", data.parameters);
    hasher("log_std", data.log_std);
  }
  summary.weights_hash = hasher.hash();
  return summary;
}

}  // namespace consac::run
