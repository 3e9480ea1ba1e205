#pragma once
// The rows of VecNormaliseOptions, wherever an algorithm's options hold them. Private to learn.

#include "algo/parameter_rows.h"
#include "collect/vec_normalise.h"

namespace consac::learn {

/// kNormaliseRows<Options, path...>: the members that lead from Options to its VecNormaliseOptions.
template <class Options, auto... path>
inline constexpr ParameterRow<Options> kNormaliseRows[] = {
    {"norm_obs", "norm_obs", Into<Options, path..., &VecNormaliseOptions::norm_obs>, "false", "false", 0, 0, "",
     "normalise observations by their running moments", ParameterSource::kVecNormalize},
    {"norm_reward", "norm_reward", Into<Options, path..., &VecNormaliseOptions::norm_reward>, "false", "false", 0, 0,
     "", "scale rewards by the running deviation of the return", ParameterSource::kVecNormalize},
    {"clip_obs", "clip_obs", Into<Options, path..., &VecNormaliseOptions::clip_obs>, "10", "10", 1e-6, 1e9, "",
     "largest normalised observation", ParameterSource::kVecNormalize},
    {"clip_reward", "clip_reward", Into<Options, path..., &VecNormaliseOptions::clip_reward>, "10", "10", 0, kUnlimited,
     "", "largest scaled reward", ParameterSource::kVecNormalize},
    {"norm_epsilon", "norm_epsilon", Into<Options, path..., &VecNormaliseOptions::epsilon>, "1e-8", "1e-8", 0, 1, "",
     "added to variances", ParameterSource::kVecNormalize},
};

}  // namespace consac::learn
