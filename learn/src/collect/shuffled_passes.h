#pragma once
// Passes over the rows of a rollout, shuffled each time and cut into minibatches: the epochs of PPO, and of whoever
// else goes over the same rows more than once. Private to learn.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/rng.h"

namespace consac::learn {

/// May be saved between two minibatches.
class ShuffledPasses {
 public:
  /// For at most `max_rows` rows, shuffled from `seed`.
  ShuffledPasses(std::int64_t max_rows, std::uint64_t seed)
      : rng_(seed, StreamId("minibatch_shuffle")), order_(static_cast<std::size_t>(max_rows)) {}

  /// An update over `rows` begins.
  void Begin(std::span<const std::int32_t> rows) {
    std::copy(rows.begin(), rows.end(), order_.begin());
    count_ = static_cast<std::int64_t>(rows.size());
    pass_ = next_ = 0;
  }
  /// The next call of Next begins a pass.
  bool at_begin() const { return next_ == 0; }
  /// The next `size` rows of the pass, or what is left of it; valid until the pass ends.
  std::span<const std::int32_t> Next(std::int64_t size) {
    if (next_ == 0) {
      rng_.Shuffle(std::span(order_).first(static_cast<std::size_t>(count_)));
      ++passes_;
    }
    const std::int64_t first = next_, taken = std::min(size, count_ - first);
    next_ += taken;
    if (next_ >= count_) {
      next_ = 0;
      ++pass_;
    }
    return std::span(order_).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(taken));
  }
  /// Passes of this update that are finished.
  std::int64_t finished() const { return pass_; }
  /// Passes begun in all updates.
  std::int64_t begun() const { return passes_; }
  /// All rows of the update, in the order of the present pass.
  std::span<const std::int32_t> rows() const { return std::span(order_).first(static_cast<std::size_t>(count_)); }

  /// Order, place and generator.
  void Visit(Archive& archive) {
    const auto most = static_cast<std::int64_t>(order_.size());
    archive("shuffle_rng", rng_);
    archive("epoch", pass_);
    archive("minibatch_begin", next_);
    archive("rows", count_);
    archive("order", std::span<std::int32_t>(order_));
    archive.CheckWithin("rows", count_, 0, most);
    archive.CheckWithin("minibatch_begin", next_, 0, count_);
    archive.Check("order",
                  std::all_of(order_.begin(), order_.end(), [&](std::int32_t row) { return row >= 0 && row < most; }));
    archive("epochs", passes_);
  }

 private:
  Rng rng_;
  std::vector<std::int32_t> order_;  // [T * N] slab rows
  std::int64_t count_ = 0, pass_ = 0, next_ = 0, passes_ = 0;
};

}  // namespace consac::learn
