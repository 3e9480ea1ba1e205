// The training loop: stage, act, step, record, learn, report, checkpoint; the same for a world in this process and
// for an engine.
#include "consac/run/training.h"

#include <fmt/format.h>

#include <chrono>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>
#include <thread>

#include "consac/base/file.h"
#include "consac/base/text.h"
#include "consac/env/buffer.h"
#include "consac/nn/kernels.h"
#include "consac/run/report.h"
#include "consac/run/run_directory.h"
#include "acting.h"
#include "link.h"
#include "resume.h"
#include "consac/run/thread_pool.h"

namespace consac::run {
namespace {

constexpr std::int64_t kDefaultSteps = 100000;
constexpr std::int64_t kLearnPiece = 64;  // optimiser steps between looks at `stop`
constexpr double kAfterFailure = 1.0;  // s before an engine that broke a session is tried again

/// Sums of the episodes under way.
class EpisodeSums {
 public:
  explicit EpisodeSums(std::int32_t slots) : rewards_(static_cast<std::size_t>(slots)), lengths_(static_cast<std::size_t>(slots)) {}

  /// Adds one step; tells the report of episodes that ended.
  void Add(const Batch& batch, std::int64_t steps, Report& report) {
    for (std::size_t i = 0; i < batch.slots.size(); ++i) {
      const auto slot = static_cast<std::size_t>(batch.slots[i]);
      rewards_[slot] += batch.rewards[i];
      ++lengths_[slot];
      if ((batch.terminated[i] | batch.truncated[i]) == 0) continue;
      report.OnEpisode({batch.slots[i], rewards_[slot], lengths_[slot], steps});
      Clear(slot);
    }
  }
  void Clear(std::size_t slot) {
    rewards_[slot] = 0.0;
    lengths_[slot] = 0;
  }
  void Visit(Archive& archive) {
    archive("rewards", std::span<double>(rewards_));
    archive("lengths", std::span<std::int64_t>(lengths_));
  }

 private:
  std::vector<double> rewards_;          // [slots] of the episode under way
  std::vector<std::int64_t> lengths_;    // [slots] of the episode under way
};

/// What is learned for one behaviour.
struct Pupil {
  std::unique_ptr<learn::Learner> learner;
  BatchBuffer first;      // where first observations arrive
  EpisodeSums episodes;
  std::int64_t reported_updates = 0;
};

/// Who says how long the training is.
enum class Length : std::uint8_t { kOfCaller, kOfEngine };

/// One run under way.
class Training {
 public:
  Training(RunConfig config, Length length, const std::atomic<bool>& stop)
      : config_(std::move(config)), length_(length), stop_(stop), pool_(config_.threads) {}

  Status Start(std::unique_ptr<WorldLink> link);
  Status Loop();
  Status SaveModel();
  Result<RunSummary> Finish(double seconds);
  Report& report() { return *report_; }
  const RunConfig& config() const { return config_; }
  std::int64_t steps() const;

 private:
  Status MakePupils();
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
  std::vector<Pupil> pupils_;  // one per behaviour of the world, in its order
  std::int64_t slots_ = 0;     // agents of all behaviours
  std::vector<Batch> batches_;
  const learn::Algorithm* algorithm_ = nullptr;
  bool restored_ = false;  // from a checkpoint, be it of step 0
  std::int64_t restored_steps_ = 0, checkpoint_updates_ = 0;
  double checkpoint_time_ = 0.0;
  bool save_failed_ = false;
};

std::int64_t Training::steps() const {
  std::int64_t sum = 0;
  for (const Pupil& pupil : pupils_) sum += pupil.learner->steps();
  return sum;
}

// Of config_.steps, the steps of one behaviour's agents: what its learner's schedules run over.
std::int64_t Training::ShareOfSteps(const BehaviourSpec& behaviour) const {
  const double share = static_cast<double>(behaviour.slots) / static_cast<double>(slots_);
  return static_cast<std::int64_t>(static_cast<double>(config_.steps) * share + 0.5);
}

Status Training::MakePupils() {
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
    pupils_.push_back({std::move(*learner), BatchBuffer(behaviour), EpisodeSums(behaviour.slots)});
  }
  batches_.resize(pupils_.size());
  return Status::Ok();
}

void Training::Visit(Archive& archive) {
  for (Pupil& pupil : pupils_) {
    const std::string name = pupils_.size() == 1 ? "learner" : "learner" + std::to_string(&pupil - pupils_.data());
    archive(name, *pupil.learner);
    archive(name + "_episodes", pupil.episodes);
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
  options.slots = pupils_[0].first.batch().slots.empty() ? 1 : static_cast<std::int32_t>(pupils_[0].first.batch().rows());
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
      Log(LogLevel::kWarning, "this run was trained with " + then + " kernels and goes on with " + std::string(nn::InstructionSet()) +
                                  "; results will differ in the last digits");
    }
  }
  restored_ = true;
  CONSAC_RETURN_IF_ERROR(OpenReport(true));
  StateReader reader(*state);
  Visit(reader);
  if (!reader.status().ok()) return {reader.status().code(), "cannot resume '" + directory_->path() + "': " + reader.status().message()};
  for (std::size_t i = 0; i < pupils_.size(); ++i) {
    pupils_[i].learner->SetTotalSteps(ShareOfSteps(link_->spec().behaviours[i]));
    pupils_[i].reported_updates = pupils_[i].learner->updates();
  }
  checkpoint_updates_ = pupils_[0].learner->updates();
  return Status::Ok();
}

Status Training::WriteConfig() const {
  const std::string yaml = WriteYaml(config_);
  return WriteFileAtomically(directory_->File("config.yaml"), std::as_bytes(std::span(yaml)));
}

Status Training::Start(std::unique_ptr<WorldLink> link) {
  link_ = std::move(link);
  CONSAC_RETURN_IF_ERROR(MakePupils());
  const ExistingRun existing = config_.resume ? ExistingRun::kResume : config_.force ? ExistingRun::kOverwrite : ExistingRun::kRefuse;
  Result<std::unique_ptr<RunDirectory>> directory = RunDirectory::Open(config_.directory, config_.name, existing);
  if (!directory.ok()) return directory.status();
  directory_ = std::move(*directory);
  CONSAC_RETURN_IF_ERROR(WriteConfig());
  if (config_.resume) CONSAC_RETURN_IF_ERROR(Restore());
  else CONSAC_RETURN_IF_ERROR(OpenReport(false));

  LearnWhatIsDue();
  const bool world_restored = restored_ && !IsUrl(config_.world);
  if (!world_restored) {
    for (std::size_t i = 0; i < pupils_.size(); ++i) batches_[i] = pupils_[i].first.batch();
    CONSAC_RETURN_IF_ERROR(link_->Reset(config_.seed, batches_));
    for (std::size_t i = 0; i < pupils_.size(); ++i) pupils_[i].learner->Begin(batches_[i]);
  }
  checkpoint_time_ = Now();
  return Status::Ok();
}

// In pieces, so that Ctrl-C need not wait for the end of a long update: what is left of it is learned on resume.
void Training::LearnWhatIsDue() {
  for (Pupil& pupil : pupils_) {
    while (pupil.learner->Learn({kLearnPiece})) {
      if (stop_.load(std::memory_order_relaxed)) return;
    }
    if (pupil.learner->updates() == pupil.reported_updates) continue;
    pupil.reported_updates = pupil.learner->updates();
    report_->OnUpdate(pupil.learner->metrics(), steps(), pupil.learner->updates(), pupil.learner->steps_per_update());
  }
}

Status Training::Loop() {
  std::int64_t done = steps();
  while (done < config_.steps && !stop_.load(std::memory_order_relaxed)) {
    std::int64_t rows = 0;
    for (std::size_t i = 0; i < pupils_.size(); ++i) {
      batches_[i] = pupils_[i].learner->Stage(pupils_[i].first.batch().slots);
      pupils_[i].learner->Act(batches_[i]);
      rows += batches_[i].rows();
    }
    const Status stepped = link_->Step(batches_, done + rows >= config_.steps ? MoreSteps::kLast : MoreSteps::kYes);
    if (!stepped.ok()) return stepped;
    done += rows;
    for (std::size_t i = 0; i < pupils_.size(); ++i) {
      pupils_[i].learner->Record(batches_[i]);
      pupils_[i].episodes.Add(batches_[i], done, *report_);
    }
    double reward = 0.0;
    for (const Batch& batch : batches_) {
      for (std::int64_t i = 0; i < batch.rows(); ++i) reward += batch.rewards[i];
    }
    report_->OnStep(done, reward);
    LearnWhatIsDue();
    if (CheckpointDue()) (void)Checkpoint();
  }
  return Status::Ok();
}

bool Training::CheckpointDue() const {
  const std::int64_t updates = pupils_[0].learner->updates();
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
  const Status status = writer.status().ok() ? directory_->SaveCheckpoint(at, writer.fields(), Description(), config_.keep_checkpoints) : writer.status();
  checkpoint_time_ = Now();
  checkpoint_updates_ = pupils_[0].learner->updates();
  if (!status.ok() && !save_failed_) {
    report_->Line("error: a checkpoint could not be saved: " + status.message() + "; training goes on, the last good one stays");
  }
  save_failed_ = !status.ok();
  return status;
}

Status Training::SaveModel() {
  for (const Pupil& pupil : pupils_) {
    PolicyData data = pupil.learner->Snapshot();
    nlohmann::json training = nlohmann::json::parse(data.training_json, nullptr, false);
    training["algorithm"] = config_.algorithm;
    training["world"] = link_->spec().id.empty() ? config_.world : link_->spec().id;
    training["seed"] = config_.seed;
    data.training_json = training.dump();
    const std::string name = pupils_.size() == 1 ? "model.consac" : data.behaviour + ".consac";
    const Result<Policy> policy = Policy::Create(std::move(data), 1);
    if (!policy.ok()) return policy.status();
    CONSAC_RETURN_IF_ERROR(policy->ToFile(config_.seed).Save(directory_->File(name)));
  }
  return Status::Ok();
}

Result<RunSummary> Training::Finish(double seconds) {
  // The checkpoint first: it holds more, and --resume needs it.
  const Status checkpoint = Checkpoint();
  CONSAC_RETURN_IF_ERROR(SaveModel());
  const Status report = report_->Finish();
  if (!checkpoint.ok()) return checkpoint;
  if (!report.ok()) return report;
  RunSummary summary;
  summary.directory = directory_->path();
  summary.model_path = directory_->File("model.consac");
  summary.steps = steps();
  summary.updates = pupils_[0].learner->updates();
  summary.seconds = seconds;
  summary.mean_episode_reward = report_->mean_episode_reward();
  summary.interrupted = summary.steps < config_.steps;
  for (const Pupil& pupil : pupils_) summary.interrupted = summary.interrupted || pupil.learner->LearningDue();
  StateHasher hasher;
  for (const Pupil& pupil : pupils_) {
    PolicyData data = pupil.learner->Snapshot();
    hasher("parameters", data.parameters);
    hasher("log_std", data.log_std);
  }
  summary.weights_hash = hasher.hash();
  return summary;
}

std::string DefaultName(const RunConfig& config, const WorldLink& link) {
  const std::string& id = link.spec().id;
  return fmt::format("{}__{}__{}", id.empty() ? "engine" : id, config.algorithm, config.seed);
}

/// The name, or the name with the first number behind it that no run has: one session after another has its own.
std::string UnusedName(const RunConfig& config) {
  std::error_code ignored;
  std::string name = config.name;
  for (int i = 2; std::filesystem::exists(config.directory + "/" + name + "/config.yaml", ignored); ++i) name = fmt::format("{}_{}", config.name, i);
  return name;
}

/// One session or run with a world that is there.
Result<RunSummary> RunOnce(RunConfig config, Length length, std::unique_ptr<WorldLink> link, const std::atomic<bool>& stop) {
  const SessionRequest request = link->request();
  const bool engine = IsUrl(config.world);
  if (engine && request.training_length == 0 && length == Length::kOfEngine) return ActForEngine(config, *link, stop);
  if (config.steps < 0) config.steps = engine ? request.training_length : kDefaultSteps;
  if (config.name.empty()) config.name = engine && !request.model_name.empty() ? request.model_name : DefaultName(config, *link);
  if (config.forever && request.model_name.empty() && !config.force) config.name = UnusedName(config);
  if (!engine) config.steps = std::max<std::int64_t>(config.steps, 1);
  const std::string where = link->description();

  Training training(config, length, stop);
  CONSAC_RETURN_IF_ERROR(training.Start(std::move(link)));
  if (config.table || config.progress) {
    training.report().Line(fmt::format("training {} on {} for {} steps, seed {}, {} kernels -> {}/{}", config.algorithm, where, training.config().steps,
                                       config.seed, nn::InstructionSet(), config.directory, config.name));
  }
  const double start = Now();
  const Status looped = training.Loop();
  Result<RunSummary> summary = training.Finish(Now() - start);
  if (!summary.ok()) return summary;
  if (!looped.ok() && looped.code() != StatusCode::kCancelled) {
    return Status{looped.code(), fmt::format("{}; {} of {} steps are missing, what was learned is saved in '{}' (go on with --resume --name {})",
                                             looped.message(), training.config().steps - summary->steps, training.config().steps, summary->directory, config.name)};
  }
  if (!summary->interrupted && (config.table || config.progress)) {
    training.report().Line(fmt::format("training completed: {} steps in {:.2f} s, model {}", summary->steps, summary->seconds, summary->model_path));
  }
  return summary;
}

void Say(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

/// Waits `seconds`, or until `stop`.
void Pause(double seconds, const std::atomic<bool>& stop) {
  for (const double end = Now() + seconds; Now() < end && !stop.load();) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

/// One session with an engine, or one after another until `stop`: then what breaks a session is said and the next awaited.
Result<RunSummary> ServeEngine(const RunConfig& config, Length length, const std::atomic<bool>& stop) {
  EngineOptions options;
  options.url = config.world;
  options.connect_timeout_s = config.connect_timeout_s;
  options.client.deadline_s = config.deadline_s;
  options.client.quiet_s = config.quiet_s;
  options.client.answer_done = config.answer_done;
  options.client.stop = &stop;
  Result<RunSummary> last = RunSummary{};
  do {
    Result<std::unique_ptr<WorldLink>> link = ConnectEngine(options, Say);
    const bool nobody = !link.ok() && link.status().code() == StatusCode::kUnavailable;
    if (link.ok()) last = RunOnce(config, length, std::move(*link), stop);
    else last = link.status();
    if (last.ok() || !config.forever || stop.load()) continue;
    if (!nobody) Say("error: " + last.status().message());
    Pause(kAfterFailure, stop);
  } while (config.forever && !stop.load());
  const bool stopped = stop.load() && (config.forever || (!last.ok() && last.status().code() == StatusCode::kCancelled));
  if (!stopped || (last.ok() && last->interrupted)) return last;
  RunSummary summary;
  summary.interrupted = true;
  return summary;
}

}  // namespace

Result<RunSummary> Train(const RunConfig& asked, const std::atomic<bool>& stop) {
  RunConfig config = asked;
  if (asked.resume) {
    Result<RunConfig> resumed = ResumedConfig(asked);
    if (!resumed.ok()) return resumed.status();
    config = std::move(*resumed);
  }
  if (!IsUrl(config.world)) {
    if (config.world.empty()) return Status{StatusCode::kInvalidArgument, "nothing to train on; name a world (consac list worlds) or tcp://host:port"};
    Result<std::unique_ptr<WorldLink>> link = MakeLocalLink(config.world, config.envs);
    if (!link.ok()) return link.status();
    return RunOnce(std::move(config), Length::kOfCaller, std::move(*link), stop);
  }
  return ServeEngine(config, asked.steps >= 0 ? Length::kOfCaller : Length::kOfEngine, stop);
}

}  // namespace consac::run
