#pragma once
// Which transitions of a replay's ring belong to one finished episode, in their order, so that hindsight finds any of
// them at once. It follows from the rows alone: a replay that is read back has the same. Private to learn.

#include <algorithm>
#include <cstdint>
#include <vector>

namespace consac::learn {

/// Finished episodes of the transitions at `places` places of a ring. Never allocates after creation.
class EpisodeIndex {
 public:
  explicit EpisodeIndex(std::int64_t places)
      : rows_(static_cast<std::size_t>(2 * places)),
        entries_(static_cast<std::size_t>(places), -1),
        left_(entries_.size()),
        before_(entries_.size()) {}
  /// Bytes that it takes.
  static std::int64_t Bytes(std::int64_t places) {
    return places * static_cast<std::int64_t>(4 * sizeof(std::int32_t) + sizeof(std::int64_t));
  }

  /// The next transition of the episode that Close ends.
  void Add(std::int64_t place) {
    rows_[Row(end_)] = static_cast<std::int32_t>(place);
    entries_[At(place)] = end_++;
  }
  /// Those that were added since the last time are an episode.
  void Close() {
    for (std::int64_t entry = begin_; entry < end_; ++entry) {
      const std::size_t at = At(rows_[Row(entry)]);
      left_[at] = static_cast<std::int32_t>(end_ - entry);
      before_[at] = static_cast<std::int32_t>(entry - begin_);
    }
    begin_ = end_;
  }
  /// Nothing is there any more. Of an episode the oldest go first.
  void Remove(std::int64_t place) { entries_[At(place)] = -1; }
  /// Nothing is anywhere.
  void Clear() {
    std::fill(entries_.begin(), entries_.end(), -1);
    begin_ = end_ = 0;
  }

  /// Whether a finished episode's transition is at `place`; the rest is of such places.
  bool Finished(std::int64_t place) const { return entries_[At(place)] >= 0; }
  /// Transitions of its episode from it on, itself included.
  std::int64_t Left(std::int64_t place) const { return left_[At(place)]; }
  /// Transitions of its episode before it that are still there.
  std::int64_t Before(std::int64_t place) const {
    const std::int64_t entry = entries_[At(place)];
    std::int64_t low = 0, high = before_[At(place)];  // so many are there at least, at most
    while (low < high) {
      const std::int64_t middle = low + (high - low + 1) / 2;
      if (Held(entry - middle)) {
        low = middle;
      } else {
        high = middle - 1;
      }
    }
    return low;
  }
  /// The place of the transition `steps` after it in its episode, from -Before to Left - 1.
  std::int64_t Along(std::int64_t place, std::int64_t steps) const { return rows_[Row(entries_[At(place)] + steps)]; }

 private:
  static std::size_t At(std::int64_t place) { return static_cast<std::size_t>(place); }
  std::size_t Row(std::int64_t entry) const { return static_cast<std::size_t>(entry) % rows_.size(); }
  bool Held(std::int64_t entry) const {
    return end_ - entry <= static_cast<std::int64_t>(rows_.size()) && entries_[At(rows_[Row(entry)])] == entry;
  }

  // Episodes end in another order than they began, so that what is held is not all in one piece. But when one of them
  // ended all after it were held or yet to come, so that twice the ring is enough.
  std::vector<std::int32_t> rows_;           // [2 places] of an entry: its place
  std::vector<std::int64_t> entries_;        // [places] which entry it is, or -1
  std::vector<std::int32_t> left_, before_;  // [places] of its episode, when it ended
  std::int64_t begin_ = 0, end_ = 0;         // entries of the episode that is added
};

}  // namespace consac::learn
