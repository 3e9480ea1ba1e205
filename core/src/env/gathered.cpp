#include "consac/env/gathered.h"

#include <cstring>

namespace consac {
namespace {

/// Row slots[i] of `from` becomes row i of `to`.
template <class T>
void GatherRows(const T* from, std::span<const std::int32_t> slots, std::size_t bytes, T* to) {
  if (from == to || from == nullptr || bytes == 0) return;
  for (std::size_t i = 0; i < slots.size(); ++i)
    std::memcpy(to + i * bytes, from + static_cast<std::size_t>(slots[i]) * bytes, bytes);
}

/// Row i of `from` becomes row slots[i] of `to`.
void ScatterRows(const std::byte* from, std::span<const std::int32_t> slots, std::size_t bytes, std::byte* to) {
  if (from == to) return;
  for (std::size_t i = 0; i < slots.size(); ++i)
    std::memcpy(to + static_cast<std::size_t>(slots[i]) * bytes, from + i * bytes, bytes);
}

}  // namespace

GatheredRows::GatheredRows(const BehaviourSpec& behaviour)
    : count_(static_cast<std::size_t>(behaviour.slots)),
      observation_bytes_(behaviour.observation_layout.row_bytes),
      action_bytes_(behaviour.action_layout.row_bytes),
      mask_bytes_(behaviour.masks_actions ? static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : 0),
      own_(behaviour) {
  chosen_.reserve(count_);
}

void GatheredRows::ChoosePresent(std::span<const std::uint8_t> present) {
  if (present.empty() && everyone()) return;
  // Without a branch for each: it is done in every step.
  chosen_.resize(count_);
  std::size_t chosen = 0;
  for (std::size_t slot = 0; slot < count_; ++slot) {
    chosen_[chosen] = static_cast<std::int32_t>(slot);
    chosen += present.empty() || present[slot] != 0 ? 1 : 0;
  }
  chosen_.resize(chosen);
}

void GatheredRows::ChooseArrivals(std::span<const std::uint8_t> present, const GatheredRows& others) {
  chosen_.clear();
  if (others.everyone()) return;
  auto other = others.chosen_.begin();
  for (std::size_t slot = 0; slot < count_; ++slot) {
    const bool among = other != others.chosen_.end() && *other == static_cast<std::int32_t>(slot);
    if (among) ++other;
    if (!among && (present.empty() || present[slot] != 0)) chosen_.push_back(static_cast<std::int32_t>(slot));
  }
}

Batch GatheredRows::PartOf(const Batch& whole) {
  Batch part = everyone() ? whole : own_.batch();
  part.slots = chosen_;
  return part;
}

void GatheredRows::TakeObservations(const Batch& whole, Batch& part) const {
  GatherRows(whole.observations, chosen_, observation_bytes_, part.observations);
  GatherRows(whole.action_masks, chosen_, mask_bytes_, part.action_masks);
}

void GatheredRows::TakeNext(const Batch& whole, Batch& part) const {
  GatherRows(whole.next_observations, chosen_, observation_bytes_, part.next_observations);
  GatherRows(whole.next_action_masks, chosen_, mask_bytes_, part.next_action_masks);
}

void GatheredRows::PutNext(const Batch& part, Batch& whole) const {
  ScatterRows(part.next_observations, chosen_, observation_bytes_, whole.next_observations);
}

void GatheredRows::PutActions(const Batch& part, Batch& whole) const {
  ScatterRows(part.actions, chosen_, action_bytes_, whole.actions);
}

void GatheredRows::TakeOutcome(const Batch& whole, Batch& part) const {
  TakeNext(whole, part);
  if (part.rewards == whole.rewards) return;
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    const auto slot = static_cast<std::size_t>(chosen_[i]);
    part.rewards[i] = whole.rewards[slot];
    part.terminated[i] = whole.terminated[slot];
    part.truncated[i] = whole.truncated[slot];
    if ((part.terminated[i] | part.truncated[i]) == 0) continue;
    std::memcpy(part.final_observations + i * observation_bytes_, whole.final_observations + slot * observation_bytes_,
                observation_bytes_);
  }
}

}  // namespace consac
