#pragma once
// Folders and paths of the importer: where a mesh's name leads, and an output folder that is whole or not there.
// Private to twin.

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/path.h"
#include "consac/base/status.h"

namespace consac::twin {

/// Names in an output folder: of the joint table, of what was read and made, and of the folder of meshes.
inline constexpr const char *kTableName = "twin.json", *kReportName = "report.json", *kMeshFolder = "meshes";

/// ASCII capitals made small: names of files that differ by them alone are one on some systems.
std::string LowerCase(std::string text);
/// The ending of a file's name in small letters, ".stl"; "" none.
std::string EndingOf(const std::string& path);

/// Finds mesh files by the names in a description, and only below one folder.
class MeshFinder {
 public:
  /// `description` is the file; `root` the folder that may be read, "" for the nearest with a package.xml above the
  /// file, else the file's own; `packages` are folders of packages by name.
  MeshFinder(const std::string& description, const std::string& root, std::map<std::string, std::string> packages);
  /// The file that "package://NAME/path", "file://path", or a path relative to the description means. kInvalidArgument
  /// where it leads out of the root (links are followed), kNotFound where nothing is there.
  Result<std::string> Find(const std::string& name) const;
  /// The folder that is read.
  const std::filesystem::path& root() const { return root_; }

 private:
  Result<std::filesystem::path> Package(std::string_view name) const;

  std::filesystem::path folder_, root_;
  std::map<std::string, std::string> packages_;
};

/// A folder that is written beside its place and moved there once whole; without Commit nothing is left.
class OutputFolder {
 public:
  OutputFolder() = default;
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;
  /// Says where the folder is to be. What is there is refused (kAlreadyExists), unless it is empty, or `replace` and an
  /// import's with nothing else in it. Makes nothing.
  Status Choose(const std::string& path, bool replace);
  /// Begins it, once it is chosen.
  Status Open();
  /// Where to write until then.
  std::string file(const std::string& name) const;
  /// Puts it in its place, once, if what is there by now may still be replaced.
  Status Commit();

 private:
  Status Check(const std::filesystem::path& folder) const;

  std::filesystem::path path_, beside_;  // beside_ is a folder that was made here
  bool replace_ = false;
};

}  // namespace consac::twin
