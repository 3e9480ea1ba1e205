#pragma once
// `consac twin import`: one robot's description in, a folder of files for engines, simulators and people out. Used by
// the program and by whoever links the library. The folder is whole or not there.

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "consac/base/status.h"
#include "consac/robot/robot.h"
#include "consac/twin/cad_joints.h"
#include "consac/twin/model.h"

namespace consac::twin {

inline constexpr std::size_t kBytesPerTriangle = 160;  ///< of a closed mesh of a million, measured; of loose ones twice

/// Told before each part: how many of at most how many are done. False stops with kCancelled. May be empty.
using ImportProgress = std::function<bool(std::size_t done, std::size_t of)>;

/// How CAD files (STEP, IGES) are read.
struct CadOptions {
  std::string program;         ///< consac-cad; "": beside the running program, then in PATH
  double deflection = 0.2e-3;  ///< farthest that triangles leave a surface, m
  double angle = 0.35;         ///< most between neighbouring triangles, rad; what counts on small round parts
  double seconds = 300.0;      ///< most that consac-cad may take, of the clock and of a core
  double mebibytes = 4096.0;   ///< most memory of consac-cad
  std::string hints;           ///< file of hints on joints (cad_joints.h); "" none
  std::string kinematics;      ///< URDF or MJCF whose joints overrule what is found; "" none
};

/// How to import.
struct ImportOptions {
  std::string output;    ///< folder to make
  bool replace = false;  ///< an earlier import that is there
  std::string root;      ///< folder that meshes may be read from; "" the package's or the file's own
  std::map<std::string, std::string> packages;  ///< folders of "package://NAME/..."
  std::string srdf;                             ///< file with links that may touch; "" none
  double density = 0.0;                         ///< kg/m^3 of links whose mass the file does not say; 0: left out
  CadOptions cad;                               ///< of a STEP or IGES file
  ImportProgress progress;                      ///< before each mesh is read, and before each link
};

/// What was made.
struct ImportReport {
  robot::Robot robot;
  std::size_t meshes = 0;             ///< files
  std::size_t triangles = 0;          ///< of them
  std::size_t most_triangles = 0;     ///< of the largest: what was in memory at once, kBytesPerTriangle each
  std::vector<std::string> files;     ///< that were written, below the folder
  std::vector<std::string> warnings;  ///< a line each
};

/// Reads a description: a URDF or an MJCF. CAD files are for Import. kInvalidArgument says what is read where it is
/// something else; errors name the file.
Result<Model> ReadModel(const std::string& path);
/// Reads `path`, writes twin.glb, twin.usda, twin.json, twin.urdf, twin.xml (MJCF), report.json and meshes/*.stl, of a
/// CAD file candidates.json too. The same bytes for the same input. One mesh is in memory at a time. Errors are one
/// line; nothing is left then.
Result<ImportReport> Import(const std::string& path, const ImportOptions& options);
/// What is looked for in a CAD file: its components and joint candidates, and what became of each.
Result<CadRobot> FindCandidates(const std::string& path, const CadOptions& options, const ImportProgress& progress);
/// The same as JSON (docs/twin.md).
std::string CandidatesText(const CadRobot& robot);
/// A line for each joint that turns and whose limits are more than four turns apart: degrees, most likely. A limit of
/// 1e6 rad and more means none (twin.urdf) and is not looked at.
std::vector<std::string> WideLimits(const robot::Robot& robot);
/// The joint table of an import's folder, of a twin.json or of a description.
Result<robot::Robot> LoadRobot(const std::string& path);

}  // namespace consac::twin
