#include "buffer/replay.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "consac/base/memory.h"

namespace consac::learn {
namespace {

// One tail for every 16 transitions: episodes of so many steps fill the ring without a gap.
std::int64_t RingRows(std::int64_t capacity) {
  return capacity + std::max<std::int64_t>(capacity / 16, 1);
}

std::size_t MaskBytes(const BehaviourSpec& behaviour) {
  return behaviour.masks_actions ? static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : 0;
}

std::string MegabytesText(std::int64_t bytes) {
  return std::to_string((bytes + (1 << 20) - 1) >> 20) + " MiB";
}

}  // namespace

std::int64_t Replay::Bytes(const BehaviourSpec& behaviour, std::int64_t raw_size, const ReplayOptions& options) {
  const auto observation = static_cast<std::int64_t>(behaviour.observation_layout.row_bytes);
  const auto mask = static_cast<std::int64_t>(MaskBytes(behaviour));
  constexpr std::int64_t kColumns = sizeof(float) + 2 * sizeof(std::int32_t) + 1;  // reward, slot, next, kind
  constexpr std::int64_t kHeads = 6;  // what slots see now and next, and a batch's
  const std::int64_t ring = RingRows(options.capacity);
  std::int64_t bytes = ring * (observation + mask + raw_size * static_cast<std::int64_t>(sizeof(float)) + kColumns) +
                       behaviour.slots * kHeads * (observation + mask);
  if (options.prioritised) {
    const auto leaves = static_cast<std::int64_t>(std::bit_ceil(static_cast<std::uint64_t>(ring)));
    bytes += 2 * leaves * static_cast<std::int64_t>(sizeof(double) + sizeof(float));
  }
  if (options.episodes) bytes += EpisodeIndex::Bytes(ring);
  return bytes;
}

Status Replay::CheckFits(const BehaviourSpec& behaviour, std::int64_t raw_size, const ReplayOptions& options,
                         std::int64_t max_bytes) {
  const std::int64_t bytes = Bytes(behaviour, raw_size, options);
  const std::string what =
      "a replay of " + std::to_string(options.capacity) + " transitions takes " + MegabytesText(bytes);
  if (bytes > max_bytes) {
    return {StatusCode::kResourceExhausted,
            what + ", more than the " + MegabytesText(max_bytes) + " that are allowed here; lower buffer_size"};
  }
  if (!CheckMemory(static_cast<std::size_t>(bytes), "the replay").ok())
    return {StatusCode::kResourceExhausted, what + ", more than there is; lower buffer_size"};
  return Status::Ok();
}

Replay::Replay(const BehaviourSpec& behaviour, std::int64_t raw_size, const ReplayOptions& options)
    : options_(options),
      ring_(RingRows(options.capacity)),
      observation_bytes_(behaviour.observation_layout.row_bytes),
      mask_bytes_(MaskBytes(behaviour)),
      raw_size_(static_cast<std::size_t>(raw_size)),
      observations_(static_cast<std::size_t>(ring_) * observation_bytes_),
      masks_(static_cast<std::size_t>(ring_) * mask_bytes_),
      raw_actions_(static_cast<std::size_t>(ring_) * raw_size_ * sizeof(float)),
      rewards_(static_cast<std::size_t>(ring_)),
      slots_(static_cast<std::size_t>(ring_)),
      next_(static_cast<std::size_t>(ring_)),
      kinds_(static_cast<std::size_t>(ring_)),
      newest_(static_cast<std::size_t>(behaviour.slots), -1),
      heads_(static_cast<std::size_t>(behaviour.slots) * observation_bytes_),
      next_heads_(heads_.size()),
      head_masks_(static_cast<std::size_t>(behaviour.slots) * mask_bytes_, 1),
      next_head_masks_(head_masks_.size(), 1),
      scratch_(behaviour) {
  staged_.reserve(newest_.size());
  if (options.prioritised) priorities_.emplace(ring_, options.priority);
  if (!options.episodes) return;
  oldest_.assign(newest_.size(), -1);
  episodes_.emplace(ring_);
}

Batch Replay::Stage(std::span<const std::int32_t> slots) {
  staged_.assign(slots.begin(), slots.end());
  Batch batch = scratch_.batch();
  batch.slots = staged_;
  if (slots.size() == newest_.size()) {  // ascending and unique, so when they are all, slot i is row i
    batch.observations = heads_.data();
    batch.next_observations = next_heads_.data();
    if (mask_bytes_ > 0) {
      batch.action_masks = head_masks_.data();
      batch.next_action_masks = next_head_masks_.data();
    }
    return batch;
  }
  for (std::size_t i = 0; i < slots.size(); ++i) {
    std::memcpy(batch.observations + i * observation_bytes_, Head(slots[i]), observation_bytes_);
    if (mask_bytes_ > 0) std::memcpy(batch.action_masks + i * mask_bytes_, HeadMask(slots[i]), mask_bytes_);
  }
  return batch;
}

void Replay::SetHead(const Batch& batch, std::size_t row) {
  std::memcpy(Head(batch.slots[row]), batch.next_observations + row * observation_bytes_, observation_bytes_);
  if (mask_bytes_ > 0)
    std::memcpy(HeadMask(batch.slots[row]), batch.next_action_masks + row * mask_bytes_, mask_bytes_);
}

void Replay::Begin(const Batch& batch) {
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    const std::int32_t slot = batch.slots[i];
    if (newest_[static_cast<std::size_t>(slot)] >= 0) AppendTail(slot, Head(slot));
    SetHead(batch, i);
  }
}

void Replay::DropOldest() {
  const std::int64_t place = first_ % ring_;
  if (IsTransition(place)) {
    std::int64_t& newest = newest_[static_cast<std::size_t>(slot(place))];
    if (newest == first_) newest = -1;
    if (priorities_) priorities_->Remove(place);
    if (episodes_) {
      episodes_->Remove(place);
      std::int64_t& oldest = oldest_[static_cast<std::size_t>(slot(place))];
      if (oldest == place) oldest = newest < 0 ? -1 : next_[static_cast<std::size_t>(place)];
    }
    --size_;
  }
  ++first_;
}

// Makes room for a row and links the slot's latest one to it. What a tail says of an episode that was cut later, by
// Begin, is said by the tail alone where rows were saved before: so a saved row never changes.
std::int64_t Replay::Append(std::int32_t slot, Kind kind) {
  while (end_ - first_ == ring_ || (kind != Kind::kTail && size_ == options_.capacity)) DropOldest();
  const std::int64_t place = end_ % ring_;
  const auto at = static_cast<std::size_t>(place);
  std::int64_t& newest = newest_[static_cast<std::size_t>(slot)];
  if (newest >= 0) {
    const auto before = static_cast<std::size_t>(newest % ring_);
    next_[before] = static_cast<std::int32_t>(place);
    if (kind == Kind::kTail && kinds_[before] == static_cast<std::uint8_t>(Kind::kGoesOn))
      kinds_[before] = static_cast<std::uint8_t>(Kind::kTruncated);
  }
  slots_[at] = slot;
  kinds_[at] = static_cast<std::uint8_t>(kind);
  next_[at] = kHead;
  if (episodes_ && kind == Kind::kTail) FinishEpisode(slot);
  if (episodes_ && kind != Kind::kTail && newest < 0) oldest_[static_cast<std::size_t>(slot)] = place;
  newest = kind == Kind::kTail ? -1 : end_;
  if (kind != Kind::kTail) {
    ++size_;
    if (priorities_) priorities_->Add(place);
  }
  ++end_;
  return place;
}

// What is held of the slot's episode, to the tail that was appended.
void Replay::FinishEpisode(std::int32_t slot) {
  std::int64_t& oldest = oldest_[static_cast<std::size_t>(slot)];
  for (std::int64_t place = oldest; place >= 0 && IsTransition(place); place = next_[static_cast<std::size_t>(place)])
    episodes_->Add(place);
  episodes_->Close();
  oldest = -1;
}

void Replay::AppendTail(std::int32_t slot, const std::byte* observation) {
  const std::int64_t place = Append(slot, Kind::kTail);
  std::memcpy(At(observations_, place, observation_bytes_), observation, observation_bytes_);
  if (mask_bytes_ > 0) std::memset(At(masks_, place, mask_bytes_), 1, mask_bytes_);
  std::memset(At(raw_actions_, place, raw_size_ * sizeof(float)), 0, raw_size_ * sizeof(float));
  rewards_[static_cast<std::size_t>(place)] = 0.0f;
}

void Replay::Commit(const Batch& batch, const float* raw_actions) {
  const bool in_place = batch.next_observations == next_heads_.data();
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    const std::int32_t slot = batch.slots[i];
    const Kind kind = batch.terminated[i] != 0  ? Kind::kTerminated
                      : batch.truncated[i] != 0 ? Kind::kTruncated
                                                : Kind::kGoesOn;
    const std::int64_t place = Append(slot, kind);
    std::memcpy(At(observations_, place, observation_bytes_), Head(slot), observation_bytes_);
    if (mask_bytes_ > 0) std::memcpy(At(masks_, place, mask_bytes_), HeadMask(slot), mask_bytes_);
    std::memcpy(At(raw_actions_, place, raw_size_ * sizeof(float)), raw_actions + i * raw_size_,
                raw_size_ * sizeof(float));
    rewards_[static_cast<std::size_t>(place)] = batch.rewards[i];
    if (kind != Kind::kGoesOn) AppendTail(slot, batch.final_observations + i * observation_bytes_);
    if (!in_place) SetHead(batch, i);
  }
  if (!in_place) return;
  std::swap(heads_, next_heads_);
  std::swap(head_masks_, next_head_masks_);
}

std::int64_t Replay::Sample(Rng& rng) const {
  CONSAC_ASSERT(size_ > 0);
  if (priorities_) return priorities_->Sample(rng);
  const auto rows = static_cast<std::uint32_t>(end_ - first_);
  while (true) {
    const std::int64_t place = (first_ + static_cast<std::int64_t>(rng.Below(rows))) % ring_;
    if (IsTransition(place)) return place;
  }
}

std::int64_t Replay::Next(std::int64_t place) const {
  return kind(place) == Kind::kGoesOn ? next_[static_cast<std::size_t>(place)] : kHead;
}

const std::byte* Replay::next_observation(std::int64_t place) const {
  const std::int32_t next = next_[static_cast<std::size_t>(place)];
  if (next != kHead) return observation(next);
  return heads_.data() + static_cast<std::size_t>(slot(place)) * observation_bytes_;
}

std::size_t Replay::row_bytes() const {
  return observation_bytes_ + mask_bytes_ + raw_size_ * sizeof(float) + sizeof(float) + sizeof(std::int32_t) + 1;
}

void Replay::CopyRows(std::int64_t from, std::int64_t count, std::byte* to) const {
  const auto put = [&to](const void* what, std::size_t bytes) {
    if (bytes > 0) std::memcpy(to, what, bytes);
    to += bytes;
  };
  for (std::int64_t row = from; row < from + count; ++row) {
    const std::int64_t place = row % ring_;
    const auto at = static_cast<std::size_t>(place);
    put(observation(place), observation_bytes_);
    put(At(masks_, place, mask_bytes_), mask_bytes_);
    put(raw_action(place), raw_size_ * sizeof(float));
    put(&rewards_[at], sizeof(float));
    put(&slots_[at], sizeof(std::int32_t));
    put(&kinds_[at], 1);
  }
}

bool Replay::BeginRows(std::int64_t first, std::int64_t end) {
  if (end - first > ring_) return false;
  if (priorities_) priorities_.emplace(ring_, options_.priority);
  std::fill(newest_.begin(), newest_.end(), -1);
  std::fill(oldest_.begin(), oldest_.end(), -1);
  if (episodes_) episodes_->Clear();
  first_ = end_ = first;
  size_ = 0;
  return true;
}

bool Replay::TakeRows(std::int64_t count, const std::byte* rows) {
  const auto take = [&rows](void* to, std::size_t bytes) {
    if (bytes > 0) std::memcpy(to, rows, bytes);
    rows += bytes;
  };
  for (; count > 0; --count) {
    if (end_ - first_ == ring_) return false;
    const std::int64_t place = end_ % ring_;
    take(At(observations_, place, observation_bytes_), observation_bytes_);
    take(At(masks_, place, mask_bytes_), mask_bytes_);
    take(At(raw_actions_, place, raw_size_ * sizeof(float)), raw_size_ * sizeof(float));
    take(&rewards_[static_cast<std::size_t>(place)], sizeof(float));
    std::int32_t slot = 0;
    std::uint8_t kind = 0;
    take(&slot, sizeof(slot));
    take(&kind, 1);
    if (slot < 0 || slot >= static_cast<std::int32_t>(newest_.size()) || kind > static_cast<std::uint8_t>(Kind::kTail))
      return false;
    const bool full = static_cast<Kind>(kind) != Kind::kTail && size_ == options_.capacity;
    if (full) return false;
    (void)Append(slot, static_cast<Kind>(kind));
  }
  return true;
}

void Replay::Visit(Archive& archive) {
  archive("heads", std::span<std::uint8_t>(reinterpret_cast<std::uint8_t*>(heads_.data()), heads_.size()));
  archive("head_masks", std::span<std::uint8_t>(head_masks_));
  archive("rows", static_cast<StateRows&>(*this));
  if (priorities_) archive("priorities", *priorities_);
}

}  // namespace consac::learn
