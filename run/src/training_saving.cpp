// What of a run is on disk: the checkpoint that it goes on from, and the models that act.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "config_fields.h"
#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/nn/kernels.h"
#include "counts.h"
#include "offer.h"
#include "row_segments.h"
#include "state_size.h"
#include "training_loop.h"

namespace consac::run {
namespace {

// Of a checkpoint, beside what learners hold: its header, logs of each behaviour, texts.
constexpr std::size_t kBesideState = std::size_t{64} << 20, kLogBytes = std::size_t{256} << 10;

constexpr const char* kGoal = "reached";  // the mean reward at which a training has ended

/// What a checkpoint says under `name`; `value` stays where it says nothing.
template <class Number>
void ReadNumber(const StateMap& state, const char* name, Number* value) {
  const auto at = state.find(name);
  if (at != state.end() && at->second.bytes.size() == sizeof(Number))
    std::memcpy(value, at->second.bytes.data(), sizeof(Number));
}

/// The text that a checkpoint holds under `name`; "" where it holds none.
std::string TextIn(const StateMap& state, std::string_view name) {
  const auto at = state.find(name);
  if (at == state.end()) return {};
  return {reinterpret_cast<const char*>(at->second.bytes.data()), at->second.bytes.size()};
}

/// "seed=1\nenvs=2\n" by name.
std::map<std::string, std::string, std::less<>> SettingsIn(std::string_view lines) {
  std::map<std::string, std::string, std::less<>> settings;
  while (!lines.empty()) {
    const std::string_view line = lines.substr(0, lines.find('\n'));
    lines.remove_prefix(std::min(lines.size(), line.size() + 1));
    const std::size_t equals = line.find('=');
    if (equals != line.npos) settings.emplace(line.substr(0, equals), line.substr(equals + 1));
  }
  return settings;
}

}  // namespace

/// About what saving takes: the state is collected, encoded and written, and once more for the models; a curve is
/// drawn, with fonts.
std::size_t Training::SavingBytes() {
  constexpr std::size_t kCopies = 4, kBeside = std::size_t{64} << 20;
  StateSize state;
  Visit(state);
  return kCopies * state.bytes() + kBeside;
}

// The header of a file has limits (budget.h); a checkpoint beyond them could be written and never read. Rollouts, which
// are most of it, have been looked at before they were made.
Status Training::CheckCheckpointFits() {
  constexpr std::size_t kMostFields = 100'000;
  StateSize state;
  for (const Trainee& trainee : trainees_) trainee.learner->Visit(state);
  if (state.bytes() > kMostStateBytes) {
    return {StatusCode::kResourceExhausted, "a checkpoint would have " + std::to_string(state.bytes() >> 20) +
                                                " MiB, of which at most " + std::to_string(kMostStateBytes >> 20) +
                                                " are read again; lower n_steps, --envs or the network"};
  }
  if (IsUrl(config_.world)) return Status::Ok();
  crew_[0].link().Visit(state);
  if (state.fields() <= kMostFields) return Status::Ok();
  return {StatusCode::kResourceExhausted,
          std::to_string(config_.envs) + " copies of the world have " + std::to_string(state.fields()) +
              " fields to save, and a checkpoint takes " + std::to_string(kMostFields) + "; lower --envs"};
}

void Training::VisitLearners(Archive& archive) {
  for (Trainee& trainee : trainees_) {
    const std::string name =
        trainees_.size() == 1 ? "learner" : "learner" + std::to_string(&trainee - trainees_.data());
    archive(name, *trainee.learner);
    archive(name + "_episodes", trainee.episodes);
  }
  if (!IsUrl(config_.world)) archive("world", crew_[0].link());
  for (std::size_t i = 0; i < crew_.size(); ++i)
    crew_[i].VisitParameters("environment_parameters" + (i == 0 ? "" : std::to_string(i)), archive);
}

void Training::Visit(Archive& archive) {
  VisitLearners(archive);
  archive("report", *report_);
}

// What learners hold is within max_memory_mib, and what a world holds is known: so much is read, and no more.
std::size_t Training::LargestCheckpoint() {
  StateSize world;
  if (!IsUrl(config_.world)) crew_[0].link().Visit(world);
  return (static_cast<std::size_t>(config_.max_memory_mib) << 20) + world.bytes() + kBesideState +
         trainees_.size() * kLogBytes;
}

Status Training::CannotResume(const Status& why) const {
  return {why.code(), "cannot resume '" + directory_->path() + "': " + why.message()};
}

// Learners have taken the checkpoint's word for what they have counted; the run has taken its own for all of them.
Status Training::CheckSteps() const {
  std::int64_t left = restored_steps_;
  for (const Trainee& trainee : trainees_) left -= std::min(trainee.learner->steps(), left + 1);
  if (left == 0) return Status::Ok();
  return {StatusCode::kDataLoss, "state field 'steps' is " + std::to_string(restored_steps_) +
                                     ", which is not what its learners come to together; the checkpoint was changed "
                                     "by somebody else's hand"};
}

// A number that is meant as so many steps more would end in nothing. What was rounded up to whole steps of all agents
// is no less than was asked for.
Status Training::CheckMoreToTrain() const {
  std::int64_t slots = 0;
  for (const Trainee& trainee : trainees_) slots += trainee.episodes.slots();
  const bool asked = std::find(config_.given.begin(), config_.given.end(), "steps") != config_.given.end();
  if (!asked || restored_steps_ - config_.steps < slots) return Status::Ok();
  return {StatusCode::kInvalidArgument,
          fmt::format("run '{}' has {} steps, and steps are counted from its beginning: {} more are --steps {}",
                      directory_->path(), restored_steps_, config_.steps, restored_steps_ + config_.steps)};
}

// Everything is judged before a file of the run is touched. The report needs to know where a resumed run stands before
// it opens its files, and is itself part of the state: it comes last.
Status Training::Restore() {
  const Result<StateMap> state = directory_->LoadCheckpoint(LargestCheckpoint());
  if (!state.ok()) {
    if (state.status().code() != StatusCode::kNotFound) return state.status();
    std::error_code ignored;
    if (std::filesystem::exists(ToPath(ModelPath(spec().behaviours[0])), ignored)) {
      return {StatusCode::kDataLoss, "run '" + directory_->path() +
                                         "' has a model but no checkpoint to go on from; train anew under another "
                                         "--name, or over it with --force"};
    }
    CONSAC_RETURN_IF_ERROR(OpenReport(false));  // killed before its first checkpoint: from the start
    return Status::Ok();
  }
  CONSAC_RETURN_IF_ERROR(CheckIdentity(*state));
  CONSAC_RETURN_IF_ERROR(CheckOffer(*state));
  if (const Status counts = CheckCounts(*state); !counts.ok())
    return CannotResume({counts.code(), counts.message() + "; the checkpoint was changed by somebody else's hand"});
  ReadNumber(*state, "steps", &restored_steps_);
  ReadNumber(*state, "next_evaluation", &next_evaluation_);
  ReadNumber(*state, "best_evaluation", &best_evaluation_);
  ReadNumber(*state, kGoal, &reached_goal_);
  goal_reached_ = goal_.has_value() && reached_goal_ >= *goal_;
  // A finished run that an engine asks to train again trains that much longer.
  if (length_ == Length::kOfEngine && restored_steps_ >= config_.steps) {
    const std::int64_t more = crew_[0].link().request().training_length;
    config_.steps = restored_steps_ + std::min(more, kMostSteps - restored_steps_);
  }
  CONSAC_RETURN_IF_ERROR(CheckMoreToTrain());
  const std::string then = TextIn(*state, "instruction_set");
  if (!then.empty() && then != nn::InstructionSet()) {
    Log(LogLevel::kWarning, "this run was trained with " + then + " kernels and goes on with " +
                                std::string(nn::InstructionSet()) + "; results will differ in the last digits");
  }
  restored_ = true;
  CheckpointReader reader(*state, directory_->segments());
  VisitLearners(reader);
  if (!reader.status().ok()) return CannotResume(reader.status());
  if (const Status steps = CheckSteps(); !steps.ok()) return CannotResume(steps);
  CONSAC_RETURN_IF_ERROR(OpenReport(true));
  reader("report", *report_);
  if (!reader.status().ok()) return CannotResume(reader.status());
  for (std::size_t i = 0; i < trainees_.size(); ++i) {
    trainees_[i].learner->SetTotalSteps(ShareOfSteps(trainees_[i].episodes.slots()));
    trainees_[i].reports = trainees_[i].learner->reports();
    trainees_[i].saved_updates = trainees_[i].learner->updates();
    trainees_[i].saved_steps = trainees_[i].learner->steps();
  }
  if (config_.quiet) return Status::Ok();
  if (goal_reached_) {
    report_->Line(fmt::format("stop_reward {} has been reached: the training ended after {} steps", config_.stop_reward,
                              restored_steps_));
  } else if (restored_steps_ >= config_.steps) {
    report_->Line(fmt::format("the run has all of its {} steps; --steps {} trains as many more", restored_steps_,
                              2 * restored_steps_));
  } else {
    report_->Line("going on from step " + std::to_string(restored_steps_));
  }
  return Status::Ok();
}

bool Training::CheckpointDue() const {
  std::int64_t unsaved = 0;  // updates of the behaviour that has made most of them
  bool remembered = false;   // steps that are learned from later, over and over
  for (const Trainee& trainee : trainees_) {
    unsaved = std::max(unsaved, trainee.learner->updates() - trainee.saved_updates);
    remembered = remembered || (trainee.learner->memory_bytes() > 0 && trainee.learner->steps() != trainee.saved_steps);
  }
  if (unsaved == 0 && !remembered) return false;  // between updates a rollout is all there is to lose
  if (config_.checkpoint_every_updates > 0) return unsaved >= config_.checkpoint_every_updates;
  return config_.checkpoint_every_s > 0 &&
         clock_.looked() - checkpoint_time_ >= static_cast<double>(config_.checkpoint_every_s);
}

// Its settings that no resumed run may change, a line each. Engines move.
std::string Training::Identity() const {
  std::string lines;
  for (const Field& field : Fields()) {
    const bool moves = field.name == std::string_view("world") && IsUrl(config_.world);
    if (field.on_resume == OnResume::kMustStay && !moves)
      lines += std::string(field.name) + "=" + FieldText(field, config_) + "\n";
  }
  const Result<learn::HyperparameterSet> values = HyperparametersOf(config_);
  if (!values.ok()) return lines;
  for (const learn::Hyperparameter& row : values->table())
    lines += std::string(row.name) + "=" + values->Text(row.name) + "\n";
  return lines;
}

// A setting that this program does not know, or that the checkpoint does not name, decides nothing.
Status Training::CheckIdentity(const StateMap& state) const {
  const std::map<std::string, std::string, std::less<>> then = SettingsIn(TextIn(state, "run")),
                                                        now = SettingsIn(Identity());
  for (const auto& [name, value] : then) {
    const auto here = now.find(name);
    if (here == now.end() || here->second == value) continue;
    return {StatusCode::kDataLoss, "the newest checkpoint in '" + directory_->path() + "' is another run's: of " +
                                       name + " = " + Quote(value) + ", where config.yaml says " + Quote(here->second) +
                                       "; take it away, or train anew with --force"};
  }
  return Status::Ok();
}

std::string Training::Offer() const {
  std::vector<std::int64_t> slots;
  for (const Trainee& trainee : trainees_) slots.push_back(trainee.episodes.slots());
  return OfferText(spec(), slots);
}

// An engine with other bounds or another behaviour would be learned with what belongs to the first one. Checkpoints of
// older programs do not say what it was.
Status Training::CheckOffer(const StateMap& state) {
  const std::string before = TextIn(state, "offer");
  const Status same = before.empty() ? Status::Ok() : CompareOffers(before, Offer());
  if (same.ok()) return same;
  return {same.code(), "run '" + directory_->path() + "' was trained in another world than " +
                           crew_[0].link().description() + " offers: " + same.message() +
                           "; go on in its own world, or train in this one under another --name"};
}

std::string Training::Description() const {
  return JsonText(nlohmann::json({{"kind", "checkpoint"},
                                  {"requires", {"checkpoint"}},
                                  {"world", config_.world},
                                  {"algorithm", config_.algorithm},
                                  {"steps", steps()},
                                  {"seed", config_.seed},
                                  {"instruction_set", nn::InstructionSet()}}));
}

// The checkpoint first: it holds more, and --resume needs it. Then the model, so that whoever kills the training has
// one, whatever became of the checkpoint.
Status Training::Save(Telling telling) {
  CONSAC_RETURN_IF_ERROR(directory_->CheckOurs());
  const Status checkpoint = Checkpoint(), model = SaveModels(directory_->path());
  checkpoint_time_ = Now();
  for (Trainee& trainee : trainees_) {
    trainee.saved_updates = trainee.learner->updates();
    trainee.saved_steps = trainee.learner->steps();
  }
  if (telling == Telling::kNow) {
    TellFailure("a checkpoint", checkpoint, &checkpoint_failed_);
    TellFailure("the model", model, &model_failed_);
  }
  if (checkpoint.ok() || model.ok() || checkpoint.message() == model.message())
    return checkpoint.ok() ? model : checkpoint;
  return {checkpoint.code(), checkpoint.message() + "; and " + model.message()};
}

// A run that takes another's place has all that it needs to be gone on with before the other goes, which is at the
// first step: an engine that fails there has taught nothing. Whoever loads the model has the other's until this one's
// first that has learned.
Status Training::SaveBeginning() {
  CONSAC_RETURN_IF_ERROR(Checkpoint());
  CONSAC_RETURN_IF_ERROR(SaveModels(directory_->path()));
  KeepReplacedModels();
  return Status::Ok();
}

void Training::KeepReplacedModels() const {
  for (std::size_t b = 0; b < trainees_.size(); ++b) {
    if (!trainees_[b].frozen) directory_->KeepReplacedModel(ModelFileName(spec(), spec().behaviours[b]));
  }
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
  CONSAC_RETURN_IF_ERROR(directory_->CheckOurs());
  CheckpointWriter writer(directory_->segments());
  std::int64_t at = steps();
  std::string instruction_set(nn::InstructionSet()), run = Identity(), offer = Offer();
  writer("run", run);
  writer("offer", offer);
  writer("steps", at);
  writer("instruction_set", instruction_set);
  writer("next_evaluation", next_evaluation_);
  writer("best_evaluation", best_evaluation_);
  if (goal_reached_) reached_goal_ = std::max(reached_goal_, *goal_);
  // Whoever goes on has nothing to do, unless more is wanted.
  if (reached_goal_ > -std::numeric_limits<double>::infinity()) writer(kGoal, reached_goal_);
  Visit(writer);
  CONSAC_RETURN_IF_ERROR(writer.status());
  CONSAC_RETURN_IF_ERROR(CheckCounts(writer.fields()));  // what would be refused later is no checkpoint
  return directory_->SaveCheckpoint(at, writer.fields(), Description(), config_.keep_checkpoints);
}

std::string Training::ModelPath(const BehaviourSpec& behaviour) const {
  return directory_->File(ModelFileName(spec(), behaviour));
}

std::vector<PolicyData> Training::Snapshots() const {
  std::vector<PolicyData> models;
  for (const Trainee& trainee : trainees_) models.push_back(trainee.learner->Snapshot());
  return models;
}

Status Training::SaveModels(const std::string& folder) const {
  std::vector<PolicyData> models = Snapshots();
  for (std::size_t b = 0; b < models.size(); ++b) {
    PolicyData& data = models[b];
    if (trainees_[b].frozen) {
      CONSAC_RETURN_IF_ERROR(SaveModel(std::move(data), folder, spec().behaviours[b]));
      continue;
    }
    const Result<nlohmann::json> learned = ReadJson<nlohmann::json>(data.training_json);
    nlohmann::json training = learned.ok() ? *learned : nlohmann::json::object();
    training["algorithm"] = config_.algorithm;
    training["world"] = spec().id.empty() ? config_.world : spec().id;
    training["seed"] = config_.seed;
    data.training_json = JsonText(training);
    CONSAC_RETURN_IF_ERROR(SaveModel(std::move(data), folder, spec().behaviours[b]));
  }
  return Status::Ok();
}

Status Training::SaveModel(PolicyData data, const std::string& folder, const BehaviourSpec& behaviour) const {
  const Result<Policy> policy = Policy::Create(std::move(data), 1);
  if (!policy.ok()) return policy.status();
  const std::string file = folder + "/" + ModelFileName(spec(), behaviour);
  return directory_->Write(file, policy->ToFile(config_.seed).Serialise());
}

}  // namespace consac::run
