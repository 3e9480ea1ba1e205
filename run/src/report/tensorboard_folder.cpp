#include "report/tensorboard_folder.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/learn/log/training_folder.h"

namespace consac::run {
namespace {

// The largest number after `prefix` among the names in `folder`, up to a dot or the end; 0 without one.
std::int64_t LargestNumber(const std::string& folder, const std::string& prefix) {
  std::int64_t largest = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator it(ToPath(folder), error), end; !error && it != end; it.increment(error)) {
    std::string name = FromPath(it->path().filename());
    if (!name.starts_with(prefix)) continue;
    name = name.substr(prefix.size());
    std::int64_t number = 0;
    if (ParseNumber(std::string_view(name).substr(0, name.find('.')), &number)) largest = std::max(largest, number);
  }
  return largest;
}

}  // namespace

Result<std::string> TensorboardFolder(const std::string& root, const std::string& algorithm, learn::OpenMode mode) {
  const std::string prefix = learn::TrainingFolderPrefix(algorithm);
  const std::int64_t latest = LargestNumber(root, prefix);
  if (mode == learn::OpenMode::kAppend && latest > 0) return root + "/" + prefix + std::to_string(latest);
  return learn::MakeTrainingFolder(root, algorithm, latest);
}

// A resume within a second still comes later.
Result<std::unique_ptr<learn::EventWriter>> OpenEvents(const std::string& folder, double wall_time) {
  const std::int64_t second = std::max(static_cast<std::int64_t>(std::floor(wall_time)),
                                       LargestNumber(folder, std::string(learn::kEventFile)) + 1);
  return learn::EventWriter::Open(folder + "/" + learn::EventFileName(second), wall_time);
}

}  // namespace consac::run
