#include "consac/learn/log/training_folder.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>

#include "log/system.h"

namespace consac::learn {
namespace {

#if defined(_WIN32)
constexpr const char* kSlashes = "/\\";
#else
constexpr const char* kSlashes = "/";
#endif

/// `folder`, and what it is in; what is made in it says what is wrong.
void MakeFolders(const std::string& folder) {
  for (std::size_t end = folder.find_first_of(kSlashes, 1); end != std::string::npos;
       end = folder.find_first_of(kSlashes, end + 1))
    (void)MakeFolder(folder.substr(0, end));
  (void)MakeFolder(folder);
}

}  // namespace

std::string TrainingFolderPrefix(std::string_view algorithm) {
  std::string prefix(algorithm);
  std::transform(prefix.begin(), prefix.end(), prefix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return prefix + "_";
}

Result<std::string> MakeTrainingFolder(const std::string& folder, std::string_view algorithm, std::int64_t latest) {
  MakeFolders(folder);
  for (std::int64_t number = latest + 1;; ++number) {
    std::string path = folder + "/" + TrainingFolderPrefix(algorithm) + std::to_string(number);
    const FolderMade made = MakeFolder(path);
    if (made == FolderMade::kNew) return path;
    if (made == FolderMade::kFailed)
      return Status{StatusCode::kDataLoss, "cannot make the folder '" + path + "': " + std::strerror(errno)};
  }
}

}  // namespace consac::learn
