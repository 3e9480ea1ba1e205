#pragma once
// What reads a description's file. Private to twin.

#include <string>

#include "consac/base/status.h"
#include "consac/twin/model.h"

namespace consac::twin {

/// An error with the file's name before it.
Status Of(const std::string& file, const Status& status);
/// A text that may be as long as a description; errors as ReadRegularFile.
Result<std::string> ReadText(const std::string& path);
/// ReadModel, and the bytes it was read from.
Result<Model> ReadModelAndText(const std::string& path, std::string* text);

}  // namespace consac::twin
