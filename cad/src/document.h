#pragma once
// A STEP or IGES file as a stream of twin/cad.h.

#include <functional>
#include <string>

#include "consac/base/status.h"
#include "consac/twin/cad.h"
#include "shape.h"

namespace consac::cad {

/// Called before each part: how many are done of at most how many.
using Progress = std::function<void(std::size_t done, std::size_t of)>;

/// Reads `path`, by its ending, and writes it. Errors in one line, without the path. Throws what OpenCASCADE throws.
Status Convert(const std::string& path, const Fineness& fineness, const twin::CadWriter::Sink& sink,
               const Progress& progress);

}  // namespace consac::cad
