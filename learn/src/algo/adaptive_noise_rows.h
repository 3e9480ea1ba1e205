#pragma once
// The rows of AdaptiveNoiseOptions, wherever an algorithm's options hold them. Private to learn.

#include "algo/parameter_rows.h"
#include "collect/adaptive_noise.h"

namespace consac::learn {

/// kAdaptiveNoiseRows<Options, path...>: the members that lead from Options to its AdaptiveNoiseOptions.
template <class Options, auto... path>
inline constexpr ParameterRow<Options> kAdaptiveNoiseRows[] = {
    {"param_noise", "param_noise", Into<Options, path..., &AdaptiveNoiseOptions::on>, "false", "false", 0, 0, "",
     "explore by noise in the actor's parameters", ParameterSource::kSb2},
    {"param_noise_stddev", "param_noise_stddev", Into<Options, path..., &AdaptiveNoiseOptions::deviation>, "0.1", "0.1",
     1e-30, ParameterNoise::kStrongest, "", "its deviation at the start", ParameterSource::kSb2},
    {"desired_action_stddev", "desired_action_stddev", Into<Options, path..., &AdaptiveNoiseOptions::distance>, "0.1",
     "0.1", 0, 2, "", "how far it shall move actions, which go from -1 to 1", ParameterSource::kSb2},
    {"adoption_coefficient", "adoption_coefficient", Into<Options, path..., &AdaptiveNoiseOptions::factor>, "1.01",
     "1.01", 1, 10, "", "factor by which its deviation grows or shrinks", ParameterSource::kSb2},
    {"param_noise_adaption_interval", "param_noise_adaption_interval",
     Into<Options, path..., &AdaptiveNoiseOptions::interval>, "50", "50", 1, 1e9, "",
     "gradient steps between two of those", ParameterSource::kSb2},
};

}  // namespace consac::learn
