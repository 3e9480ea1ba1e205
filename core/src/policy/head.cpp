#include "consac/policy/head.h"

#include <cmath>

#include "consac/base/text.h"

namespace consac {
namespace {

void WriteLeaf(const Leaf& leaf, const Distribution& distribution, const float* raw, std::byte* row) {
  for (std::int64_t i = 0; i < leaf.count; ++i) WriteElement(leaf, row, i, distribution.world_value(leaf, i, raw[i]));
}

Status NoHead(const Leaf& leaf, const std::string& why) {
  return {StatusCode::kInvalidArgument,
          "the action " + leaf.space.ToString() + (leaf.name.empty() ? "" : " at '" + leaf.name + "'") + why};
}

/// One head follows the state by as many features, and as often drawn anew, as the others that do.
constexpr std::int64_t kLargestExploration = std::int64_t{1} << 20;  // floats of a slot's matrices

Status TakeStateNoise(const Leaf& leaf, const StateNoise& noise, std::int64_t before, std::int64_t* features,
                      std::int64_t* sample_freq) {
  if (noise.features < 1 || noise.features > (kLargestExploration - before) / leaf.count)
    return NoHead(leaf, " explores by " + std::to_string(noise.features) +
                            " features; expected 1 or more, and at most " + std::to_string(kLargestExploration) +
                            " numbers in all matrices of an agent together");
  if (!(noise.clip_mean >= 0.0f) || !std::isfinite(noise.clip_mean))
    return NoHead(leaf, " brings means within " + NumberText(noise.clip_mean) + "; expected 0 or more");
  const bool first = *features == 0;
  if (!first && (*features != noise.features || *sample_freq != noise.sample_freq))
    return NoHead(leaf, " explores by other features, or for longer, than the leaf before it");
  *features = noise.features;
  *sample_freq = noise.sample_freq;
  return Status::Ok();
}

Status CheckDefaultHead(const Leaf& leaf) {
  if (DefaultDistribution(leaf).fits(leaf)) return Status::Ok();
  return NoHead(leaf, " has no action head; a Box action must be one-dimensional and float32");
}

}  // namespace

std::vector<HeadSpec> DefaultHeads(const Layout& action) {
  std::vector<HeadSpec> heads;
  for (const Leaf& leaf : action.leaves) heads.push_back({leaf.name, std::string(DefaultDistribution(leaf).name)});
  return heads;
}

Result<ActionHead> ActionHead::Create(const Layout& action, std::span<const HeadSpec> heads) {
  if (!heads.empty() && heads.size() != action.leaves.size()) {
    return Status{StatusCode::kInvalidArgument, "the model names " + std::to_string(heads.size()) +
                                                    " heads, its action space has " +
                                                    std::to_string(action.leaves.size()) + " leaves"};
  }
  ActionHead result;
  result.row_bytes_ = action.row_bytes;
  result.mask_bytes_ = action.mask_bytes;
  for (std::size_t i = 0; i < action.leaves.size(); ++i) {
    const Leaf& leaf = action.leaves[i];
    Part part{leaf, &DefaultDistribution(leaf), result.size_, 0, result.log_std_size_, result.raw_size_};
    if (heads.empty()) {
      CONSAC_RETURN_IF_ERROR(CheckDefaultHead(leaf));
    } else {
      if (heads[i].leaf != leaf.name)
        return NoHead(leaf, " has no head; the model names one for " + Quote(heads[i].leaf));
      part.distribution = FindDistribution(heads[i].type);
      if (part.distribution == nullptr)
        return NoHead(leaf, ": unknown head " + Quote(heads[i].type) + Suggestion(heads[i].type, DistributionNames()));
      if (!part.distribution->fits(leaf)) return NoHead(leaf, " cannot have the head " + Quote(heads[i].type));
    }
    part.head_size = part.distribution->head_size(leaf);
    if (part.distribution->follows_state) {
      part.noise = heads[i].noise;
      part.exploration_offset = result.exploration_size_;
      CONSAC_RETURN_IF_ERROR(
          TakeStateNoise(leaf, part.noise, result.exploration_size_, &result.features_, &result.sample_freq_));
      result.exploration_size_ += part.noise.features * leaf.count;
    }
    result.size_ += part.head_size;
    if (part.distribution->log_std_size != nullptr)
      result.log_std_size_ += part.distribution->log_std_size(leaf, part.noise);
    result.raw_size_ += leaf.count;
    result.parts_.push_back(std::move(part));
  }
  result.size_ += result.features_;
  return result;
}

std::vector<HeadSpec> ActionHead::specs() const {
  std::vector<HeadSpec> specs;
  for (const Part& part : parts_) specs.push_back({part.leaf.name, std::string(part.distribution->name), part.noise});
  return specs;
}

HeadRow ActionHead::RowOf(const Part& part, std::int64_t row, const float* head, const float* log_std,
                          const std::uint8_t* masks) const {
  return {head + row * size_ + part.head_offset,
          log_std == nullptr ? nullptr : log_std + part.log_std_offset,
          masks == nullptr ? nullptr : masks + row * mask_bytes_ + part.leaf.mask_offset,
          &part.noise,
          head + row * size_ + features_offset(),
          nullptr};
}

void ActionHead::DrawExploration(const float* log_std, Rng& rng, float* matrices) const {
  for (const Part& part : parts_) {
    if (!part.distribution->follows_state) continue;
    const StateNoise& noise = part.noise;
    float* matrix = matrices + part.exploration_offset;
    for (std::int64_t l = 0; l < noise.features; ++l) {
      for (std::int64_t i = 0; i < part.leaf.count; ++i) {
        const float own = log_std[part.log_std_offset + noise.log_std_of(l, i, part.leaf.count)];
        matrix[l * part.leaf.count + i] = noise.Deviation(own) * rng.Normal();
      }
    }
  }
}

void ActionHead::Select(const float* head, const float* log_std, const std::uint8_t* masks, std::int64_t rows,
                        ActionMode mode, Rng& rng, float* raw, float* log_probability, const SlotNoise& noise) const {
  for (std::int64_t r = 0; r < rows; ++r) {
    float log_p = 0.0f;
    for (const Part& part : parts_) {
      HeadRow row = RowOf(part, r, head, log_std, masks);
      if (noise.matrices != nullptr && part.distribution->follows_state) {
        const std::int64_t slot = noise.slots == nullptr ? r : noise.slots[r];
        row.exploration = noise.matrices + slot * exploration_size_ + part.exploration_offset;
      }
      float* out = raw + r * raw_size_ + part.raw_offset;
      part.distribution->select(part.leaf, row, mode, rng, out);
      if (log_probability != nullptr) log_p += part.distribution->log_probability(part.leaf, row, out);
    }
    if (log_probability != nullptr) log_probability[r] = log_p;
  }
}

void ActionHead::Write(const float* raw, std::int64_t rows, std::byte* out) const {
  for (std::int64_t r = 0; r < rows; ++r) {
    std::byte* row = out + static_cast<std::size_t>(r) * row_bytes_;
    for (const Part& part : parts_)
      WriteLeaf(part.leaf, *part.distribution, raw + r * raw_size_ + part.raw_offset, row);
  }
}

void ActionHead::LogProbability(const float* head, const float* log_std, const std::uint8_t* masks, const float* raw,
                                std::int64_t rows, float* out) const {
  for (std::int64_t r = 0; r < rows; ++r) {
    out[r] = 0.0f;
    for (const Part& part : parts_) {
      out[r] += part.distribution->log_probability(part.leaf, RowOf(part, r, head, log_std, masks),
                                                   raw + r * raw_size_ + part.raw_offset);
    }
  }
}

void ActionHead::Entropy(const float* head, const float* log_std, const std::uint8_t* masks, std::int64_t rows,
                         float* out) const {
  for (std::int64_t r = 0; r < rows; ++r) {
    out[r] = 0.0f;
    for (const Part& part : parts_)
      out[r] += part.distribution->entropy(part.leaf, RowOf(part, r, head, log_std, masks));
  }
}

void ActionHead::Kl(const float* from, const float* from_log_std, const float* to, const float* to_log_std,
                    const std::uint8_t* masks, std::int64_t rows, float* out) const {
  for (std::int64_t r = 0; r < rows; ++r) {
    out[r] = 0.0f;
    for (const Part& part : parts_) {
      out[r] += part.distribution->kl(part.leaf, RowOf(part, r, from, from_log_std, masks),
                                      RowOf(part, r, to, to_log_std, masks));
    }
  }
}

}  // namespace consac
