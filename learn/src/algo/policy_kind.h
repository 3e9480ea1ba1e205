#pragma once
// Which kind of network Stable Baselines' `policy` asks for, and what that means for the observations of a behaviour.
// Private to learn.

#include "consac/env/vector_env.h"
#include "consac/nn/features.h"

namespace consac::learn {

/// The values of `policy`, in the order of the rows' choices; algorithms with an actor have the first four.
enum class PolicyKind : std::uint8_t { kAuto, kMlp, kCnn, kMultiInput, kLnMlp, kLnCnn };

/// How observations enter the network.
struct ObservationEntry {
  nn::FeatureOptions features;  ///< images; how the weights start is still unset
  bool hidden_layers = true;    ///< whether hidden layers stand behind that unless net_arch says so
};

/// What `kind` means for `behaviour`, whose observations are `normalised` before they enter or not. kAuto: the nature
/// CNN where the observation is an image, a CNN for each (kMultiInput) where there are images beside other things, and
/// dense layers where there is none or one is too small. The error says what a CNN cannot read.
/// Source: Stable Baselines3, common/torch_layers.py (NatureCNN, CombinedExtractor) and common/policies.py.
Result<ObservationEntry> EntryOf(PolicyKind kind, const BehaviourSpec& behaviour, bool normalised);

}  // namespace consac::learn
