#pragma once
// Files under the engine's own paths: res:// (which in an exported game lies inside the .pck), user://, and plain ones.

#include <cstddef>
#include <string>
#include <vector>

#include "consac/base/status.h"

namespace consac::godot {

/// The bytes of a file that the engine can open.
Result<std::vector<std::byte>> ReadEngineFile(const std::string& path);
/// The path of a file that is to be written, as the system knows it; the error says where nothing can be written.
Result<std::string> PathToWrite(const std::string& path);

}  // namespace consac::godot
