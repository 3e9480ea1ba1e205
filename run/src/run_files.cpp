#include "run_files.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/path.h"
#include "consac/model/model_file.h"
#include "row_segments.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kModelEnd = ".consac", kHalfWritten = ".tmp-", kEventFile = "events.out.tfevents.";
constexpr std::string_view kRunFiles[] = {kConfigFile, "progress.csv", "evaluations.csv"};
// Of each behaviour; where a run has several, behind its model's name: "hunter.monitor.csv".
constexpr std::string_view kBehaviourFiles[] = {"monitor.csv", "curve.svg", "curve.png"};

// model.consac, or BEHAVIOUR.consac of that behaviour; a model that somebody put there keeps a name of its own.
Result<bool> IsOwnModel(const std::string& folder, const std::string& name) {
  if (!name.ends_with(kModelEnd)) return false;
  if (name == "model.consac") return true;
  const Result<ModelFile> file = ModelFile::Load(folder + "/" + name);
  if (file.status().code() == StatusCode::kResourceExhausted) return file.status();
  if (!file.ok()) return false;
  const Result<nlohmann::json> spec = ReadJson<nlohmann::json>(file->spec_json);
  if (!spec.ok() || !spec->is_object()) return false;
  const auto interface = spec->find("interface");
  if (interface == spec->end() || !interface->is_object()) return false;
  const auto behaviour = interface->find("behaviour");
  return behaviour != interface->end() && behaviour->is_string() &&
         FileNameOf(behaviour->get_ref<const std::string&>(), kModelEnd) == name;
}

// Appends what of `names`, which are there, are files of a run: tables, models and what belongs to a behaviour.
Status AppendFiles(const std::string& path, const std::vector<std::string>& names, std::vector<std::string>* files) {
  std::vector<std::string> starts = {""};  // of a behaviour's files
  for (const std::string& name : names) {
    const Result<bool> own = IsOwnModel(path, name);
    if (!own.ok()) return own.status();
    if (!*own) continue;
    files->push_back(name);
    starts.push_back(name.substr(0, name.size() - kModelEnd.size()) + ".");
  }
  const auto append = [&](const std::string& name) {
    if (std::find(names.begin(), names.end(), name) != names.end()) files->push_back(name);
  };
  for (const std::string_view name : kRunFiles) append(std::string(name));
  for (const std::string& start : starts) {
    for (const std::string_view name : kBehaviourFiles) append(start + std::string(name));
  }
  return Status::Ok();
}

Status AppendEvents(const std::string& path, std::vector<std::string>* files) {
  const Result<std::vector<std::string>> folders = NamesIn(path + "/tensorboard");
  if (!folders.ok()) return folders.status();
  for (const std::string& folder : *folders) {  // PPO2_1, PPO2_2
    const std::string below = "tensorboard/" + folder;
    if (!IsFolder(path + "/" + below) || IsLink(path + "/" + below)) continue;
    const Result<std::vector<std::string>> names = NamesIn(path + "/" + below);
    if (!names.ok()) return names.status();
    for (const std::string& name : *names) {
      if (name.starts_with(kEventFile)) files->push_back(below + "/" + name);
    }
  }
  return Status::Ok();
}

// As {:012} writes it.
bool IsPaddedNumber(std::string_view digits) {
  return digits.size() >= 12 && digits.find_first_not_of("0123456789") == std::string_view::npos &&
         (digits.size() == 12 || digits[0] != '0');
}

}  // namespace

Result<std::vector<std::string>> NamesIn(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(ToPath(folder), error), end; !error && entry != end; entry.increment(error))
    names.push_back(FromPath(entry->path().filename()));
  if (!error || error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory) return names;
  const bool shortage = error == std::errc::too_many_files_open || error == std::errc::not_enough_memory ||
                        error == std::errc::too_many_files_open_in_system;
  return Status{shortage ? StatusCode::kResourceExhausted : StatusCode::kDataLoss,
                "cannot look into '" + folder + "': " + error.message()};
}

std::vector<std::string> FilesIn(const std::string& folder) {
  Result<std::vector<std::string>> names = NamesIn(folder);
  return names.ok() ? std::move(*names) : std::vector<std::string>();
}

bool IsRunsFile(std::string_view name) {
  return std::ranges::find(kRunFiles, name) != std::end(kRunFiles) ||
         std::ranges::any_of(kBehaviourFiles, [name](std::string_view file) {
           return name.ends_with(file) && (name.size() == file.size() || name[name.size() - file.size() - 1] == '.');
         });
}

bool IsCheckpoint(std::string_view name) {
  constexpr std::string_view kStart = "step_";
  return name.starts_with(kStart) && name.ends_with(kModelEnd) &&
         IsPaddedNumber(name.substr(kStart.size(), name.size() - kStart.size() - kModelEnd.size()));
}

bool IsSegment(std::string_view name) {
  if (!name.ends_with(kSegmentEnd)) return false;
  name.remove_suffix(kSegmentEnd.size());
  for (int number = 0; number < 2; ++number) {
    const std::size_t at = name.rfind('_');
    if (at == std::string_view::npos || !IsPaddedNumber(name.substr(at + 1))) return false;
    name = name.substr(0, at);
  }
  return !name.empty();
}

bool IsHalfWritten(std::string_view name) {
  const std::size_t at = name.rfind(kHalfWritten);
  if (at == std::string_view::npos) return false;
  const std::string_view number = name.substr(at + kHalfWritten.size()), of = name.substr(0, at);
  const bool numbered = !number.empty() && number.find_first_not_of("0123456789") == std::string_view::npos;
  return numbered && (of.ends_with(kModelEnd) || of.ends_with(kSegmentEnd) || IsRunsFile(of));
}

Result<std::vector<std::string>> FilesOfRun(const std::string& path) {
  std::vector<std::string> files, models;
  const Result<std::vector<std::string>> checkpoints = NamesIn(path + "/checkpoints"), names = NamesIn(path);
  if (!checkpoints.ok()) return checkpoints.status();
  if (!names.ok()) return names.status();
  for (const std::string& name : *checkpoints) {
    if (IsCheckpoint(name) || IsSegment(name)) files.push_back("checkpoints/" + name);
  }
  CONSAC_RETURN_IF_ERROR(AppendEvents(path, &files));
  const std::string best = path + "/best";
  if (!IsLink(best)) {
    const Result<std::vector<std::string>> kept = NamesIn(best);
    if (!kept.ok()) return kept.status();
    CONSAC_RETURN_IF_ERROR(AppendFiles(best, *kept, &models));
  }
  for (const std::string& model : models) {
    if (model.ends_with(kModelEnd)) files.push_back("best/" + model);
  }
  CONSAC_RETURN_IF_ERROR(AppendFiles(path, *names, &files));
  return files;
}

Result<bool> IsRun(const std::string& path) {
  std::error_code error;
  const bool there = fs::exists(ToPath(path + "/" + std::string(kConfigFile)), error);
  if (error == std::errc::permission_denied)
    return Status{StatusCode::kDataLoss, "cannot look into folder '" + path + "': " + error.message()};
  return there;
}

bool IsThere(const std::string& path) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(ToPath(path), ignored));
}

bool IsFolder(const std::string& path) {
  std::error_code ignored;
  return fs::is_directory(ToPath(path), ignored);
}

bool IsLink(const std::string& path) {
  std::error_code ignored;
  return fs::is_symlink(ToPath(path), ignored);
}

void Remove(const std::string& path) {
  std::error_code ignored;
  fs::remove(ToPath(path), ignored);
}

void RemoveHalfWritten(const std::string& folder) {
  for (const std::string& name : FilesIn(folder)) {
    if (IsHalfWritten(name)) Remove(folder + "/" + name);
  }
}

Status CheckRegular(const std::string& file) {
  std::error_code ignored;
  const fs::file_status status = fs::status(ToPath(file), ignored);
  if (!fs::exists(status) || fs::is_regular_file(status)) return Status::Ok();
  return {StatusCode::kDataLoss, "'" + file + "' is no regular file; take it away"};
}

Status CheckOwnFile(const std::string& file) {
  if (IsLink(file))
    return {StatusCode::kDataLoss,
            "'" + file + "' is a link and no file of this run; put the file there, or take it away"};
  CONSAC_RETURN_IF_ERROR(CheckRegular(file));
  std::error_code none;
  if (fs::hard_link_count(ToPath(file), none) <= 1 || none) return Status::Ok();
  return {StatusCode::kDataLoss, "'" + file +
                                     "' has another name (a hard link), and so may be somebody else's too; put a copy "
                                     "in its place, or take it away"};
}

Status CheckFilesToGoOnWith(const std::string& path) {
  const std::vector<std::string> names = FilesIn(path);
  // A behaviour's model has its log beside it; any other is somebody else's.
  const auto is_model = [&names](const std::string& name) {
    if (!name.ends_with(kModelEnd)) return false;
    const std::string log = name.substr(0, name.size() - kModelEnd.size()) + ".monitor.csv";
    return name == "model.consac" || std::ranges::find(names, log) != names.end();
  };
  for (const std::string& name : names) {
    if (IsRunsFile(name) || name == kLockFile || is_model(name))
      CONSAC_RETURN_IF_ERROR(CheckOwnFile(path + "/" + name));
  }
  return Status::Ok();
}

}  // namespace consac::run
