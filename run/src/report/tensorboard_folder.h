#pragma once
// Where a run's event files are. A resumed run adds a file to the folder that is there.

#include <memory>
#include <string>

#include "consac/base/status.h"
#include "consac/learn/log/output_file.h"
#include "consac/learn/log/tensorboard.h"

namespace consac::run {

/// The folder of a run as Stable Baselines names it, made when missing: root/PPO2_1. A resumed run gets the latest
/// that exists, a new one the number after it.
Result<std::string> TensorboardFolder(const std::string& root, const std::string& algorithm, learn::OpenMode mode);
/// Starts a file in `folder`, which comes after those that are there. `wall_time` in seconds since 1970.
Result<std::unique_ptr<learn::EventWriter>> OpenEvents(const std::string& folder, double wall_time);

}  // namespace consac::run
