#include "consac/run/run_directory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "consac/base/text.h"
#include "consac/model/model_file.h"
#include "consac/run/path.h"
#include "system/system.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;

// What Windows takes for a device, with or without an extension.
bool IsDevice(const std::string& name) {
  std::string stem = name.substr(0, name.find('.'));
  std::transform(stem.begin(), stem.end(), stem.begin(), [](unsigned char c) { return std::tolower(c); });
  if (stem.size() == 4 && (stem.starts_with("com") || stem.starts_with("lpt"))) return stem[3] >= '0' && stem[3] <= '9';
  return stem == "con" || stem == "nul" || stem == "aux" || stem == "prn";
}

// A name becomes a folder, so it must not lead out of the runs folder, and be the same folder on every system.
Status CheckName(const std::string& name) {
  const bool plain = !name.empty() && name[0] != '.' && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
  });
  if (plain && name.size() <= 128 && name.back() != '.' && !IsDevice(name)) return Status::Ok();
  return {StatusCode::kInvalidArgument, "run name " + Quote(name) +
                                            " cannot be a folder; use letters, digits, '_', '-' and '.', none of the "
                                            "last at an end, and no name of a device (con, nul)"};
}

bool HoldsRun(const std::string& path) {
  std::error_code ignored;
  return fs::exists(ToPath(path + "/config.yaml"), ignored) || fs::exists(ToPath(path + "/model.consac"), ignored);
}

// Only what a run writes; whatever else somebody put there stays.
void RemoveRun(const std::string& path) {
  std::error_code ignored;
  for (const char* name :
       {"config.yaml", "checkpoints", "progress.csv", "monitor.csv", "tensorboard", "curve.svg", "curve.png"}) {
    fs::remove_all(ToPath(path + "/" + name), ignored);
  }
  std::vector<fs::path> models;  // model.consac, or one for each behaviour
  for (fs::directory_iterator entry(ToPath(path), ignored), end; !ignored && entry != end; entry.increment(ignored)) {
    if (entry->path().extension() == ".consac") models.push_back(entry->path());
  }
  for (const fs::path& model : models) fs::remove(model, ignored);
}

// Temporary files of a process that was killed while it wrote (WriteFileAtomically). Only under the lock.
void RemoveHalfWritten(const std::string& folder) {
  std::vector<fs::path> found;
  std::error_code ignored;
  for (fs::directory_iterator entry(ToPath(folder), ignored), end; !ignored && entry != end; entry.increment(ignored)) {
    if (FromPath(entry->path().filename()).find(".tmp-") != std::string::npos) found.push_back(entry->path());
  }
  for (const fs::path& path : found) fs::remove(path, ignored);
}

}  // namespace

Result<std::unique_ptr<RunDirectory>> RunDirectory::Open(const std::string& directory, const std::string& name,
                                                         ExistingRun existing) {
  CONSAC_RETURN_IF_ERROR(CheckName(name));
  if (directory.empty()) return Status{StatusCode::kInvalidArgument, "the folder of the runs is ''; name one"};
  const std::string path = directory + "/" + name;
  const bool exists = HoldsRun(path);
  if (exists && existing == ExistingRun::kRefuse) {
    return Status{
        StatusCode::kAlreadyExists,
        "run '" + path + "' exists; go on with it by --resume, overwrite it by --force, or choose another --name"};
  }
  if (!exists && existing == ExistingRun::kResume) {
    return Status{StatusCode::kNotFound, "there is no run '" + path + "' to resume; start it without --resume"};
  }
  std::error_code error;
  fs::create_directories(ToPath(path + "/checkpoints"), error);
  if (error) return Status{StatusCode::kDataLoss, "cannot make folder '" + path + "': " + error.message()};
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
  if (existing == ExistingRun::kOverwrite) {
    RemoveRun(path);
    fs::create_directories(ToPath(path + "/checkpoints"), error);
  }
  return std::unique_ptr<RunDirectory>(new RunDirectory(path, lock));
}

RunDirectory::~RunDirectory() {
  Close(lock_);
}

std::vector<std::string> RunDirectory::Checkpoints() const {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator entry(ToPath(path_ + "/checkpoints"), error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string file = FromPath(entry->path().filename());
    if (file.ends_with(".consac")) found.push_back(path_ + "/checkpoints/" + file);
  }
  std::sort(found.begin(), found.end());  // the step count has a fixed width
  return found;
}

Status RunDirectory::SaveCheckpoint(std::int64_t steps, const StateMap& state, const std::string& description,
                                    std::int64_t keep) const {
  ModelFile file;
  file.spec_json = description;
  file.PutState(state);
  const std::string path = fmt::format("{}/checkpoints/step_{:012d}.consac", path_, steps);
  CONSAC_RETURN_IF_ERROR(file.Save(path));
  // What is newer than this one was damaged, or it would have been resumed: it goes, and takes no good one's place.
  std::vector<std::string> all = Checkpoints();
  std::error_code ignored;
  for (; !all.empty() && all.back() != path; all.pop_back()) fs::remove(ToPath(all.back()), ignored);
  for (std::size_t i = 0; i + static_cast<std::size_t>(keep) < all.size(); ++i) fs::remove(ToPath(all[i]), ignored);
  return Status::Ok();
}

Result<StateMap> RunDirectory::LoadCheckpoint() const {
  std::vector<std::string> all = Checkpoints();
  for (auto path = all.rbegin(); path != all.rend(); ++path) {
    const Result<ModelFile> file = ModelFile::Load(*path);
    if (file.ok()) return file->TakeState();
    Log(LogLevel::kWarning, "passing over a checkpoint: " + file.status().message());
  }
  if (all.empty()) return Status{StatusCode::kNotFound, "run '" + path_ + "' has no checkpoint yet"};
  return Status{StatusCode::kDataLoss,
                "none of the " + std::to_string(all.size()) + " checkpoints of run '" + path_ +
                    "' is whole; train it again with --force, or take its model.consac as it is"};
}

}  // namespace consac::run
