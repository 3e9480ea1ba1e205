#include "algo/policy_kind.h"

#include <algorithm>

#include "consac/base/text.h"

namespace consac::learn {
namespace {

constexpr std::int64_t kCombinedFeatures = 256;  // of each image among other things: Stable Baselines3

PolicyKind KindFor(const Layout& observation) {
  const std::vector<Leaf>& leaves = observation.leaves;
  const auto too_small = [](const Leaf& leaf) { return nn::IsImage(leaf) && !nn::FitsNatureCnn(leaf); };
  if (!nn::HasImage(observation) || std::any_of(leaves.begin(), leaves.end(), too_small)) return PolicyKind::kMlp;
  return leaves.size() == 1 ? PolicyKind::kCnn : PolicyKind::kMultiInput;
}

}  // namespace

Result<ObservationEntry> EntryOf(PolicyKind kind, const BehaviourSpec& behaviour, bool normalised) {
  const Layout& observation = behaviour.observation_layout;
  if (kind == PolicyKind::kAuto) kind = KindFor(observation);
  ObservationEntry entry;
  entry.features.divide = !normalised;
  if (kind == PolicyKind::kMlp || kind == PolicyKind::kLnMlp) return entry;
  entry.features.extractor = nn::Extractor::kNatureCnn;
  if (kind == PolicyKind::kMultiInput) {
    entry.features.cnn_features = kCombinedFeatures;
    return entry;
  }
  if (!nn::HasImage(observation)) {
    return Status{StatusCode::kInvalidArgument, "CnnPolicy reads images (uint8, three sizes, 0 to 255), and " +
                                                    Quote(behaviour.name) +
                                                    " observes none; use MlpPolicy, or send images"};
  }
  entry.hidden_layers = false;
  return entry;
}

}  // namespace consac::learn
