#include "report/tensorboard_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "consac/base/path.h"
#include "consac/base/text.h"

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
  std::string prefix = algorithm + "_";
  std::transform(prefix.begin(), prefix.end(), prefix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const std::int64_t latest = LargestNumber(root, prefix);
  const std::int64_t number = mode == learn::OpenMode::kAppend ? std::max<std::int64_t>(latest, 1) : latest + 1;
  std::string folder = fmt::format("{}/{}{}", root, prefix, number);
  std::error_code error;
  std::filesystem::create_directories(ToPath(folder), error);
  if (error) return Status{StatusCode::kDataLoss, "cannot make the folder '" + folder + "': " + error.message()};
  return folder;
}

// A resume within a second still comes later.
Result<std::unique_ptr<learn::EventWriter>> OpenEvents(const std::string& folder, double wall_time) {
  const std::int64_t second = std::max(static_cast<std::int64_t>(std::floor(wall_time)),
                                       LargestNumber(folder, std::string(learn::kEventFile)) + 1);
  return learn::EventWriter::Open(folder + "/" + learn::EventFileName(second), wall_time);
}

}  // namespace consac::run
