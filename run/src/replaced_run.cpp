#include "replaced_run.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "consac/base/file.h"
#include "consac/base/hooks.h"
#include "consac/base/path.h"
#include "run_files.h"
#include "system/system.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;

constexpr const char *kAside = kRunAside, *kMoving = kRunMoving;
constexpr const char* kGoing = "/.replaced.going";
constexpr const char* kFolders[] = {"/checkpoints", "/tensorboard", "/best"};  // what a run has below its own

Status Failed(const std::string& what, const std::string& path, const std::error_code& why) {
  const bool full = why == std::errc::no_space_on_device || why == std::errc::too_many_files_open;
  return {full ? StatusCode::kResourceExhausted : StatusCode::kDataLoss,
          "cannot " + what + " '" + path + "': " + why.message()};
}

/// A folder that was made here: whatever a link leads to is somebody else's.
bool IsOwnFolder(const std::string& path) {
  return IsFolder(path) && !IsLink(path);
}

/// Below which something of the run at `path` may be aside; what a `best` that is a link leads to is not the run's.
bool MayHoldFiles(const std::string& path, std::string_view folder) {
  return folder == "/best" ? IsOwnFolder(path + "/best") : IsFolder(path + std::string(folder));
}

Status InTheWay(const std::string& path) {
  return {StatusCode::kDataLoss, "'" + path + "' is in the way; take it away"};
}

Status Rename(const std::string& from, const std::string& to, const char* what) {
  std::error_code error;
  fs::rename(ToPath(from), ToPath(to), error);
  return error ? Failed(what, from, error) : Status::Ok();
}

Status MakeFolder(const std::string& path) {
  std::error_code error;
  fs::create_directories(ToPath(path), error);
  return error ? Failed("make folder", path, error) : Status::Ok();
}

std::string FolderOf(const std::string& relative) {
  const std::size_t slash = relative.find('/');
  return slash == std::string::npos ? "" : "/" + relative.substr(0, slash);
}

/// Where a file of the run lies while it is on its way: "checkpoints/x" -> path/checkpoints/.replaced/x.
std::string PlaceAside(const std::string& path, const std::string& relative) {
  const std::string folder = FolderOf(relative);
  return folder.empty() ? path + kMoving + "/" + relative : path + folder + kAside + relative.substr(folder.size() - 1);
}

/// Renames survive a power cut once the folders on both sides are synced. All are before the name in the run's own
/// folder says so.
void SyncFolders(const std::string& path) {
  for (const char* folder : kFolders) {
    if (!IsFolder(path + folder)) continue;
    for (const std::string& below : {path + folder, path + folder + kAside}) {
      for (const std::string& name : FilesIn(below)) {
        if (IsFolder(below + "/" + name) && !IsLink(below + "/" + name)) SyncFolder(below + "/" + name);
      }
      SyncFolder(below);
    }
  }
  for (const char* own : {kMoving, kAside, ""}) SyncFolder(path + own);
}

/// What the name in the run's own folder says of it: kMoving, kAside, kGoing.
Status ChangeState(const std::string& path, const char* from, const char* to) {
  SyncFolders(path);
  CONSAC_RETURN_IF_ERROR(Rename(path + from, path + to, "rename"));
  SyncFolder(path);
  return Status::Ok();
}

/// "tensorboard/PPO2_1" goes with its last file, unless there is something else in it.
void RemoveEmptyFoldersOfEvents(const std::string& path) {
  for (const std::string& name : FilesIn(path + "/tensorboard")) {
    const std::string folder = path + "/tensorboard/" + name;
    if (IsFolder(folder) && !IsLink(folder) && FilesIn(folder).empty()) Remove(folder);
  }
}

/// Every file below `from` to the same place below `to`, where nothing is replaced; then `from` goes.
Status MoveAll(const std::string& from, const std::string& to) {
  if (!IsOwnFolder(from)) return Status::Ok();
  const Result<std::vector<std::string>> names = NamesIn(from);
  if (!names.ok()) return names.status();
  for (const std::string& name : *names) {
    const std::string here = from + "/" + name, there = to + "/" + name;
    if (IsOwnFolder(here)) {
      CONSAC_RETURN_IF_ERROR(MakeFolder(there));
      CONSAC_RETURN_IF_ERROR(MoveAll(here, there));
    } else {
      if (IsThere(there)) return InTheWay(there);
      CONSAC_RETURN_IF_ERROR(Rename(here, there, "put back"));
    }
  }
  Remove(from);
  return Status::Ok();
}

/// From the state kMoving.
Status MoveBack(const std::string& path) {
  for (const char* folder : kFolders) {
    if (MayHoldFiles(path, folder)) CONSAC_RETURN_IF_ERROR(MoveAll(path + folder + kAside, path + folder));
  }
  SyncFolders(path);
  CONSAC_RETURN_IF_ERROR(MoveAll(path + kMoving, path));
  SyncFolder(path);
  return Status::Ok();
}

Status MoveAside(const std::string& path, const std::vector<std::string>& files) {
  for (const char* folder : kFolders) {
    if (MayHoldFiles(path, folder)) CONSAC_RETURN_IF_ERROR(MakeFolder(path + folder + kAside));
  }
  for (const std::string& file : files) {
    const std::string aside = PlaceAside(path, file);
    CONSAC_RETURN_IF_ERROR(MakeFolder(aside.substr(0, aside.rfind('/'))));
    CONSAC_RETURN_IF_ERROR(Rename(path + "/" + file, aside, "set aside"));
  }
  RemoveEmptyFoldersOfEvents(path);
  return ChangeState(path, kMoving, kAside);
}

/// What is to be made must not be there: files would go where it leads, or come back among what is in it.
Status CheckNothingInTheWay(const std::string& path) {
  std::vector<std::string> places = {path + kMoving, path + kAside, path + kGoing};
  for (const char* folder : kFolders) {
    if (MayHoldFiles(path, folder)) places.push_back(path + folder + kAside);
  }
  for (const std::string& place : places) {
    if (IsOwnFolder(place)) Remove(place);  // an empty one
    if (IsThere(place)) return InTheWay(place);
  }
  return Status::Ok();
}

/// A folder that lets nothing go would keep the one that is made in it.
Status CheckFoldersLetGo(const std::string& path, const std::vector<std::string>& files) {
  for (const std::string& file : files) {
    const std::string folder = (path + "/" + file).substr(0, path.size() + 1 + file.rfind('/'));
    if (LetsNothingGo(folder)) return {StatusCode::kDataLoss, "'" + folder + "' is append-only (chattr -a ends that)"};
  }
  return Status::Ok();
}

}  // namespace

// By its first file and the place of its checkpoints, which every run has: an empty folder of that name, a link or a
// copy of something is no run that was set aside, and takes the place of none.
bool IsRunAside(const std::string& path) {
  if (!IsOwnFolder(path + "/checkpoints" + kAside)) return false;
  const std::string config = path + kAside + "/" + std::string(kConfigFile);
  return IsOwnFolder(path + kAside) && IsThere(config) && (IsLink(config) || CheckRegular(config).ok());
}

bool IsReplacingUnfinished(const std::string& path) {
  return IsRunAside(path) || IsOwnFolder(path + kMoving) || IsOwnFolder(path + kGoing);
}

Status SetRunAside(const std::string& path) {
  const Result<std::vector<std::string>> files = FilesOfRun(path);
  if (!files.ok()) return {files.status().code(), files.status().message() + kNothingLost};
  if (files->empty()) return Status::Ok();
  for (const std::string& file : *files) {
    const Status regular = CheckRegular(path + "/" + file);
    if (!regular.ok()) return {regular.code(), regular.message() + kNothingLost};
  }
  Status free = CheckFoldersLetGo(path, *files);
  if (free.ok()) free = CheckNothingInTheWay(path);
  if (!free.ok()) return {free.code(), free.message() + kNothingLost};
  Status moved = MakeFolder(path + kMoving);
  SyncFolder(path);
  if (moved.ok()) moved = MoveAside(path, *files);
  if (moved.ok()) return moved;
  const Status back = MoveBack(path);
  if (!back.ok()) return {moved.code(), moved.message() + "; and then: " + back.message()};
  return {moved.code(), moved.message() + kNothingLost};
}

Status PutRunBack(const std::string& path) {
  if (!IsReplacingUnfinished(path)) return Status::Ok();
  Status back;
  if (IsRunAside(path)) {
    Remove(path + kMoving);
    if (IsThere(path + kMoving)) return InTheWay(path + kMoving);
    const Result<std::vector<std::string>> files = FilesOfRun(path);
    back = files.status();
    for (std::size_t i = 0; files.ok() && i < files->size(); ++i) Remove(path + "/" + (*files)[i]);
    RemoveHalfWritten(path);  // KeepModelOfRunAside's second name of a model, or nobody goes on with the run
    RemoveEmptyFoldersOfEvents(path);
    if (back.ok()) back = ChangeState(path, kAside, kMoving);
  }
  if (back.ok()) back = MoveBack(path);
  if (back.ok()) return back;
  return {back.code(), back.message() + "; the files of the run that was to be overwritten are in the folders '" +
                           (kAside + 1) + "*' below '" + path + "', and the next start puts them back"};
}

void KeepModelOfRunAside(const std::string& path, const std::string& name) {
  const std::string linked = path + "/" + name + ".tmp-" + std::to_string(ProcessId());
  std::error_code error;
  fs::create_hard_link(ToPath(path + kAside + "/" + name), ToPath(linked), error);
  if (!error) fs::rename(ToPath(linked), ToPath(path + "/" + name), error);
  if (error) Remove(linked);
}

Status RemoveRunAside(const std::string& path) {
  if (IsRunAside(path)) CONSAC_RETURN_IF_ERROR(ChangeState(path, kAside, kGoing));
  std::error_code error;
  bool gone = true;
  for (const char* folder : kFolders) {
    if (MayHoldFiles(path, folder)) fs::remove_all(ToPath(path + folder + kAside), error);
    gone = gone && !error;
  }
  if (IsFolder(path + "/best") && FilesIn(path + "/best").empty()) Remove(path + "/best");
  if (gone) fs::remove_all(ToPath(path + kGoing), error);  // or the next start goes on with it
  return Status::Ok();
}

Status FinishReplacing(const std::string& path) {
  if (!IsReplacingUnfinished(path)) return Status::Ok();
  if (!IsRunAside(path) && !IsOwnFolder(path + kMoving)) return RemoveRunAside(path);
  const bool anything = IsRunAside(path) || !FilesIn(path + kMoving).empty();
  CONSAC_RETURN_IF_ERROR(PutRunBack(path));
  if (!anything) return Status::Ok();  // it had hardly begun
  Log(LogLevel::kWarning, "run '" + path +
                              "' was to be overwritten, and that ended before the new one was saved; the old one is "
                              "back as it was");
  return Status::Ok();
}

}  // namespace consac::run
