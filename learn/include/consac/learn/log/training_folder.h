#pragma once
// A folder for what one training tells of itself, named as Stable Baselines names those for TensorBoard.

#include <string>

#include "consac/base/status.h"

namespace consac::learn {

/// Makes `folder`/PPO2_1 for an algorithm "ppo2", or the next number that is free, and `folder` where it is not there.
/// The error names what cannot be made.
Result<std::string> MakeTrainingFolder(const std::string& folder, std::string algorithm);

}  // namespace consac::learn
