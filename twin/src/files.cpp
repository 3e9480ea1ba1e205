#include "files.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "consac/base/file.h"
#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/robot/table.h"

namespace consac::twin {
namespace {

namespace fs = std::filesystem;

constexpr const char *kNew = "new", *kOld = "old";  // in the folder beside the place: to be put there, taken from there
constexpr int kMostLevels = 4;                      // above the description, where its package may begin

bool IsThere(const fs::path& path) {
  std::error_code error;
  return fs::exists(fs::symlink_status(path, error));
}

bool IsBelow(const fs::path& path, const fs::path& root) {
  const auto [in_root, in_path] = std::mismatch(root.begin(), root.end(), path.begin(), path.end());
  (void)in_path;
  return in_root == root.end() || (std::next(in_root) == root.end() && in_root->empty());
}

fs::path Canonical(const fs::path& path) {
  std::error_code error;
  const fs::path canonical = fs::weakly_canonical(path, error);
  return error ? path.lexically_normal() : canonical;
}

// "%20" and the like, as URLs write them.
std::string Decoded(std::string_view text) {
  std::string out;
  const auto digit = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                  : -1;
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escaped = text[i] == '%' && i + 2 < text.size() && digit(text[i + 1]) >= 0 && digit(text[i + 2]) >= 0;
    out += escaped ? static_cast<char>(digit(text[i + 1]) * 16 + digit(text[i + 2])) : text[i];
    i += escaped ? 2 : 0;
  }
  return out;
}

using FolderJson = nlohmann::json;

// A JSON object that stands in a folder; null where there is none.
FolderJson ObjectIn(const fs::path& folder, std::string_view name) {
  const Result<std::vector<std::byte>> bytes = ReadRegularFile(FromPath(folder / name), JsonLimits{}.bytes);
  if (!bytes.ok()) return nullptr;
  Result<FolderJson> json =
      ReadJson<FolderJson>(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()));
  return json.ok() && json->is_object() ? std::move(*json) : FolderJson(nullptr);
}

// What is below `folder`, at `at` and deeper, and was not made by the import whose files are `ours`; "" nothing. Links
// are not followed: an import makes none.
std::string ForeignBelow(const fs::path& folder, const fs::path& at, const std::set<std::string>& ours) {
  std::error_code error;
  for (fs::directory_iterator each(folder / at, error), end; !error && each != end; each.increment(error)) {
    const fs::path below = at / each->path().filename();
    const fs::file_status status = each->symlink_status(error);
    if (error) break;
    if (fs::is_regular_file(status) && ours.contains(FromPath(below))) continue;
    if (!fs::is_directory(status) || FromPath(below) != kMeshFolder) return FromPath(below);
    if (std::string foreign = ForeignBelow(folder, below, ours); !foreign.empty()) return foreign;
  }
  return error ? error.message() : std::string();
}

// Why the folder is no import's, which says of itself what it is and which files it made; "" it is one.
std::string ForeignIn(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(fs::symlink_status(folder, error))) return "no folder";
  if (fs::is_empty(folder, error) && !error) return "";
  const FolderJson table = ObjectIn(folder, kTableName), report = ObjectIn(folder, kReportName);
  const auto format = table.find("format");
  if (format == table.end() || *format != robot::kTableFormat) return "no twin.json that an import wrote";
  std::set<std::string> ours = {std::string(kTableName), std::string(kReportName)};
  const auto files = report.find("files");
  if (files == report.end() || !files->is_array()) return "no report.json that an import wrote";
  for (const FolderJson& file : *files) {
    if (file.is_string()) ours.insert(file.get<std::string>());
  }
  return ForeignBelow(folder, {}, ours);
}

}  // namespace

std::string LowerCase(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

std::string EndingOf(const std::string& path) {
  return LowerCase(FromPath(ToPath(path).extension()));
}

MeshFinder::MeshFinder(const std::string& description, const std::string& root,
                       std::map<std::string, std::string> packages)
    : packages_(std::move(packages)) {
  std::error_code error;
  folder_ = Canonical(fs::absolute(ToPath(description), error)).parent_path();
  root_ = folder_;
  if (!root.empty()) {
    root_ = Canonical(fs::absolute(ToPath(root), error));
    return;
  }
  fs::path above = folder_;
  for (int level = 0; level < kMostLevels; ++level, above = above.parent_path()) {
    if (IsThere(above / "package.xml")) {
      root_ = above;
      return;
    }
  }
}

Result<fs::path> MeshFinder::Package(std::string_view name) const {
  const auto given = packages_.find(std::string(name));
  std::error_code error;
  if (given != packages_.end()) return Canonical(fs::absolute(ToPath(given->second), error));
  fs::path above = folder_;
  for (int level = 0; level < kMostLevels; ++level, above = above.parent_path()) {
    if (FromPath(above.filename()) == name) return above;
  }
  if (IsThere(root_ / "package.xml")) return root_;  // checked out under another name
  for (const fs::path& beside : {folder_, root_}) {
    if (fs::is_directory(beside / ToPath(std::string(name)), error)) return beside / ToPath(std::string(name));
  }
  return Status{StatusCode::kNotFound, "the package " + Quote(name) + " is not around " +
                                           Quote(FromPath(folder_), 300) + "; say where it is: --package " +
                                           std::string(name) + "=FOLDER"};
}

Result<std::string> MeshFinder::Find(const std::string& name) const {
  constexpr std::string_view kPackage = "package://", kModel = "model://", kFile = "file://";
  std::string_view rest = name;
  fs::path path, root = root_;
  if (rest.starts_with(kPackage) || rest.starts_with(kModel)) {
    rest.remove_prefix(rest.starts_with(kPackage) ? kPackage.size() : kModel.size());
    const std::size_t slash = std::min(rest.find('/'), rest.size());
    const Result<fs::path> package = Package(rest.substr(0, slash));
    if (!package.ok()) return package.status();
    if (packages_.contains(std::string(rest.substr(0, slash)))) root = *package;
    path = *package / ToPath(Decoded(rest.substr(std::min(slash + 1, rest.size()))));
  } else if (rest.starts_with(kFile)) {
    path = ToPath(Decoded(rest.substr(kFile.size())));
    if (path.is_relative()) path = folder_ / path;
  } else if (rest.find("://") != std::string_view::npos) {
    return Status{StatusCode::kInvalidArgument, "mesh " + Quote(name, 300) +
                                                    ": package://, file:// and paths are read; "
                                                    "copy it beside the description"};
  } else {
    path = folder_ / ToPath(name);
  }
  const fs::path found = Canonical(path);
  if (!IsBelow(found, root))
    return Status{StatusCode::kInvalidArgument, "mesh " + Quote(name, 300) + " leads out of " +
                                                    Quote(FromPath(root), 300) +
                                                    "; say which folder may be read: --root FOLDER"};
  std::error_code error;
  if (!fs::is_regular_file(found, error))
    return Status{StatusCode::kNotFound,
                  "mesh " + Quote(name, 300) + " is not there: no file " + Quote(FromPath(found), 300)};
  return FromPath(found);
}

Status OutputFolder::Check(const fs::path& folder) const {
  if (!IsThere(folder)) return {};
  const std::string foreign = ForeignIn(folder), name = "'" + FromPath(path_) + "' holds ";
  std::error_code error;
  if (!foreign.empty())
    return {StatusCode::kAlreadyExists, name + "what is no import's (" + Quote(foreign) + "); give another folder"};
  if (!replace_ && !fs::is_empty(folder, error))
    return {StatusCode::kAlreadyExists, name + "an import already; give another folder, or --force to replace it"};
  return {};
}

Status OutputFolder::Choose(const std::string& path, bool replace) {
  std::error_code error;
  path_ = Canonical(fs::absolute(ToPath(path), error));  // a link to a folder means that folder
  if (!path_.has_filename()) path_ = path_.parent_path();
  replace_ = replace;
  return Check(path_);
}

Status OutputFolder::Open() {
  std::error_code error;
  CONSAC_RETURN_IF_ERROR(Check(path_));
  fs::create_directories(path_.parent_path(), error);
  // Only a folder that was made here is written and removed: another import may be under way, another may have been
  // killed.
  constexpr int kMostBeside = 1000;
  bool made = false;
  for (int n = 1; n <= kMostBeside && !made && !error; ++n) {
    beside_ = path_;
    beside_ += ".importing" + (n == 1 ? std::string() : "-" + std::to_string(n));
    made = fs::create_directory(beside_, error);
    if (error == std::errc::file_exists) error.clear();  // what is there is no folder
  }
  if (made) fs::create_directories(beside_ / kNew / kMeshFolder, error);
  if (made && !error) return {};
  const std::string why =
      error ? error.message() : "too many '" + FromPath(path_) + ".importing' are left; remove them";
  if (!made) beside_.clear();
  return {StatusCode::kDataLoss, "cannot make the folder '" + FromPath(path_) + "': " + why};
}

std::string OutputFolder::file(const std::string& name) const {
  return FromPath(beside_ / kNew / ToPath(name));
}

Status OutputFolder::Commit() {
  const fs::path old = beside_ / kOld;
  std::error_code error;
  // Something may stand there by now that did not at Open. It is looked at again once nobody finds it under its name.
  CONSAC_RETURN_IF_ERROR(Check(path_));
  Status status;
  if (IsThere(path_)) {
    fs::rename(path_, old, error);
    if (!error) status = Check(old);
  }
  if (status.ok() && !error) fs::rename(beside_ / kNew, path_, error);
  if (status.ok() && !error) {
    fs::remove_all(old, error);
    return {};
  }
  if (error) status = {StatusCode::kDataLoss, "cannot put '" + FromPath(path_) + "' in its place: " + error.message()};
  if (IsThere(old) && !IsThere(path_)) fs::rename(old, path_, error);
  if (IsThere(old)) return {status.code(), status.message() + "; what was there is '" + FromPath(old) + "'"};
  return status;
}

OutputFolder::~OutputFolder() {
  if (beside_.empty()) return;
  std::error_code error;
  fs::remove_all(beside_ / kNew, error);
  fs::remove(beside_, error);  // not where it still holds what stood in the place
}

}  // namespace consac::twin
