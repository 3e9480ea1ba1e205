#pragma once
// Memory for one Batch, for whoever drives a world without a learner: servers, evaluation, tests, Record of a part
// of the slots.

#include <cstdint>
#include <vector>

#include "consac/env/batch.h"
#include "consac/env/vector_env.h"

namespace consac {

/// Owns one batch of all slots of a behaviour. Movable; batch() stays valid for its life.
class BatchBuffer {
 public:
  /// Room for slots 0..slots-1 of `behaviour`.
  explicit BatchBuffer(const BehaviourSpec& behaviour);
  BatchBuffer(BatchBuffer&&) = default;
  BatchBuffer& operator=(BatchBuffer&&) = default;
  /// The batch over all rows; its spans point into this object.
  Batch& batch() { return batch_; }
  /// Makes next_observations (and masks) the observations of the coming step: swaps the two buffers.
  void Advance();

 private:
  std::vector<std::int32_t> slots_;
  std::vector<std::byte> bytes_;  // one 64-byte aligned arena for everything below
  Batch batch_;
};

}  // namespace consac
