#pragma once
// A folder for what one training tells of itself, named as Stable Baselines names those for TensorBoard.

#include <cstdint>
#include <string>
#include <string_view>

#include "consac/base/status.h"

namespace consac::learn {

/// "PPO2_" for "ppo2": what stands before the number.
std::string TrainingFolderPrefix(std::string_view algorithm);
/// Makes `folder`/PPO2_1 for an algorithm "ppo2", or the next number beyond `latest` that is free, and `folder` where
/// it is not there. The error names what cannot be made.
Result<std::string> MakeTrainingFolder(const std::string& folder, std::string_view algorithm, std::int64_t latest = 0);

}  // namespace consac::learn
