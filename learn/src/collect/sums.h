#pragma once
// A few sums with names: what a loss adds up over the rows of a block, and what becomes of them over minibatches,
// passes and an update: the numbers that an algorithm reports. Private to learn.

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/communicator.h"
#include "consac/learn/grad/backpropagation.h"

namespace consac::learn {

/// One float64 for each of `names`, an array of texts; an enum in their order tells them apart.
template <const auto& names>
struct Sums {
  double of[std::size(names)] = {};  // [names]

  /// The sum of that place.
  double& operator[](std::size_t place) { return of[place]; }
  /// The same, to read.
  double operator[](std::size_t place) const { return of[place]; }
  /// Adds `weight` times the other's.
  void Add(const Sums& other, double weight) {
    for (std::size_t i = 0; i < std::size(names); ++i) of[i] += weight * other.of[i];
  }
  /// The first `count` of them, each under its name.
  void Visit(Archive& archive, std::size_t count = std::size(names)) {
    for (std::size_t i = 0; i < count; ++i) archive(names[i], of[i]);
  }
};

/// Sums of an update under way. May be saved between two minibatches.
template <const auto& names>
class LossLog {
 public:
  /// For minibatches of at most `max_rows` rows on each of `ranks`; only the first `kept` terms are in use.
  explicit LossLog(std::int64_t max_rows, const Communicator& ranks = {}, std::size_t kept = std::size(names))
      : ranks_(ranks), kept_(kept), blocks_(static_cast<std::size_t>((max_rows + kBlockRows - 1) / kBlockRows)) {}

  /// An update begins.
  void BeginUpdate() {
    update_ = {};
    minibatches_ = 0;
  }
  /// A pass over its rows begins.
  void BeginPass() {
    pass_ = {};
    pass_minibatches_ = 0;
  }
  /// A minibatch begins that several losses add to.
  void BeginMinibatch() { std::fill(blocks_.begin(), blocks_.end(), Sums<names>()); }
  /// Where block `index` of the minibatch puts its sums over rows; each thread has its own.
  Sums<names>& block(std::int64_t index) { return blocks_[static_cast<std::size_t>(index)]; }
  /// A minibatch of `rows` rows here and `total` on all ranks is through: takes in the means of its blocks, in their
  /// order and in the ranks'.
  void AddMinibatch(std::int64_t rows, std::int64_t total) {
    last_ = {};
    for (std::int64_t b = 0; b * kBlockRows < rows; ++b) last_.Add(block(b), 1.0 / static_cast<double>(total));
    ranks_.Sum(std::span<double>(last_.of));
    update_.Add(last_, 1.0);
    pass_.Add(last_, 1.0);
    ++minibatches_;
    ++pass_minibatches_;
  }

  /// Minibatches of the update.
  std::int64_t minibatches() const { return minibatches_; }
  /// Means over the rows of the latest minibatch.
  const Sums<names>& last() const { return last_; }
  /// Their mean over the minibatches of the update.
  Sums<names> UpdateMeans() const {
    Sums<names> means;
    means.Add(update_, 1.0 / static_cast<double>(minibatches_));
    return means;
  }
  /// One of them, as the mean over the minibatches of the present pass.
  double PassMean(std::size_t place) const { return pass_[place] / static_cast<double>(pass_minibatches_); }

  /// Sums and counts.
  void Visit(Archive& archive) {
    archive("gradient_steps", minibatches_);
    archive("epoch_gradient_steps", pass_minibatches_);
    Kept update{update_, kept_}, pass{pass_, kept_};
    archive("update_sums", update);
    archive("epoch_sums", pass);
  }

 private:
  /// What of sums is saved.
  struct Kept {
    Sums<names>& sums;
    std::size_t count;
    void Visit(Archive& archive) { sums.Visit(archive, count); }
  };

  Communicator ranks_;
  std::size_t kept_;
  std::vector<Sums<names>> blocks_;  // [blocks] of the minibatch
  Sums<names> update_, pass_, last_;
  std::int64_t minibatches_ = 0, pass_minibatches_ = 0;
};

}  // namespace consac::learn
