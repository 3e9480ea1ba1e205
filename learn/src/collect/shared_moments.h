#pragma once
// Running moments of one training on several ranks: between two meetings each rank goes on by itself from what all had
// together. With one rank they are plain running moments, to the bit. Private to learn.

#include <algorithm>
#include <vector>

#include "consac/base/communicator.h"
#include "consac/policy/normaliser.h"

namespace consac::learn {

/// Never allocates after creation.
class SharedMoments {
 public:
  /// Of `size` numbers, on each of `ranks`.
  SharedMoments(std::int64_t size, const Communicator& ranks) : ranks_(ranks), now_(size) {
    if (!many()) return;
    common_ = now_;
    own_ = RunningMoments(size);
    own_.count = 0.0;
    everybodys_.resize(static_cast<std::size_t>(ranks.size * (1 + 2 * size)));
  }

  /// As RunningMoments::Update, on this rank.
  void Update(const float* samples, std::int64_t rows) {
    now_.Update(samples, rows);
    if (many()) own_.Update(samples, rows);
  }
  /// Begins with `moments`, on every rank the same.
  void StartFrom(const RunningMoments& moments) {
    now_ = moments;
    if (many()) common_ = moments;
  }
  /// Takes in what every rank saw since the last time, in their order; all call it at once.
  void Share();
  /// All that this rank knows of.
  const RunningMoments& now() const { return now_; }

  /// The moments; on several ranks also what is still to be shared.
  void Visit(Archive& archive) {
    now_.Visit(archive);
    if (!many()) return;
    archive("common", common_);
    archive("own", own_);
  }

 private:
  bool many() const { return ranks_.size > 1; }

  Communicator ranks_;
  RunningMoments now_;
  RunningMoments common_;           // of all ranks, at the last Share
  RunningMoments own_;              // of this rank, since then
  std::vector<double> everybodys_;  // [ranks, count and mean [D] and variance [D]]
};

inline void SharedMoments::Share() {
  if (!many()) return;
  const std::size_t size = own_.mean.size(), stride = 1 + 2 * size;
  // Each rank fills its own place, zeros elsewhere: the sum is everybody's.
  std::fill(everybodys_.begin(), everybodys_.end(), 0.0);
  double* place = everybodys_.data() + static_cast<std::size_t>(ranks_.rank) * stride;
  *place = own_.count;
  std::copy(own_.mean.begin(), own_.mean.end(), place + 1);
  std::copy(own_.variance.begin(), own_.variance.end(), place + 1 + size);
  ranks_.Sum(std::span(everybodys_));
  for (std::size_t rank = 0; rank < static_cast<std::size_t>(ranks_.size); ++rank) {
    const double* from = everybodys_.data() + rank * stride;
    own_.count = *from;
    std::copy_n(from + 1, size, own_.mean.begin());
    std::copy_n(from + 1 + size, size, own_.variance.begin());
    common_.Merge(own_);
  }
  now_ = common_;
  own_.count = 0.0;
}

}  // namespace consac::learn
