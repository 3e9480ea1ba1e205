// The categorical distribution of Discrete and MultiDiscrete leaves.

#include <algorithm>
#include <cmath>

#include "policy/distributions.h"

namespace consac {
namespace {

/// A run of logits that is one categorical choice, with its part of the mask.
struct Choice {
  const float* logits;       // [n]
  const std::uint8_t* mask;  // [n] or null
  std::int64_t n;

  float Logit(std::int64_t i) const { return mask == nullptr || mask[i] != 0 ? logits[i] : kMaskedLogit; }
  float Largest() const {
    float largest = Logit(0);
    for (std::int64_t i = 1; i < n; ++i) largest = std::max(largest, Logit(i));
    return largest;
  }
  float LogSum(float largest) const {
    float sum = 0.0f;
    for (std::int64_t i = 0; i < n; ++i) sum += std::exp(Logit(i) - largest);
    return std::log(sum);
  }
};

// Inverse of the distribution function: one draw a choice, whatever n is.
std::int64_t SampleChoice(const Choice& choice, Rng& rng) {
  const float largest = choice.Largest();
  float sum = 0.0f;
  for (std::int64_t i = 0; i < choice.n; ++i) sum += std::exp(choice.Logit(i) - largest);
  float left = rng.Uniform() * sum;
  std::int64_t last_legal = BestLegal(choice.logits, choice.mask, choice.n);
  for (std::int64_t i = 0; i < choice.n; ++i) {
    const float weight = std::exp(choice.Logit(i) - largest);
    if (weight <= 0.0f) continue;
    last_legal = i;
    left -= weight;
    if (left < 0.0f) return i;
  }
  return last_legal;
}

float ChoiceLogProbability(const Choice& choice, std::int64_t index) {
  const float largest = choice.Largest();
  return choice.Logit(index) - largest - choice.LogSum(largest);
}

float ChoiceEntropy(const Choice& choice) {
  const float largest = choice.Largest();
  const float log_sum = choice.LogSum(largest);
  float entropy = 0.0f;
  for (std::int64_t i = 0; i < choice.n; ++i) {
    const float log_p = choice.Logit(i) - largest - log_sum;
    const float p = std::exp(log_p);
    if (p > 0.0f) entropy -= p * log_p;
  }
  return entropy;
}

float ChoiceKl(const Choice& from, const Choice& to) {
  const float from_largest = from.Largest(), to_largest = to.Largest();
  const float from_sum = from.LogSum(from_largest), to_sum = to.LogSum(to_largest);
  float kl = 0.0f;
  for (std::int64_t i = 0; i < from.n; ++i) {
    const float log_p = from.Logit(i) - from_largest - from_sum;
    const float p = std::exp(log_p);
    if (p > 0.0f) kl += p * (log_p - (to.Logit(i) - to_largest - to_sum));
  }
  return kl;
}

/// Calls body(choice, index) for every choice of the leaf.
template <class Body>
void ForEachChoice(const Leaf& leaf, const HeadRow& row, Body&& body) {
  if (leaf.space.kind() == SpaceKind::kDiscrete) {
    body(Choice{row.head, row.mask, leaf.space.n()}, std::int64_t{0});
    return;
  }
  const float* head = row.head;
  const std::uint8_t* mask = row.mask;
  std::int64_t index = 0;
  for (const std::int64_t n : leaf.space.nvec()) {
    body(Choice{head, mask, n}, index++);
    head += n;
    if (mask != nullptr) mask += n;
  }
}

std::int64_t ChoiceHeadSize(const Leaf& leaf) {
  return leaf.feature_count;
}

void SelectChoice(const Leaf& leaf, const HeadRow& row, ActionMode mode, Rng& rng, float* raw) {
  const bool sample = mode == ActionMode::kSample;
  ForEachChoice(leaf, row, [&](const Choice& choice, std::int64_t index) {
    raw[index] =
        static_cast<float>(sample ? SampleChoice(choice, rng) : BestLegal(choice.logits, choice.mask, choice.n));
  });
}

float CategoricalLogProbability(const Leaf& leaf, const HeadRow& row, const float* raw) {
  float log_p = 0.0f;
  ForEachChoice(leaf, row, [&](const Choice& choice, std::int64_t index) {
    log_p += ChoiceLogProbability(choice, static_cast<std::int64_t>(raw[index]));
  });
  return log_p;
}

float CategoricalEntropy(const Leaf& leaf, const HeadRow& row) {
  float entropy = 0.0f;
  ForEachChoice(leaf, row, [&](const Choice& choice, std::int64_t) { entropy += ChoiceEntropy(choice); });
  return entropy;
}

float CategoricalKl(const Leaf& leaf, const HeadRow& from, const HeadRow& to) {
  float kl = 0.0f;
  ForEachChoice(leaf, from, [&](const Choice& choice, std::int64_t) {
    kl += ChoiceKl(choice, {to.head + (choice.logits - from.head), choice.mask, choice.n});
  });
  return kl;
}

}  // namespace

bool IsChoice(const Leaf& leaf) {
  return leaf.space.kind() == SpaceKind::kDiscrete || leaf.space.kind() == SpaceKind::kMultiDiscrete;
}

std::int64_t BestLegal(const float* values, const std::uint8_t* mask, std::int64_t n) {
  const Choice choice{values, mask, n};
  std::int64_t best = 0;
  for (std::int64_t i = 1; i < n; ++i) {
    if (choice.Logit(i) > choice.Logit(best)) best = i;
  }
  return best;
}

double ChoiceInWorld(const Leaf& leaf, std::int64_t, float raw) {
  return static_cast<double>(raw) + static_cast<double>(leaf.space.start());
}

Distribution CategoricalDistribution() {
  return {.name = "categorical",
          .fits = IsChoice,
          .head_size = ChoiceHeadSize,
          .select = SelectChoice,
          .log_probability = CategoricalLogProbability,
          .entropy = CategoricalEntropy,
          .kl = CategoricalKl,
          .world_value = ChoiceInWorld};
}

}  // namespace consac
