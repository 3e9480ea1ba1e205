#include "consac/run/run_directory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "consac/base/file.h"
#include "consac/base/memory.h"
#include "consac/base/names.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/model/model_file.h"
#include "consac/run/shortage.h"
#include "replaced_run.h"
#include "row_segments.h"
#include "run_files.h"
#include "system/system.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;

// What is there before config.yaml is, which is a run's first file.
bool IsUnborn(const std::string& path) {
  for (const std::string& name : FilesIn(path)) {
    const bool empty_folder = name == "checkpoints" && FilesIn(path + "/" + name).empty();
    if (name != kLockFile && !empty_folder && !IsHalfWritten(name)) return false;
  }
  return true;
}

Status CannotBeRead(const std::string& checkpoint, const Status& why) {
  return {StatusCode::kDataLoss, "checkpoint '" + checkpoint + "' cannot be read (" + why.message() +
                                     "), and may be whole; make it readable, or take it away"};
}

// Before it is read. Its bytes and what is made of them are there at the same time.
Status CheckSize(const std::string& checkpoint, std::size_t most_bytes) {
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(ToPath(checkpoint), error);
  if (error) return Status::Ok();  // which reading it tells better
  if (bytes <= most_bytes) return CheckMemory(2 * static_cast<std::size_t>(bytes), "checkpoint '" + checkpoint + "'");
  return {StatusCode::kResourceExhausted, "checkpoint '" + checkpoint + "' has " + std::to_string(bytes >> 20) +
                                              " MiB, where one of this run has at most " +
                                              std::to_string(most_bytes >> 20) +
                                              "; raise max_memory_mib if it is this run's, or take it away"};
}

// Takes the run's lock, until it is closed.
Status Lock(const std::string& path, int* lock) {
  const std::string file = path + "/" + std::string(kLockFile);
  CONSAC_RETURN_IF_ERROR(CheckOwnFile(file));  // or who holds it may be training elsewhere
  const Locked locked = LockFile(file, lock);
  const int error = errno;
  if (locked == Locked::kByUs) return Status::Ok();
  if (locked == Locked::kByOthers)
    return {StatusCode::kFailedPrecondition,
            "run '" + path + "' is being trained by another process; wait for it or choose another --name"};
  return {StatusCode::kDataLoss, "cannot write '" + file + "': " + std::strerror(error)};
}

Status CheckPlace(const std::string& directory, const std::string& name) {
  CONSAC_RETURN_IF_ERROR(CheckFolderName("run", name));
  if (directory.empty()) return {StatusCode::kInvalidArgument, "the folder of the runs is ''; name one"};
  return Status::Ok();
}

}  // namespace

Status FinishOverwriting(const std::string& directory, const std::string& name) {
  CONSAC_RETURN_IF_ERROR(CheckPlace(directory, name));
  const std::string path = directory + "/" + name;
  if (!IsReplacingUnfinished(path)) return Status::Ok();
  int lock = -1;
  CONSAC_RETURN_IF_ERROR(Lock(path, &lock));
  const Status finished = FinishReplacing(path);
  Close(lock);
  return finished;
}

Status CheckRunName(const std::string& directory, const std::string& name, ExistingRun existing) {
  CONSAC_RETURN_IF_ERROR(CheckPlace(directory, name));
  const std::string path = directory + "/" + name;
  const Result<bool> there = IsRun(path);
  if (!there.ok()) return there.status();
  const bool exists = *there;
  if (existing == ExistingRun::kResume && !exists)
    return {StatusCode::kNotFound, "there is no run '" + path + "' to resume; start it without --resume"};
  if (existing == ExistingRun::kResume) CONSAC_RETURN_IF_ERROR(CheckFilesToGoOnWith(path));
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
  CONSAC_RETURN_IF_ERROR(FinishOverwriting(directory, name));
  CONSAC_RETURN_IF_ERROR(CheckRunName(directory, name, existing));
  const std::string path = directory + "/" + name;
  std::error_code error;
  for (const std::string& folder : {path, path + "/checkpoints"}) {
    fs::create_directories(ToPath(folder), error);
    if (error) return Status{StatusCode::kDataLoss, "cannot make folder '" + folder + "': " + error.message()};
  }
  int lock = -1;
  CONSAC_RETURN_IF_ERROR(Lock(path, &lock));
  RemoveHalfWritten(path);
  RemoveHalfWritten(path + "/checkpoints");
  if (!IsLink(path + "/best")) RemoveHalfWritten(path + "/best");  // else it is somebody else's
  std::unique_ptr<RunDirectory> opened(new RunDirectory(path, lock));
  if (existing != ExistingRun::kOverwrite) return opened;
  opened->replaces_ = true;  // what is begun is put back, however this ends
  CONSAC_RETURN_IF_ERROR(SetRunAside(path));
  opened->replaces_ = IsRunAside(path);
  return opened;
}

RunDirectory::RunDirectory(std::string path, int lock)
    : path_(std::move(path)),
      lock_(lock),
      segments_(std::make_unique<RowSegments>(path_ + "/checkpoints", [this] { return CheckOurs(); })) {}

RunDirectory::~RunDirectory() {
  const Status back = Guarded([this] { return PutBack(); });  // memory may be what was short
  if (!back.ok()) Log(LogLevel::kError, back.message());
  Close(lock_);
}

Status RunDirectory::PutBack() {
  if (!replaces_) return Status::Ok();
  CONSAC_RETURN_IF_ERROR(CheckOurs());
  replaces_ = false;
  return PutRunBack(path_);
}

void RunDirectory::KeepReplacedModel(const std::string& name) const {
  if (replaces_ && CheckOurs().ok()) KeepModelOfRunAside(path_, name);
}

Status RunDirectory::RemoveReplaced() {
  if (replaces_) {
    CONSAC_RETURN_IF_ERROR(CheckOurs());
    CONSAC_RETURN_IF_ERROR(RemoveRunAside(path_));
  }
  replaces_ = false;
  return Status::Ok();
}

Status RunDirectory::CheckOurs() const {
  if (IsStillAt(lock_, File(".lock"))) return Status::Ok();
  return {StatusCode::kDataLoss, "the folder of run '" + path_ +
                                     "' was deleted, or belongs to another run now; what was learned here since its "
                                     "latest checkpoint cannot be saved in it"};
}

Status RunDirectory::Write(const std::string& file, std::span<const std::byte> bytes) const {
  return WriteFileAtomically(file, bytes, [this] { return CheckOurs(); });
}

Status RunDirectory::CheckCheckpointsReadable() const {
  std::error_code error;
  const fs::directory_iterator entry(ToPath(path_ + "/checkpoints"), error);
  if (!error || error == std::errc::no_such_file_or_directory) return Status::Ok();
  return {StatusCode::kDataLoss, "cannot look into '" + path_ + "/checkpoints': " + error.message() +
                                     "; what is there may be whole, so make it readable"};
}

std::vector<std::string> RunDirectory::Checkpoints() const {
  std::vector<std::string> found = FilesIn(path_ + "/checkpoints");
  std::erase_if(found, [](const std::string& name) { return !IsCheckpoint(name); });
  std::ranges::sort(found, {}, [](const std::string& name) { return std::pair(name.size(), name); });  // by steps
  return found;
}

Status RunDirectory::SaveCheckpoint(std::int64_t steps, const StateMap& state, const std::string& description,
                                    std::int64_t keep) const {
  ModelFile file;
  file.spec_json = description;
  file.PutState(state);
  const std::string name = fmt::format("step_{:012d}.consac", steps);
  CONSAC_RETURN_IF_ERROR(Write(path_ + "/checkpoints/" + name, file.Serialise()));
  segments_->Committed();
  RemoveCheckpoints(name, keep);
  segments_->RemoveUnneeded(name, keep);
  return Status::Ok();
}

void RunDirectory::RemoveCheckpoints(const std::string& name, std::int64_t keep) const {
  std::vector<std::string> all = Checkpoints();  // before the check: of this run's folder then
  Folder folder;
  if (!folder.Open(path_ + "/checkpoints", [this] { return CheckOurs(); }).ok()) return;
  // What is newer than this one was damaged, or it would have been resumed: it goes, and takes no good one's place.
  for (; !all.empty() && all.back() != name; all.pop_back()) folder.Remove(all.back());
  for (std::size_t i = 0; i + static_cast<std::size_t>(keep) < all.size(); ++i) folder.Remove(all[i]);
}

Result<StateMap> RunDirectory::LoadCheckpoint(std::size_t most_bytes) const {
  CONSAC_RETURN_IF_ERROR(CheckCheckpointsReadable());
  std::vector<std::string> all = Checkpoints();
  for (auto name = all.rbegin(); name != all.rend(); ++name) {
    const std::string path = path_ + "/checkpoints/" + *name;
    CONSAC_RETURN_IF_ERROR(CheckSize(path, most_bytes));
    const Result<ModelFile> file = ModelFile::Load(path);
    if (file.ok()) {
      StateMap state = file->TakeState();
      const Status whole = segments_->Check(state);
      if (whole.ok()) return state;
      if (whole.code() == StatusCode::kFailedPrecondition) return CannotBeRead(path, whole);
      Log(LogLevel::kWarning, "passing over checkpoint '" + path + "': " + whole.message());
      continue;
    }
    if (!ReadRegularFile(path).ok()) return CannotBeRead(path, file.status());
    Log(LogLevel::kWarning, "passing over a checkpoint: " + file.status().message());
  }
  if (all.empty()) return Status{StatusCode::kNotFound, "run '" + path_ + "' has no checkpoint yet"};
  return Status{StatusCode::kDataLoss,
                "none of the " + std::to_string(all.size()) + " checkpoints of run '" + path_ +
                    "' is whole; train it again with --force, or take its model.consac as it is"};
}

}  // namespace consac::run
