// Where a model's name leads.
#include <algorithm>

#include "consac/base/text.h"
#include "consac/run/path.h"
#include "consac/run/training.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> RunsWithModels(const std::string& directory) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (fs::directory_iterator entry(ToPath(directory), ignored), end; !ignored && entry != end;
       entry.increment(ignored)) {
    std::error_code none;
    if (fs::is_regular_file(entry->path() / "model.consac", none)) names.push_back(FromPath(entry->path().filename()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

Result<std::string> FindModel(const std::string& model, const std::string& directory) {
  std::error_code ignored;
  if (fs::is_regular_file(ToPath(model), ignored)) return model;
  for (const std::string& path :
       {model + "/model.consac", directory + "/" + model + "/model.consac", directory + "/" + model + ".consac"}) {
    if (fs::is_regular_file(ToPath(path), ignored)) return path;
  }
  if (fs::exists(ToPath(model), ignored) && !fs::is_directory(ToPath(model), ignored))
    return Status{StatusCode::kInvalidArgument, Quote(model) + " is no regular file, so it holds no model"};
  const std::vector<std::string> names = RunsWithModels(directory);
  const std::vector<std::string_view> known(names.begin(), names.end());
  return Status{StatusCode::kNotFound, "there is no model " + Quote(model) + " (neither a file nor a run in '" +
                                           directory + "')" + Suggestion(model, known)};
}

}  // namespace consac::run
