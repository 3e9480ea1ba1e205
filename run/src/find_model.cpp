// Where a model's name leads.
#include <algorithm>

#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/run/actors.h"
#include "replaced_run.h"
#include "run_files.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;

bool IsFile(const std::string& path) {
  std::error_code none;
  return fs::is_regular_file(ToPath(path), none);
}

/// The models in a folder, sorted; none where it is no folder.
std::vector<std::string> ModelsIn(const std::string& folder) {
  std::vector<std::string> found;
  std::error_code ignored;
  for (fs::directory_iterator entry(ToPath(folder), ignored), end; !ignored && entry != end; entry.increment(ignored)) {
    const std::string path = folder + "/" + FromPath(entry->path().filename());
    if (path.ends_with(".consac") && IsFile(path)) found.push_back(path);
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// The models of a run. Of one that is being overwritten, or was when a process was killed: the old one's, which is put
/// back, until the new one is saved (replaced_run.h). On its way, some of it is here and the rest there.
std::vector<std::string> ModelsOf(const std::string& run) {
  if (IsRunAside(run)) return ModelsIn(run + kRunAside);
  std::vector<std::string> found = ModelsIn(run);
  for (std::string& model : ModelsIn(run + kRunMoving)) found.push_back(std::move(model));
  return found;
}

std::vector<std::string> RunsWithModels(const std::string& directory) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (fs::directory_iterator entry(ToPath(directory), ignored), end; !ignored && entry != end;
       entry.increment(ignored)) {
    const std::string name = FromPath(entry->path().filename());
    if (!ModelsOf(directory + "/" + name).empty()) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

// A run that may not be looked into may hold the model.
Status NoModel(const std::string& model, const std::string& directory) {
  for (const std::string& folder : {model, directory + "/" + model}) {
    if (const Result<bool> there = IsRun(folder); !there.ok()) return there.status();
  }
  const std::vector<std::string> names = RunsWithModels(directory);
  const std::vector<std::string_view> known(names.begin(), names.end());
  return {StatusCode::kNotFound, "there is no model " + Quote(model) + " (neither a file nor a run in '" + directory +
                                     "')" + Suggestion(model, known)};
}

}  // namespace

Result<std::vector<std::string>> FindModels(const std::string& model, const std::string& directory) {
  if (model.empty()) return NoModel(model, directory);
  if (IsFile(model)) return std::vector<std::string>{model};
  for (const std::string& folder : {model, directory + "/" + model}) {
    std::vector<std::string> found = ModelsOf(folder);
    if (!found.empty()) return found;
  }
  const std::string lone = directory + "/" + model + ".consac";
  if (IsFile(lone)) return std::vector<std::string>{lone};
  std::error_code ignored;
  if (fs::exists(ToPath(model), ignored) && !fs::is_directory(ToPath(model), ignored))
    return Status{StatusCode::kInvalidArgument, Quote(model) + " is no regular file, so it holds no model"};
  return NoModel(model, directory);
}

Result<std::string> FindModel(const std::string& model, const std::string& directory) {
  const Result<std::vector<std::string>> found = FindModels(model, directory);
  if (!found.ok()) return found.status();
  if (found->size() == 1) return found->front();
  for (const std::string& path : *found) {
    if (path.ends_with("/model.consac")) return path;
  }
  std::string all;
  for (const std::string& path : *found) all += (all.empty() ? "'" : ", '") + path + "'";
  return Status{StatusCode::kInvalidArgument,
                Quote(model) + " holds " + std::to_string(found->size()) + " models; name one of them: " + all};
}

}  // namespace consac::run
