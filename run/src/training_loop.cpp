#include "training_loop.h"

#include <cstring>
#include <nlohmann/json.hpp>

#include "consac/base/file.h"
#include "consac/nn/kernels.h"

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
std::int64_t Training::ShareOfSteps(const BehaviourSpec& behaviour) const {
  const double share = static_cast<double>(behaviour.slots) / static_cast<double>(slots_);
  return static_cast<std::int64_t>(static_cast<double>(config_.steps) * share + 0.5);
}

Status Training::MakeLearners() {
  const Result<const learn::Algorithm*> algorithm = learn::FindAlgorithm(config_.algorithm);
  if (!algorithm.ok()) return algorithm.status();
  algorithm_ = *algorithm;
  learn::HyperparameterSet values(algorithm_->hyperparameters);
  for (const auto& [name, text] : config_.hyperparameters) CONSAC_RETURN_IF_ERROR(values.Set(name, text));
  for (const BehaviourSpec& behaviour : link_->spec().behaviours) slots_ += behaviour.slots;
  for (const BehaviourSpec& behaviour : link_->spec().behaviours) {
    learn::LearnerOptions options;
    options.behaviour = behaviour;
    options.seed = config_.seed;
    options.total_steps = ShareOfSteps(behaviour);
    options.executor = pool_.executor();
    Result<std::unique_ptr<learn::Learner>> learner = algorithm_->create(options, values);
    if (!learner.ok()) return learner.status();
    trainees_.push_back({std::move(*learner), BatchBuffer(behaviour), EpisodeSums(behaviour.slots),
                         DataWatch(behaviour, DataWatchOptions::Of(config_, link_->spec()))});
  }
  batches_.resize(trainees_.size());
  return Status::Ok();
}

void Training::Visit(Archive& archive) {
  for (Trainee& trainee : trainees_) {
    const std::string name =
        trainees_.size() == 1 ? "learner" : "learner" + std::to_string(&trainee - trainees_.data());
    archive(name, *trainee.learner);
    archive(name + "_episodes", trainee.episodes);
  }
  archive("world", *link_);
  archive("report", *report_);
}

Status Training::OpenReport(bool resumed) {
  ReportOptions options;
  options.directory = directory_->path();
  options.world_id = link_->spec().id.empty() ? config_.world : link_->spec().id;
  options.algorithm = config_.algorithm;
  options.style = algorithm_->log_style;
  options.total_steps = config_.steps;
  options.slots =
      trainees_[0].first.batch().slots.empty() ? 1 : static_cast<std::int32_t>(trainees_[0].first.batch().rows());
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
    CONSAC_RETURN_IF_ERROR(OpenReport(false));  // killed before its first checkpoint: from the start
    return Status::Ok();
  }
  const auto at = state->find("steps");
  if (at != state->end() && at->second.bytes.size() == sizeof(restored_steps_)) {
    std::memcpy(&restored_steps_, at->second.bytes.data(), sizeof(restored_steps_));
  }
  // A finished run that an engine asks to train again trains that much longer.
  if (length_ == Length::kOfEngine && restored_steps_ >= config_.steps) {
    config_.steps = restored_steps_ + link_->request().training_length;
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
    trainees_[i].learner->SetTotalSteps(ShareOfSteps(link_->spec().behaviours[i]));
    trainees_[i].reported_updates = trainees_[i].learner->updates();
  }
  checkpoint_updates_ = trainees_[0].learner->updates();
  return Status::Ok();
}

Status Training::WriteConfig() const {
  const std::string yaml = WriteYaml(config_);
  return WriteFileAtomically(directory_->File("config.yaml"), std::as_bytes(std::span(yaml)));
}

Status Training::Start(std::unique_ptr<WorldLink> link) {
  link_ = std::move(link);
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
  if (!world_restored) {
    for (std::size_t i = 0; i < trainees_.size(); ++i) {
      batches_[i] = trainees_[i].first.batch();
      trainees_[i].episodes.Clear();  // a resumed run with an engine: its episodes begin anew
    }
    CONSAC_RETURN_IF_ERROR(link_->Reset(config_.seed, batches_));
    for (std::size_t i = 0; i < trainees_.size(); ++i) {
      CONSAC_RETURN_IF_ERROR(trainees_[i].watch.Begin(batches_[i]));
      trainees_[i].learner->Begin(batches_[i]);
    }
  }
  checkpoint_time_ = Now();
  return Status::Ok();
}

// In pieces, so that Ctrl-C need not wait for the end of a long update: what is left of it is learned on resume.
void Training::LearnWhatIsDue() {
  for (Trainee& trainee : trainees_) {
    while (trainee.learner->Learn({kLearnPiece})) {
      if (stop_.load(std::memory_order_relaxed)) return;
    }
    if (trainee.learner->updates() == trainee.reported_updates) continue;
    trainee.reported_updates = trainee.learner->updates();
    report_->OnUpdate(trainee.learner->metrics(), steps(), trainee.learner->updates(),
                      trainee.learner->steps_per_update());
  }
}

Status Training::Loop() {
  std::int64_t done = steps();
  while (done < config_.steps && !stop_.load(std::memory_order_relaxed)) {
    std::int64_t rows = 0;
    for (std::size_t i = 0; i < trainees_.size(); ++i) {
      batches_[i] = trainees_[i].learner->Stage(trainees_[i].first.batch().slots);
      trainees_[i].learner->Act(batches_[i]);
      rows += batches_[i].rows();
    }
    const Status stepped = link_->Step(batches_, done + rows >= config_.steps ? MoreSteps::kLast : MoreSteps::kYes);
    if (!stepped.ok()) return stepped;
    done += rows;
    for (std::size_t i = 0; i < trainees_.size(); ++i) CONSAC_RETURN_IF_ERROR(trainees_[i].watch.Check(batches_[i]));
    for (std::size_t i = 0; i < trainees_.size(); ++i) {
      trainees_[i].learner->Record(batches_[i]);
      trainees_[i].episodes.Add(batches_[i], done, *report_);
    }
    double reward = 0.0;
    for (const Batch& batch : batches_) {
      for (std::int64_t i = 0; i < batch.rows(); ++i) reward += batch.rewards[i];
    }
    report_->OnStep(done, reward);
    LearnWhatIsDue();
    for (const Trainee& trainee : trainees_) CONSAC_RETURN_IF_ERROR(trainee.learner->health());
    if (CheckpointDue()) (void)Checkpoint();
  }
  return Status::Ok();
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

Status Training::Checkpoint() {
  StateWriter writer;
  std::int64_t at = steps();
  std::string instruction_set(nn::InstructionSet());
  writer("steps", at);
  writer("instruction_set", instruction_set);
  Visit(writer);
  const Status status = writer.status().ok()
                            ? directory_->SaveCheckpoint(at, writer.fields(), Description(), config_.keep_checkpoints)
                            : writer.status();
  checkpoint_time_ = Now();
  checkpoint_updates_ = trainees_[0].learner->updates();
  if (!status.ok() && !save_failed_) {
    report_->Line("error: a checkpoint could not be saved: " + status.message() +
                  "; training goes on, the last good one stays");
  }
  save_failed_ = !status.ok();
  return status;
}

std::string Training::ModelPath(const std::string& behaviour) const {
  return directory_->File(trainees_.size() == 1 ? "model.consac" : behaviour + ".consac");
}

Status Training::SaveModel() {
  for (const Trainee& trainee : trainees_) {
    PolicyData data = trainee.learner->Snapshot();
    nlohmann::json training = nlohmann::json::parse(data.training_json, nullptr, false);
    training["algorithm"] = config_.algorithm;
    training["world"] = link_->spec().id.empty() ? config_.world : link_->spec().id;
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
  // The checkpoint first: it holds more, and --resume needs it.
  // Each is tried, whatever became of the others.
  const Status checkpoint = Checkpoint(), model = SaveModel(), report = report_->Finish();
  for (const Status& status : {checkpoint, model, report}) CONSAC_RETURN_IF_ERROR(status);
  RunSummary summary;
  summary.directory = directory_->path();
  summary.model_path = ModelPath(link_->spec().behaviours[0].name);
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
