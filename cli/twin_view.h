#pragma once
// `consac twin view`: a page, served by the program itself, on which a twin's joints can be moved and a model plays.

#include <cstdint>
#include <string>
#include <string_view>

#include "consac/twin/import.h"

namespace consac::cli {

/// What to show, and where.
struct ViewFlags {
  std::string model, runs = "runs", port_file;
  std::int64_t port = 8080, seed = 1000;
  double deadline_s = 20.0;  ///< that a connection may take from its beginning to its last byte
  bool open = false;         ///< ask the system for a browser
  twin::CadOptions cad;      ///< of a STEP file
};
/// Serves the twin at `input`, an import's folder or a description, until it is stopped; returns the exit code.
int ViewTwin(const std::string& input, const ViewFlags& flags);

/// One file of the page, as it is in cli/viewer.
struct ViewerFile {
  std::string_view path;  ///< "/viewer.js"
  std::string_view type;
  std::string_view text;
};
/// The file at that path; null where there is none. Made from cli/viewer by CMake.
const ViewerFile* FindViewerFile(std::string_view path);

}  // namespace consac::cli
