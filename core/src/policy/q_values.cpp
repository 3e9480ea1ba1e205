// Values of the choices of a Discrete leaf, as DQN learns them. They are no distribution: the best legal choice is
// taken in either mode (exploring is the algorithm's), with probability 1.

#include "policy/distributions.h"

namespace consac {
namespace {

bool IsDiscrete(const Leaf& leaf) {
  return leaf.space.kind() == SpaceKind::kDiscrete;
}

std::int64_t ValueCount(const Leaf& leaf) {
  return leaf.space.n();
}

void SelectBest(const Leaf& leaf, const HeadRow& row, ActionMode, Rng&, float* raw) {
  raw[0] = static_cast<float>(BestLegal(row.head, row.mask, leaf.space.n()));
}

float LogProbabilityOfBest(const Leaf& leaf, const HeadRow& row, const float* raw) {
  const bool best = static_cast<std::int64_t>(raw[0]) == BestLegal(row.head, row.mask, leaf.space.n());
  return best ? 0.0f : kMaskedLogit;
}

float NoEntropy(const Leaf&, const HeadRow&) {
  return 0.0f;
}

float KlOfBest(const Leaf& leaf, const HeadRow& from, const HeadRow& to) {
  const float best = static_cast<float>(BestLegal(from.head, from.mask, leaf.space.n()));
  return -LogProbabilityOfBest(leaf, {to.head, nullptr, from.mask}, &best);
}

}  // namespace

Distribution QValuesDistribution() {
  return {.name = "q_values",
          .fits = IsDiscrete,
          .head_size = ValueCount,
          .select = SelectBest,
          .log_probability = LogProbabilityOfBest,
          .entropy = NoEntropy,
          .kl = KlOfBest,
          .world_value = ChoiceInWorld};
}

}  // namespace consac
