#include "consac/policy/head.h"

#include <algorithm>
#include <cmath>

#include "consac/base/text.h"

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
  std::int64_t Mode() const {
    std::int64_t best = 0;
    for (std::int64_t i = 1; i < n; ++i) {
      if (Logit(i) > Logit(best)) best = i;
    }
    return best;
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
  std::int64_t last_legal = choice.Mode();
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

/// Calls body(choice, index) for every categorical choice of a discrete leaf.
template <class Body>
void ForEachChoice(const Leaf& leaf, const float* head, const std::uint8_t* mask, Body&& body) {
  if (leaf.space.kind() == SpaceKind::kDiscrete) {
    body(Choice{head, mask, leaf.space.n()}, std::int64_t{0});
    return;
  }
  if (leaf.space.kind() == SpaceKind::kMultiBinary) return;
  std::int64_t index = 0;
  for (const std::int64_t n : leaf.space.nvec()) {
    body(Choice{head, mask, n}, index++);
    head += n;
    if (mask != nullptr) mask += n;
  }
}

float Sigmoid(float x) {
  return 1.0f / (1.0f + std::exp(-x));
}

float BitLogit(const float* head, const std::uint8_t* mask, std::int64_t i) {
  return MaskedBitLogit(head[i], mask == nullptr ? nullptr : mask + 2 * i);
}

/// What one leaf sees of a row.
struct LeafView {
  const float* head;
  const float* log_std;
  const std::uint8_t* mask;
  std::int64_t raw_offset;
};

/// Calls body(leaf, view) for every leaf of a row, with running offsets.
template <class Body>
void ForEachLeaf(const Layout& action, const float* head, const float* log_std, const std::uint8_t* mask, Body&& body) {
  std::int64_t raw_offset = 0;
  for (const Leaf& leaf : action.leaves) {
    body(leaf, LeafView{head, log_std, mask == nullptr ? nullptr : mask + leaf.mask_offset, raw_offset});
    head += leaf.feature_count;
    if (leaf.space.kind() == SpaceKind::kBox && log_std != nullptr) log_std += leaf.count;
    raw_offset += leaf.count;
  }
}

void SelectLeaf(const Leaf& leaf, const LeafView& view, ActionMode mode, Rng& rng, float* raw) {
  const bool sample = mode == ActionMode::kSample;
  if (leaf.space.kind() == SpaceKind::kBox) {
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      raw[i] = view.head[i] + (sample ? std::exp(view.log_std[i]) * rng.Normal() : 0.0f);
    }
    return;
  }
  if (leaf.space.kind() == SpaceKind::kMultiBinary) {
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const float p = Sigmoid(BitLogit(view.head, view.mask, i));
      raw[i] = (sample ? rng.Uniform() < p : p > 0.5f) ? 1.0f : 0.0f;
    }
    return;
  }
  ForEachChoice(leaf, view.head, view.mask, [&](const Choice& choice, std::int64_t index) {
    raw[index] = static_cast<float>(sample ? SampleChoice(choice, rng) : choice.Mode());
  });
}

float LeafLogProbability(const Leaf& leaf, const LeafView& view, const float* raw) {
  float log_p = 0.0f;
  if (leaf.space.kind() == SpaceKind::kBox) {
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const float z = (raw[i] - view.head[i]) * std::exp(-view.log_std[i]);
      log_p -= 0.5f * z * z + view.log_std[i] + 0.5f * kLogTwoPi;
    }
  } else if (leaf.space.kind() == SpaceKind::kMultiBinary) {
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const float logit = BitLogit(view.head, view.mask, i);
      log_p -= raw[i] > 0.5f ? Softplus(-logit) : Softplus(logit);
    }
  } else {
    ForEachChoice(leaf, view.head, view.mask, [&](const Choice& choice, std::int64_t index) {
      log_p += ChoiceLogProbability(choice, static_cast<std::int64_t>(raw[index]));
    });
  }
  return log_p;
}

float LeafEntropy(const Leaf& leaf, const LeafView& view) {
  float entropy = 0.0f;
  if (leaf.space.kind() == SpaceKind::kBox) {
    for (std::int64_t i = 0; i < leaf.count; ++i) entropy += view.log_std[i] + 0.5f * (kLogTwoPi + 1.0f);
  } else if (leaf.space.kind() == SpaceKind::kMultiBinary) {
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const float logit = BitLogit(view.head, view.mask, i);
      const float p = Sigmoid(logit);
      entropy += p * Softplus(-logit) + (1.0f - p) * Softplus(logit);
    }
  } else {
    ForEachChoice(leaf, view.head, view.mask,
                  [&](const Choice& choice, std::int64_t) { entropy += ChoiceEntropy(choice); });
  }
  return entropy;
}

const std::uint8_t* MaskRow(const Layout& action, const std::uint8_t* masks, std::int64_t row) {
  return masks == nullptr ? nullptr : masks + row * action.mask_bytes;
}

}  // namespace

float Softplus(float x) {
  return std::max(x, 0.0f) + std::log1p(std::exp(-std::fabs(x)));
}

float MaskedBitLogit(float logit, const std::uint8_t* mask) {
  if (mask == nullptr || (mask[0] != 0 && mask[1] != 0)) return logit;
  return mask[1] != 0 ? -kMaskedLogit : kMaskedLogit;
}

std::int64_t HeadSize(const Layout& action) {
  return action.feature_count;
}

std::int64_t LogStdSize(const Layout& action) {
  std::int64_t size = 0;
  for (const Leaf& leaf : action.leaves) size += leaf.space.kind() == SpaceKind::kBox ? leaf.count : 0;
  return size;
}

std::int64_t RawActionSize(const Layout& action) {
  std::int64_t size = 0;
  for (const Leaf& leaf : action.leaves) size += leaf.count;
  return size;
}

Status CheckHead(const Layout& action) {
  for (const Leaf& leaf : action.leaves) {
    if (leaf.space.kind() == SpaceKind::kBox && (leaf.dtype != DType::kF32 || leaf.space.shape().size() != 1)) {
      return {StatusCode::kInvalidArgument,
              "the action " + leaf.space.ToString() + (leaf.name.empty() ? "" : " at '" + leaf.name + "'") +
                  " has no action head; a Box action must be one-dimensional and float32"};
    }
  }
  return Status::Ok();
}

void SelectActions(const Layout& action, const float* head, const float* log_std, const std::uint8_t* masks,
                   std::int64_t rows, ActionMode mode, Rng& rng, float* raw, float* log_probability) {
  const std::int64_t head_size = HeadSize(action), raw_size = RawActionSize(action);
  for (std::int64_t r = 0; r < rows; ++r) {
    float* raw_row = raw + r * raw_size;
    float log_p = 0.0f;
    ForEachLeaf(action, head + r * head_size, log_std, MaskRow(action, masks, r),
                [&](const Leaf& leaf, const LeafView& view) {
                  SelectLeaf(leaf, view, mode, rng, raw_row + view.raw_offset);
                  if (log_probability != nullptr) log_p += LeafLogProbability(leaf, view, raw_row + view.raw_offset);
                });
    if (log_probability != nullptr) log_probability[r] = log_p;
  }
}

void WriteActions(const Layout& action, const float* raw, std::int64_t rows, std::byte* out) {
  const std::int64_t raw_size = RawActionSize(action);
  for (std::int64_t r = 0; r < rows; ++r) {
    const float* from = raw + r * raw_size;
    std::byte* row = out + static_cast<std::size_t>(r) * action.row_bytes;
    for (const Leaf& leaf : action.leaves) {
      const bool box = leaf.space.kind() == SpaceKind::kBox;
      for (std::int64_t i = 0; i < leaf.count; ++i) {
        const auto e = static_cast<std::size_t>(i);
        const double value = box ? std::clamp(static_cast<double>(from[i]), leaf.space.low()[e], leaf.space.high()[e])
                                 : static_cast<double>(from[i]) + static_cast<double>(leaf.space.start());
        WriteElement(leaf, row, i, value);
      }
      from += leaf.count;
    }
  }
}

void LogProbability(const Layout& action, const float* head, const float* log_std, const std::uint8_t* masks,
                    const float* raw, std::int64_t rows, float* out) {
  const std::int64_t head_size = HeadSize(action), raw_size = RawActionSize(action);
  for (std::int64_t r = 0; r < rows; ++r) {
    out[r] = 0.0f;
    const float* raw_row = raw + r * raw_size;
    ForEachLeaf(action, head + r * head_size, log_std, MaskRow(action, masks, r),
                [&](const Leaf& leaf, const LeafView& view) {
                  out[r] += LeafLogProbability(leaf, view, raw_row + view.raw_offset);
                });
  }
}

void Entropy(const Layout& action, const float* head, const float* log_std, const std::uint8_t* masks,
             std::int64_t rows, float* out) {
  const std::int64_t head_size = HeadSize(action);
  for (std::int64_t r = 0; r < rows; ++r) {
    out[r] = 0.0f;
    ForEachLeaf(action, head + r * head_size, log_std, MaskRow(action, masks, r),
                [&](const Leaf& leaf, const LeafView& view) { out[r] += LeafEntropy(leaf, view); });
  }
}

}  // namespace consac
