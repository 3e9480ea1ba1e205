#pragma once
// How a world tells whether an episode was a success, beside what it pays: a column of VectorEnv::infos.

namespace consac {

/// The column's name: 1 where a step led to where the agent should be, else 0. An episode succeeds whose last step did.
/// Gymnasium-Robotics' and Stable Baselines3's word.
inline constexpr const char* kSuccessInfo = "is_success";

}  // namespace consac
