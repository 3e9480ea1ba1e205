#include "consac/policy/head.h"

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
    result.size_ += part.head_size;
    result.log_std_size_ += part.distribution->has_log_std ? leaf.count : 0;
    result.raw_size_ += leaf.count;
    result.parts_.push_back(std::move(part));
  }
  return result;
}

std::vector<HeadSpec> ActionHead::specs() const {
  std::vector<HeadSpec> specs;
  for (const Part& part : parts_) specs.push_back({part.leaf.name, std::string(part.distribution->name)});
  return specs;
}

HeadRow ActionHead::RowOf(const Part& part, std::int64_t row, const float* head, const float* log_std,
                          const std::uint8_t* masks) const {
  return {head + row * size_ + part.head_offset, log_std == nullptr ? nullptr : log_std + part.log_std_offset,
          masks == nullptr ? nullptr : masks + row * mask_bytes_ + part.leaf.mask_offset};
}

void ActionHead::Select(const float* head, const float* log_std, const std::uint8_t* masks, std::int64_t rows,
                        ActionMode mode, Rng& rng, float* raw, float* log_probability) const {
  for (std::int64_t r = 0; r < rows; ++r) {
    float log_p = 0.0f;
    for (const Part& part : parts_) {
      const HeadRow row = RowOf(part, r, head, log_std, masks);
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
