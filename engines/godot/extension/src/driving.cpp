// Who drives a ConsacWorld, and what is kept of it.
#include <algorithm>
#include <cmath>

#include "consac/base/names.h"
#include "files.h"
#include "interrupts.h"
#include "options.h"
#include "world.h"

namespace consac::godot {
namespace {

// The longest that one call holds the engine up.
constexpr double kLongestWait_s = 60.0;

// Every file's bytes, in the order of the paths.
Result<std::vector<std::vector<std::byte>>> ReadAll(const std::vector<std::string>& paths) {
  std::vector<std::vector<std::byte>> all;
  for (const std::string& path : paths) {
    Result<std::vector<std::byte>> bytes = ReadEngineFile(path);
    if (!bytes.ok()) return bytes.status();
    all.push_back(*std::move(bytes));
  }
  return all;
}

}  // namespace

void World::Refuse(const std::string& why) {
  if (driver_ != nullptr) driver_->Refuse(why);
}

void World::Close() {
  Stop();
  if (watches_) ForgetInterrupts();
  watches_ = false;
}

void World::Stop() {
  driver_.reset();
  if (world_ != nullptr) world_->Abandon();
  told_ended_ = 0;
}

Status World::Drive(Result<std::unique_ptr<host::Driver>> driver) {
  if (!driver.ok()) {
    world_->Abandon();
    return driver.status();
  }
  driver_ = *std::move(driver);
  return Status::Ok();
}

Status World::Serve(const Dictionary& options) {
  CONSAC_RETURN_IF_ERROR(Ready());
  const Result<host::ServeOptions> read = ReadServe(options);
  if (!read.ok()) return read.status();
  Stop();
  return Drive(host::Serve(*world_, *read));
}

Status World::Train(const Dictionary& options) {
  CONSAC_RETURN_IF_ERROR(Ready());
  std::vector<std::string> start_from;
  Result<host::TrainOptions> read = ReadTrain(options, &start_from);
  if (!read.ok()) return read.status();
  Result<std::vector<std::vector<std::byte>>> models = ReadAll(start_from);
  if (!models.ok()) return models.status();
  read->start_from = *std::move(models);
  if (!read->log_folder.empty()) {
    Result<std::string> folder = PathToWrite(read->log_folder);
    if (!folder.ok()) return folder.status();
    read->log_folder = *std::move(folder);
  }
  Stop();
  return Drive(host::Train(*world_, *read));
}

Status World::Act(const Dictionary& options) {
  CONSAC_RETURN_IF_ERROR(Ready());
  const Result<host::ActOptions> read = ReadAct(options);
  if (!read.ok()) return read.status();
  if (read->models.size() != rows_.size()) {
    return {StatusCode::kInvalidArgument, "act: 'models' has " + std::to_string(read->models.size()) +
                                              " paths; expected one for each of " + std::to_string(rows_.size()) +
                                              " behaviours"};
  }
  const Result<std::vector<std::vector<std::byte>>> models = ReadAll(read->models);
  if (!models.ok()) return models.status();
  Stop();
  const Status status = Drive(host::Act(*world_, *models, *read));
  if (status.ok()) return status;
  std::string paths;
  for (const std::string& path : read->models) paths += (paths.empty() ? "" : ", ") + path;
  return {status.code(), paths + ": " + status.message()};
}

Status World::ByHand(std::int64_t seed) {
  CONSAC_RETURN_IF_ERROR(Ready());
  Stop();
  driver_ = host::ByHand(*world_, static_cast<std::uint64_t>(seed));
  return Status::Ok();
}

std::int64_t World::Poll(double wait_s) {
  constexpr char kWhere[] = "ConsacWorld.poll";
  if (driver_ == nullptr) {
    Report(kWhere, {StatusCode::kFailedPrecondition,
                    "nobody drives the world; call serve(), train(), act() or by_hand() first"});
    return static_cast<std::int64_t>(Cue::kFailed);
  }
  const Status status = driver_->Poll(std::isfinite(wait_s) ? std::clamp(wait_s, 0.0, kLongestWait_s) : 0.0);
  if (!status.ok()) {
    Report(kWhere, status);
    return static_cast<std::int64_t>(Cue::kFailed);
  }
  if (driver_->ended() != told_ended_) {
    told_ended_ = driver_->ended();
    return static_cast<std::int64_t>(Cue::kDone);
  }
  switch (world_->cue()) {
    case host::Cue::kWait:
      return static_cast<std::int64_t>(Cue::kWait);
    case host::Cue::kReset:
      return static_cast<std::int64_t>(Cue::kReset);
    case host::Cue::kAct:
      return static_cast<std::int64_t>(Cue::kAct);
  }
  return static_cast<std::int64_t>(Cue::kWait);
}

Status World::Offer() {
  CONSAC_RETURN_IF_ERROR(Ready());
  for (Rows& rows : rows_) {
    if (rows.recorder != nullptr && world_->cue() != host::Cue::kWait) rows.recorder->Note();
  }
  return world_->Offer();
}

std::int64_t World::Port() {
  return driver_ != nullptr ? driver_->port() : 0;
}

bool World::Finished() {
  return driver_ != nullptr && driver_->finished();
}

void World::WatchInterrupts() {
  if (!watches_) CatchInterrupts();
  watches_ = true;
}

bool World::WasInterrupted() {
  return Interrupted();
}

void World::SetPaused(bool paused) {
  if (driver_ != nullptr) driver_->SetPaused(paused);
}

Dictionary World::Progress() {
  Dictionary table;
  const host::Progress progress = driver_ != nullptr ? driver_->progress() : host::Progress{};
  table.Set("state", Variant::Of(driver_ != nullptr ? std::string_view(progress.state) : "nobody drives the world"));
  table.Set("steps", Variant::Of(progress.steps));
  table.Set("all_steps", Variant::Of(progress.tally.steps));
  table.Set("episodes", Variant::Of(progress.tally.episodes));
  table.Set("mean_episode_reward", Variant::Of(progress.tally.mean_episode_reward));
  table.Set("mean_episode_length", Variant::Of(progress.tally.mean_episode_length));
  table.Set("total_steps", Variant::Of(progress.total_steps));
  table.Set("updates", Variant::Of(progress.updates));
  table.Set("agent_steps_per_s", Variant::Of(progress.agent_steps_per_s));
  table.Set("poll_ms", Variant::Of(progress.poll_ms));
  return table;
}

bool World::Learned(std::int64_t behaviour) {
  return driver_ != nullptr && All(behaviour).ok() && driver_->learned(static_cast<std::size_t>(behaviour));
}

Status World::SaveModel(std::int64_t behaviour, const std::string& path) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  if (driver_ == nullptr) return {StatusCode::kFailedPrecondition, "nobody drives the world, so there is no model"};
  const Result<std::string> file = PathToWrite(path);
  if (!file.ok()) return file.status();
  return driver_->SaveModel(static_cast<std::size_t>(behaviour), *file);
}

Status World::Record(std::int64_t behaviour) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  part->rows->recorder = std::make_unique<host::Recorder>(*world_, static_cast<std::size_t>(behaviour));
  return Status::Ok();
}

std::string World::FileOf(const std::string& name) {
  return FileNameOf(name, "");
}

std::int64_t World::RecordedSteps(std::int64_t behaviour) {
  const Result<Part> part = All(behaviour);
  return part.ok() && part->rows->recorder != nullptr ? part->rows->recorder->steps() : 0;
}

Status World::SaveRecording(std::int64_t behaviour, const std::string& path) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  if (part->rows->recorder == nullptr)
    return {StatusCode::kFailedPrecondition, "nothing of this behaviour is recorded; call record() first"};
  const Result<std::string> file = PathToWrite(path);
  if (!file.ok()) return file.status();
  return part->rows->recorder->Save(*file);
}

Array World::ListAlgorithms() {
  return DescribeAlgorithms();
}

Result<Array> World::ListHyperparameters(const std::string& algorithm) {
  return DescribeHyperparameters(algorithm);
}

}  // namespace consac::godot
