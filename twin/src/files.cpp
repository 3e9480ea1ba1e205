#include "files.h"

#include <algorithm>
#include <system_error>

#include "consac/base/file.h"
#include "consac/base/text.h"

namespace consac::twin {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kOurs[] = {"twin.glb", "twin.json", "twin.urdf", "twin.xml", "report.json", "meshes"};
constexpr int kMostLevels = 4;  // above the description, where its package may begin

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

// What somebody else put into an import's folder; "" nothing.
std::string Foreign(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = FromPath(at->path().filename());
    if (std::find(std::begin(kOurs), std::end(kOurs), name) == std::end(kOurs)) return name;
  }
  return error ? std::string("?") : std::string();
}

}  // namespace

fs::path ToPath(const std::string& utf8) {
#if defined(_WIN32)
  return WidePath(utf8);
#else
  return utf8;
#endif
}

std::string FromPath(const fs::path& path) {
#if defined(_WIN32)
  const std::u8string utf8 = path.generic_u8string();
  return {utf8.begin(), utf8.end()};
#else
  return path.native();
#endif
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
  if (IsThere(root_ / ToPath(std::string(name)))) return root_ / ToPath(std::string(name));
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

Status OutputFolder::Open(const std::string& path, bool replace) {
  std::error_code error;
  path_ = fs::absolute(ToPath(path), error).lexically_normal();
  if (!path_.has_filename()) path_ = path_.parent_path();
  replace_ = replace;
  const std::string name = FromPath(path_);
  const bool empty = fs::is_directory(path_, error) && fs::is_empty(path_, error);
  if (IsThere(path_) && !empty) {
    const std::string foreign = fs::is_directory(path_, error) ? Foreign(path_) : std::string("?");
    if (!foreign.empty())
      return {StatusCode::kAlreadyExists,
              "'" + name + "' holds what is no import's (" + Quote(foreign) + "); give another folder"};
    if (!replace)
      return {StatusCode::kAlreadyExists,
              "'" + name + "' holds an import already; give another folder, or --force to replace it"};
  }
  temporary_ = path_;
  temporary_ += ".importing";
  if (IsThere(temporary_) && !Foreign(temporary_).empty())
    return {StatusCode::kAlreadyExists, "'" + FromPath(temporary_) + "' is in the way; remove it"};
  fs::remove_all(temporary_, error);
  if (!fs::create_directories(temporary_ / "meshes", error) || error) {
    const std::string why = error.message();
    temporary_.clear();
    return {StatusCode::kDataLoss, "cannot make the folder '" + name + "': " + why};
  }
  return {};
}

std::string OutputFolder::file(const std::string& name) const {
  return FromPath(temporary_ / ToPath(name));
}

Status OutputFolder::Commit() {
  std::error_code error;
  fs::path old = path_;
  old += ".replaced";
  fs::remove_all(old, error);
  const bool there = IsThere(path_);
  if (there) fs::rename(path_, old, error);
  if (!error) fs::rename(temporary_, path_, error);
  if (error) {
    const std::string why = error.message();
    if (there && !IsThere(path_)) fs::rename(old, path_, error);
    return {StatusCode::kDataLoss, "cannot put '" + FromPath(path_) + "' in its place: " + why};
  }
  temporary_.clear();
  fs::remove_all(old, error);
  return {};
}

OutputFolder::~OutputFolder() {
  std::error_code error;
  if (!temporary_.empty()) fs::remove_all(temporary_, error);
}

}  // namespace consac::twin
