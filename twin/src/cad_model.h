#pragma once
// A CAD file as a robot with looks. Private to twin.

#include <memory>
#include <string>

#include "cad_process.h"
#include "consac/twin/cad_joints.h"
#include "consac/twin/import.h"

namespace consac::twin {

/// Whether a file of this name is CAD: .step, .stp, .iges, .igs.
bool IsCad(const std::string& path);

/// A CAD file that was read.
struct CadFile {
  std::shared_ptr<CadOutput> output;  ///< what the assembly's triangles are in
  CadAssembly assembly;
  CadRobot found;
};

/// Reads `path` by consac-cad and looks for joints. Errors name the file.
Result<CadFile> OpenCad(const std::string& path, const CadOptions& options, const ImportProgress& progress);
/// The robot and a shape for each part that stands somewhere; a mesh is called by its part's number.
Model ModelOf(const CadFile& file);

}  // namespace consac::twin
