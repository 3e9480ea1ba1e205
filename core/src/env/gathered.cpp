#include "consac/env/gathered.h"

#include <algorithm>
#include <cstring>

namespace consac {
namespace {

template <class T>
void GatherRow(const T* from, std::size_t slot, T* to, std::size_t row, std::size_t bytes) {
  if (from != nullptr) std::memcpy(to + row * bytes, from + slot * bytes, bytes);
}

}  // namespace

GatheredRows::GatheredRows(const BehaviourSpec& behaviour)
    : slots_(static_cast<std::size_t>(behaviour.slots)),
      observation_bytes_(behaviour.observation_layout.row_bytes),
      action_bytes_(behaviour.action_layout.row_bytes),
      mask_bytes_(behaviour.masks_actions ? static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : 0),
      own_(behaviour) {
  chosen_.reserve(slots_);
}

void GatheredRows::ChoosePresent(std::span<const std::uint8_t> present) {
  if (present.empty() && everyone()) return;
  chosen_.clear();
  for (std::size_t slot = 0; slot < slots_; ++slot) {
    if (present.empty() || present[slot] != 0) chosen_.push_back(static_cast<std::int32_t>(slot));
  }
}

void GatheredRows::ChooseArrivals(std::span<const std::uint8_t> present, const GatheredRows& others) {
  chosen_.clear();
  auto other = others.chosen_.begin();
  for (std::size_t slot = 0; slot < slots_; ++slot) {
    const bool among = other != others.chosen_.end() && *other == static_cast<std::int32_t>(slot);
    if (among) ++other;
    if (!among && (present.empty() || present[slot] != 0)) chosen_.push_back(static_cast<std::int32_t>(slot));
  }
}

/// The chosen rows' memory: the whole batch's own where every row is chosen.
Batch& GatheredRows::Part(const Batch& whole) {
  batch_ = everyone() ? whole : own_.batch();
  batch_.slots = chosen_;
  return batch_;
}

Batch& GatheredRows::TakeObservations(const Batch& whole) {
  Batch& part = Part(whole);
  for (std::size_t i = 0; i < chosen_.size() && !everyone(); ++i) {
    const auto slot = static_cast<std::size_t>(chosen_[i]);
    GatherRow(whole.observations, slot, part.observations, i, observation_bytes_);
    GatherRow(whole.action_masks, slot, part.action_masks, i, mask_bytes_);
  }
  return part;
}

Batch& GatheredRows::TakeFirst(const Batch& whole) {
  Batch& part = Part(whole);
  for (std::size_t i = 0; i < chosen_.size() && !everyone(); ++i) {
    const auto slot = static_cast<std::size_t>(chosen_[i]);
    GatherRow(whole.next_observations, slot, part.next_observations, i, observation_bytes_);
    GatherRow(whole.next_action_masks, slot, part.next_action_masks, i, mask_bytes_);
  }
  return part;
}

void GatheredRows::PutActions(Batch& whole) const {
  for (std::size_t i = 0; i < chosen_.size() && !everyone(); ++i) {
    std::memcpy(whole.actions + static_cast<std::size_t>(chosen_[i]) * action_bytes_,
                batch_.actions + i * action_bytes_, action_bytes_);
  }
}

Batch& GatheredRows::TakeOutcome(const Batch& whole) {
  for (std::size_t i = 0; i < chosen_.size() && !everyone(); ++i) {
    const auto slot = static_cast<std::size_t>(chosen_[i]);
    batch_.rewards[i] = whole.rewards[slot];
    batch_.terminated[i] = whole.terminated[slot];
    batch_.truncated[i] = whole.truncated[slot];
    GatherRow(whole.next_observations, slot, batch_.next_observations, i, observation_bytes_);
    GatherRow(whole.next_action_masks, slot, batch_.next_action_masks, i, mask_bytes_);
    if ((batch_.terminated[i] | batch_.truncated[i]) != 0)
      GatherRow(whole.final_observations, slot, batch_.final_observations, i, observation_bytes_);
  }
  return batch_;
}

}  // namespace consac
