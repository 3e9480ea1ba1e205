#pragma once
// The rows of generalised state-dependent exploration (gSDE) that algorithms of Box actions share. Private to learn.

#include "algo/parameter_rows.h"
#include "consac/policy/state_noise.h"

namespace consac::learn {

/// Whether actions explore by their state, and how.
struct SdeOptions {
  bool use_sde = false;  ///< otherwise by a number of their own for each element and step
  StateNoise noise;      ///< features and clip_mean are not the user's
};

/// Of the options `O`, whose member `sde` is SdeOptions.
template <class O, auto sde>
inline constexpr ParameterRow<O> kSdeRows[] = {
    {"use_sde", "use_sde", Into<O, sde, &SdeOptions::use_sde>, "false", "false", 0, 0, "",
     "Box actions explore by noise that is a function of the state (gSDE)", ParameterSource::kSb3},
    {"sde_sample_freq", "sde_sample_freq", Into<O, sde, &SdeOptions::noise, &StateNoise::sample_freq>, "-1", "-1", -1,
     1e9, "", "with gSDE: steps after which that function is drawn anew; -1: as each rollout begins alone",
     ParameterSource::kSb3},
    {"full_std", "full_std", Into<O, sde, &SdeOptions::noise, &StateNoise::full_std>, "true", "true", 0, 0, "",
     "with gSDE: a deviation for each feature and element of the action; false: for each feature",
     ParameterSource::kSb3},
    {"use_expln", "use_expln", Into<O, sde, &SdeOptions::noise, &StateNoise::use_expln>, "false", "false", 0, 0, "",
     "with gSDE: deviations grow as log(1 + x) + 1 above x = 0 instead of exp(x)", ParameterSource::kSb3},
};

}  // namespace consac::learn
