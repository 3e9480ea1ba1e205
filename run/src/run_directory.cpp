#include "consac/run/run_directory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <nlohmann/json.hpp>

#include "consac/base/file.h"
#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/text.h"
#include "consac/model/model_file.h"
#include "consac/run/path.h"
#include "row_segments.h"
#include "system/system.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;

bool Exists(const std::string& path) {
  std::error_code ignored;
  return fs::exists(ToPath(path), ignored);
}

std::vector<std::string> FilesIn(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(ToPath(folder), error), end; !error && entry != end; entry.increment(error))
    names.push_back(FromPath(entry->path().filename()));
  return names;
}

constexpr std::string_view kModelEnd = ".consac", kHalfWritten = ".tmp-";
constexpr std::string_view kConfigFile = "config.yaml";
constexpr std::string_view kRunFiles[] = {kConfigFile, "progress.csv", "evaluations.csv"};
// Of each behaviour; where a run has several, behind its model's name: "hunter.monitor.csv".
constexpr std::string_view kBehaviourFiles[] = {"monitor.csv", "curve.svg", "curve.png"};

bool IsRunsFile(std::string_view name) {
  return std::ranges::find(kRunFiles, name) != std::end(kRunFiles) ||
         std::ranges::any_of(kBehaviourFiles, [name](std::string_view file) {
           return name.ends_with(file) && (name.size() == file.size() || name[name.size() - file.size() - 1] == '.');
         });
}

bool IsCheckpoint(std::string_view name) {
  return name.starts_with("step_") && name.ends_with(kModelEnd);
}

// What a process that was killed while it wrote has left: WriteFileAtomically's name, of a file that a run writes.
bool IsHalfWritten(std::string_view name) {
  const std::size_t at = name.rfind(kHalfWritten);
  if (at == std::string_view::npos) return false;
  const std::string_view number = name.substr(at + kHalfWritten.size()), of = name.substr(0, at);
  const bool numbered = !number.empty() && number.find_first_not_of("0123456789") == std::string_view::npos;
  return numbered && (of.ends_with(kModelEnd) || of.ends_with(kSegmentEnd) || IsRunsFile(of));
}

// What is there before config.yaml is, which is a run's first file.
bool IsUnborn(const std::string& path) {
  for (const std::string& name : FilesIn(path)) {
    const bool empty_folder = name == "checkpoints" && FilesIn(path + "/" + name).empty();
    if (name != ".lock" && !empty_folder && !IsHalfWritten(name)) return false;
  }
  return true;
}

void Remove(const std::string& path) {
  std::error_code ignored;
  fs::remove(ToPath(path), ignored);
}

void RemoveEmptyFolder(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(ToPath(path), ignored) && fs::is_empty(ToPath(path), ignored)) Remove(path);
}

// model.consac, or BEHAVIOUR.consac of that behaviour; a model that somebody put there keeps a name of its own.
bool IsOwnModel(const std::string& path, const std::string& name) {
  if (!name.ends_with(kModelEnd)) return false;
  if (name == "model.consac") return true;
  const Result<ModelFile> file = ModelFile::Load(path + "/" + name);
  if (!file.ok()) return false;
  const Result<nlohmann::json> spec = ReadJson<nlohmann::json>(file->spec_json);
  if (!spec.ok() || !spec->is_object()) return false;
  const auto interface = spec->find("interface");
  if (interface == spec->end() || !interface->is_object()) return false;
  const auto behaviour = interface->find("behaviour");
  return behaviour != interface->end() && behaviour->is_string() &&
         FileNameOf(behaviour->get_ref<const std::string&>(), kModelEnd) == name;
}

constexpr const char* kNothingRemoved = "; nothing of the old run was removed";

// A file that this run will write, or a checkpoint that goes.
Status CheckReplaceable(const std::string& file) {
  std::error_code ignored;
  const fs::file_status status = fs::status(ToPath(file), ignored);
  if (fs::exists(status) && !fs::is_regular_file(status))
    return {StatusCode::kDataLoss, "'" + file + "' is no regular file; take it away" + kNothingRemoved};
  if (IsImmutable(file))
    return {StatusCode::kDataLoss,
            "'" + file + "' may neither be replaced nor removed (chattr -i lets it)" + kNothingRemoved};
  return Status::Ok();
}

// Whatever would stop the new run is found before anything of the old one goes: each file that it writes is begun
// beside its place, all at once, for a run holds some of them open together, and one with some bytes in it.
Status CheckOverwritable(const std::string& path) {
  constexpr std::size_t kSomeBytes = 65536;
  std::error_code ignored;
  for (const char* name : {"/tensorboard", "/best"}) {
    const fs::file_status status = fs::status(ToPath(path + name), ignored);
    if (fs::exists(status) && !fs::is_directory(status))
      return {StatusCode::kDataLoss, "'" + path + name + "' is no folder; take it away" + kNothingRemoved};
  }
  const std::string checkpoints = path + "/checkpoints/", first = checkpoints + "step_000000000000.consac";
  for (const std::string& name : FilesIn(checkpoints)) {
    if (IsCheckpoint(name) || name.ends_with(kSegmentEnd)) CONSAC_RETURN_IF_ERROR(CheckReplaceable(checkpoints + name));
  }
  std::vector<std::string> files = {path + "/model.consac", first};
  for (const std::string_view name : kRunFiles) files.push_back(path + "/" + std::string(name));
  for (const std::string_view name : kBehaviourFiles) files.push_back(path + "/" + std::string(name));
  for (const std::string& file : files) CONSAC_RETURN_IF_ERROR(CheckReplaceable(file));
  const std::vector<std::byte> bytes(kSomeBytes);
  std::deque<AtomicFile> begun;
  for (const std::string& file : files) {
    Status status = begun.emplace_back().Open(file);
    if (status.ok() && file == first) status = begun.back().Write(bytes);
    if (!status.ok()) return {status.code(), status.message() + kNothingRemoved};
  }
  return Status::Ok();
}

// Or --resume would go on with it.
Status RemoveCheckpoint(const std::string& path) {
  std::error_code error;
  fs::remove(ToPath(path), error);
  if (!error) return Status::Ok();
  return {StatusCode::kDataLoss,
          "cannot remove '" + path + "' of the run to overwrite: " + error.message() + "; remove it, and try again"};
}

// Only what a run writes, but for its models, whose paths it returns; whatever else somebody put there stays, and so
// does config.yaml, by which the folder is known for a run's whenever this is interrupted: the new run writes its own
// over it.
Result<std::vector<std::string>> RemoveRun(const std::string& path) {
  std::vector<std::string> models;
  for (const std::string& name : FilesIn(path + "/checkpoints")) {
    if (IsCheckpoint(name) || name.ends_with(kSegmentEnd))
      CONSAC_RETURN_IF_ERROR(RemoveCheckpoint(path + "/checkpoints/" + name));
  }
  for (const std::string_view name : kRunFiles) {
    if (name != kConfigFile) Remove(path + "/" + std::string(name));
  }
  for (const std::string_view name : kBehaviourFiles) Remove(path + "/" + std::string(name));
  for (const std::string& logs : FilesIn(path + "/tensorboard")) {  // PPO2_1, PPO2_2
    const std::string folder = path + "/tensorboard/" + logs;
    for (const std::string& name : FilesIn(folder)) {
      if (name.starts_with("events.out.tfevents.")) Remove(folder + "/" + name);
    }
    RemoveEmptyFolder(folder);
  }
  for (const std::string& name : FilesIn(path + "/best")) {
    if (IsOwnModel(path + "/best", name)) models.push_back(path + "/best/" + name);
  }
  for (const std::string& name : FilesIn(path)) {
    if (!IsOwnModel(path, name)) continue;
    const std::string behaviour = path + "/" + name.substr(0, name.size() - kModelEnd.size()) + ".";
    for (const std::string_view file : kBehaviourFiles) Remove(behaviour + std::string(file));
    models.push_back(path + "/" + name);
  }
  return models;
}

// Whoever opens a pipe waits for ever, and whoever appends to a link writes into a file that is no run's.
Status CheckFiles(const std::string& path) {
  for (const std::string& name : FilesIn(path)) {
    if (!IsRunsFile(name)) continue;
    const std::string file = path + "/" + name;
    std::error_code ignored;
    if (fs::is_symlink(ToPath(file), ignored))
      return {StatusCode::kDataLoss,
              "'" + file + "' is a link and no file of this run; put the file there, or take it away"};
    if (fs::is_fifo(ToPath(file), ignored))
      return {StatusCode::kDataLoss, "'" + file + "' is a pipe and no file; take it away"};
  }
  return Status::Ok();
}

Status CannotBeRead(const std::string& checkpoint, const Status& why) {
  return {StatusCode::kDataLoss, "checkpoint '" + checkpoint + "' cannot be read (" + why.message() +
                                     "), and may be whole; make it readable, or take it away"};
}

// Only under the lock.
void RemoveHalfWritten(const std::string& folder) {
  for (const std::string& name : FilesIn(folder)) {
    if (IsHalfWritten(name)) Remove(folder + "/" + name);
  }
}

}  // namespace

Status CheckRunName(const std::string& directory, const std::string& name, ExistingRun existing) {
  CONSAC_RETURN_IF_ERROR(CheckFolderName("run", name));
  if (directory.empty()) return {StatusCode::kInvalidArgument, "the folder of the runs is ''; name one"};
  const std::string path = directory + "/" + name;
  const bool exists = Exists(path + "/config.yaml");
  if (existing == ExistingRun::kResume && !exists)
    return {StatusCode::kNotFound, "there is no run '" + path + "' to resume; start it without --resume"};
  if (existing == ExistingRun::kResume) CONSAC_RETURN_IF_ERROR(CheckFiles(path));
  if (!exists && !IsUnborn(path)) {
    return {StatusCode::kAlreadyExists, "'" + path +
                                            "' holds files but no config.yaml, so it is no run's folder and is left "
                                            "alone; choose another --name, or empty it"};
  }
  if (exists && existing == ExistingRun::kRefuse) {
    return {StatusCode::kAlreadyExists,
            "run '" + path + "' exists; go on with it by --resume, overwrite it by --force, or choose another --name"};
  }
  return Status::Ok();
}

Result<std::unique_ptr<RunDirectory>> RunDirectory::Open(const std::string& directory, const std::string& name,
                                                         ExistingRun existing) {
  CONSAC_RETURN_IF_ERROR(CheckRunName(directory, name, existing));
  const std::string path = directory + "/" + name;
  std::error_code error;
  for (const std::string& folder : {path, path + "/checkpoints"}) {
    fs::create_directories(ToPath(folder), error);
    if (error) return Status{StatusCode::kDataLoss, "cannot make folder '" + folder + "': " + error.message()};
  }
  int lock = -1;
  switch (LockFile(path + "/.lock", &lock)) {
    case Locked::kByUs:
      break;
    case Locked::kFailed:
      return Status{StatusCode::kDataLoss, "cannot write in '" + path + "': " + std::strerror(errno)};
    case Locked::kByOthers:
      return Status{StatusCode::kFailedPrecondition,
                    "run '" + path + "' is being trained by another process; wait for it or choose another --name"};
  }
  RemoveHalfWritten(path);
  RemoveHalfWritten(path + "/checkpoints");
  std::unique_ptr<RunDirectory> opened(new RunDirectory(path, lock));
  if (existing != ExistingRun::kOverwrite) return opened;
  CONSAC_RETURN_IF_ERROR(CheckOverwritable(path));
  Result<std::vector<std::string>> models = RemoveRun(path);
  if (!models.ok()) return models.status();
  opened->old_models_ = std::move(*models);
  return opened;
}

RunDirectory::RunDirectory(std::string path, int lock)
    : path_(std::move(path)), lock_(lock), segments_(std::make_unique<RowSegments>(path_ + "/checkpoints")) {}

RunDirectory::~RunDirectory() {
  Close(lock_);
}

void RunDirectory::KeepModel(const std::string& path) {
  std::erase(old_models_, path);
}

void RunDirectory::RemoveOldModels() {
  if (old_models_.empty()) return;
  for (const std::string& model : old_models_) Remove(model);
  old_models_.clear();
  RemoveEmptyFolder(path_ + "/best");
}

Status RunDirectory::CheckOurs() const {
  if (IsStillAt(lock_, File(".lock"))) return Status::Ok();
  return {StatusCode::kDataLoss, "the folder of run '" + path_ +
                                     "' was deleted, or belongs to another run now; what was learned here since its "
                                     "latest checkpoint cannot be saved in it"};
}

Status RunDirectory::CheckCheckpointsReadable() const {
  std::error_code error;
  const fs::directory_iterator entry(ToPath(path_ + "/checkpoints"), error);
  if (!error || error == std::errc::no_such_file_or_directory) return Status::Ok();
  return {StatusCode::kDataLoss, "cannot look into '" + path_ + "/checkpoints': " + error.message() +
                                     "; what is there may be whole, so make it readable"};
}

std::vector<std::string> RunDirectory::Checkpoints() const {
  std::vector<std::string> found;
  for (const std::string& name : FilesIn(path_ + "/checkpoints")) {
    if (IsCheckpoint(name)) found.push_back(path_ + "/checkpoints/" + name);
  }
  std::sort(found.begin(), found.end());  // the step count has a fixed width
  return found;
}

Status RunDirectory::SaveCheckpoint(std::int64_t steps, const StateMap& state, const std::string& description,
                                    std::int64_t keep) const {
  ModelFile file;
  file.spec_json = description;
  file.PutState(state);
  CONSAC_RETURN_IF_ERROR(CheckOurs());
  const std::string path = fmt::format("{}/checkpoints/step_{:012d}.consac", path_, steps);
  CONSAC_RETURN_IF_ERROR(file.Save(path));
  // What is newer than this one was damaged, or it would have been resumed: it goes, and takes no good one's place.
  std::vector<std::string> all = Checkpoints();
  for (; !all.empty() && all.back() != path; all.pop_back()) Remove(all.back());
  for (std::size_t i = 0; i + static_cast<std::size_t>(keep) < all.size(); ++i) Remove(all[i]);
  segments_->Committed(keep);
  return Status::Ok();
}

Result<StateMap> RunDirectory::LoadCheckpoint() const {
  CONSAC_RETURN_IF_ERROR(CheckCheckpointsReadable());
  std::vector<std::string> all = Checkpoints();
  for (auto path = all.rbegin(); path != all.rend(); ++path) {
    const Result<ModelFile> file = ModelFile::Load(*path);
    if (file.ok()) {
      StateMap state = file->TakeState();
      const Status whole = segments_->Check(state);
      if (whole.ok()) return state;
      if (whole.code() == StatusCode::kFailedPrecondition) return CannotBeRead(*path, whole);
      Log(LogLevel::kWarning, "passing over checkpoint '" + *path + "': " + whole.message());
      continue;
    }
    if (!ReadRegularFile(*path).ok()) return CannotBeRead(*path, file.status());
    Log(LogLevel::kWarning, "passing over a checkpoint: " + file.status().message());
  }
  if (all.empty()) return Status{StatusCode::kNotFound, "run '" + path_ + "' has no checkpoint yet"};
  return Status{StatusCode::kDataLoss,
                "none of the " + std::to_string(all.size()) + " checkpoints of run '" + path_ +
                    "' is whole; train it again with --force, or take its model.consac as it is"};
}

}  // namespace consac::run
