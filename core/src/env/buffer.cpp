#include "consac/env/buffer.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

namespace consac {
namespace {

constexpr std::size_t kArenaAlignment = 64;

std::size_t PaddedBytes(std::size_t bytes) {
  return (bytes + kArenaAlignment - 1) / kArenaAlignment * kArenaAlignment;
}

}  // namespace

BatchBuffer::BatchBuffer(const BehaviourSpec& behaviour) : slots_(static_cast<std::size_t>(behaviour.slots)) {
  std::iota(slots_.begin(), slots_.end(), 0);
  const std::size_t rows = slots_.size();
  const std::size_t observations = PaddedBytes(rows * behaviour.observation_layout.row_bytes);
  const std::size_t actions = PaddedBytes(rows * behaviour.action_layout.row_bytes);
  const std::size_t mask_row =
      behaviour.masks_actions ? static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : 0;
  const std::size_t masks = PaddedBytes(rows * mask_row);
  const std::size_t rewards = PaddedBytes(rows * sizeof(float));
  const std::size_t flags = PaddedBytes(rows);
  bytes_.resize(3 * observations + actions + 2 * masks + rewards + 2 * flags + kArenaAlignment);

  auto address = reinterpret_cast<std::uintptr_t>(bytes_.data());
  std::byte* at = bytes_.data() + (PaddedBytes(address) - address);
  const auto take = [&at](std::size_t size) { return std::exchange(at, at + size); };
  batch_.slots = slots_;
  batch_.observations = take(observations);
  batch_.next_observations = take(observations);
  batch_.final_observations = take(observations);
  batch_.actions = take(actions);
  batch_.rewards = reinterpret_cast<float*>(take(rewards));
  batch_.terminated = reinterpret_cast<std::uint8_t*>(take(flags));
  batch_.truncated = reinterpret_cast<std::uint8_t*>(take(flags));
  if (masks > 0) {
    batch_.action_masks = reinterpret_cast<std::uint8_t*>(take(masks));
    batch_.next_action_masks = reinterpret_cast<std::uint8_t*>(take(masks));
    std::fill_n(batch_.action_masks, masks, std::uint8_t{1});
    std::fill_n(batch_.next_action_masks, masks, std::uint8_t{1});
  }
}

void BatchBuffer::Advance() {
  std::swap(batch_.observations, batch_.next_observations);
  std::swap(batch_.action_masks, batch_.next_action_masks);
}

}  // namespace consac
