#pragma once
// What an off-policy algorithm remembers: one ring of rows in the order in which they came, whatever the slot, each row
// linked to the next of its slot. So slots share one budget, agents that are away take no room, and an observation is
// stored once: it is what one transition leads to and the next one starts from. An episode's last observation is a row
// of its own, a tail. What each slot sees now is kept beside the ring until it is acted upon.
// Rows are in the world's own form: bytes of an image stay bytes. Private to learn.

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "buffer/episode_index.h"
#include "buffer/priorities.h"
#include "consac/base/archive.h"
#include "consac/base/rng.h"
#include "consac/env/buffer.h"
#include "consac/env/vector_env.h"

namespace consac::learn {

/// How much is remembered, and how it is drawn.
struct ReplayOptions {
  std::int64_t capacity = 1000000;  ///< transitions of all slots together
  bool prioritised = false;         ///< Sample by priority
  PriorityOptions priority;         ///< of those
  bool episodes = false;            ///< know which transitions are of one finished episode
};

/// Zeroed memory that the system hands out as it is first written: a large ring costs what is in it.
class LazyBytes {
 public:
  /// `bytes` zeros.
  explicit LazyBytes(std::size_t bytes) : memory_(static_cast<std::byte*>(std::calloc(bytes > 0 ? bytes : 1, 1))) {
    CONSAC_ASSERT(memory_ != nullptr);
  }
  /// The first.
  std::byte* data() const { return memory_.get(); }

 private:
  struct Free {
    void operator()(std::byte* memory) const { std::free(memory); }
  };
  std::unique_ptr<std::byte, Free> memory_;
};

/// The steps from a transition on, as one: r_0 + gamma r_1 + ..., what they lead to, and how that counts.
struct Lookahead {
  double reward = 0.0;                          ///< discounted sum
  double discount = 0.0;                        ///< gamma^steps, or 0 where the episode ended in a terminal state
  const std::byte* next_observation = nullptr;  ///< after the last of them, [row_bytes]
  const std::uint8_t* next_mask = nullptr;      ///< legal there, [mask_bytes], or null: everything
};

/// The memory. A transition is named by its place in the ring, which is its own until it is forgotten. `Stage`,
/// `Begin` and `Commit` are as Rollout's. Never allocates after creation.
class Replay final : public StateRows {
 public:
  /// For `behaviour`, `raw_size` numbers of raw action each. CheckFits must have been ok.
  Replay(const BehaviourSpec& behaviour, std::int64_t raw_size, const ReplayOptions& options);

  /// Bytes that it takes once full.
  static std::int64_t Bytes(const BehaviourSpec& behaviour, std::int64_t raw_size, const ReplayOptions& options);
  /// Ok when it is no larger than `max_bytes` and there is so much memory; else the error says what would fit.
  static Status CheckFits(const BehaviourSpec& behaviour, std::int64_t raw_size, const ReplayOptions& options,
                          std::int64_t max_bytes);

  /// The batch that the next transition of `slots` is written to, with what they see now.
  Batch Stage(std::span<const std::int32_t> slots);
  /// First observations of slots. An episode under way is cut there: what was seen last is its last observation.
  void Begin(const Batch& batch);
  /// Takes a transition of every slot of `batch`; raw_actions [B, raw_size] are what the learner chose.
  void Commit(const Batch& batch, const float* raw_actions);

  /// Transitions held.
  std::int64_t size() const { return size_; }
  /// Most that it can hold. Episodes shorter than 16 steps make it fewer: their tails share the ring.
  std::int64_t capacity() const { return options_.capacity; }
  /// One of the transitions, each as probable as its priority says or as any other; there must be one.
  std::int64_t Sample(Rng& rng) const;
  /// The priorities; null without them.
  Priorities* priorities() { return priorities_ ? &*priorities_ : nullptr; }
  /// The episodes that have ended; null without them.
  const EpisodeIndex* episodes() const { return episodes_ ? &*episodes_ : nullptr; }

  /// Where the transition starts, [row_bytes].
  const std::byte* observation(std::int64_t place) const { return At(observations_, place, observation_bytes_); }
  /// What was legal there, [mask_bytes], or null: everything.
  const std::uint8_t* mask(std::int64_t place) const {
    return mask_bytes_ == 0 ? nullptr : reinterpret_cast<const std::uint8_t*>(At(masks_, place, mask_bytes_));
  }
  /// What was done, [raw_size].
  const float* raw_action(std::int64_t place) const {
    return reinterpret_cast<const float*>(At(raw_actions_, place, raw_size_ * sizeof(float)));
  }
  /// What it brought, as the world gave it.
  float reward(std::int64_t place) const { return rewards_[static_cast<std::size_t>(place)]; }
  /// Whose it is.
  std::int32_t slot(std::int64_t place) const { return slots_[static_cast<std::size_t>(place)]; }
  /// The next transition of the same episode, or -1: it ended here, or goes on from what its slot sees now.
  std::int64_t Next(std::int64_t place) const;
  /// What the transition led to, [row_bytes]: an episode's last observation where one ended.
  const std::byte* next_observation(std::int64_t place) const;
  /// Whether the episode ended in a terminal state; else its value goes on, though it may have been cut.
  bool terminated(std::int64_t place) const { return kind(place) == Kind::kTerminated; }
  /// Up to `n` steps from `place`, fewer where the episode ends or is not known further. reward(r) is the reward as it
  /// is learned from.
  template <class Reward>
  Lookahead Look(std::int64_t place, std::int64_t n, double gamma, Reward&& reward) const;

  /// All of it, rows by StateRows.
  void Visit(Archive& archive);
  std::size_t row_bytes() const override;
  std::int64_t first_row() const override { return first_; }
  std::int64_t end_row() const override { return end_; }
  void CopyRows(std::int64_t from, std::int64_t count, std::byte* to) const override;
  bool BeginRows(std::int64_t first, std::int64_t end) override;
  bool TakeRows(std::int64_t count, const std::byte* rows) override;

 private:
  /// What a row is. A tail holds an observation alone.
  enum class Kind : std::uint8_t { kGoesOn, kTerminated, kTruncated, kTail };
  static constexpr std::int32_t kHead = -1;  // next_: what the slot sees now

  static std::byte* At(const LazyBytes& column, std::int64_t place, std::size_t bytes) {
    return column.data() + static_cast<std::size_t>(place) * bytes;
  }
  Kind kind(std::int64_t place) const { return static_cast<Kind>(kinds_[static_cast<std::size_t>(place)]); }
  bool IsTransition(std::int64_t place) const { return kind(place) != Kind::kTail; }
  std::byte* Head(std::int32_t slot) { return heads_.data() + static_cast<std::size_t>(slot) * observation_bytes_; }
  std::uint8_t* HeadMask(std::int32_t slot) {
    return head_masks_.data() + static_cast<std::size_t>(slot) * mask_bytes_;
  }
  std::int64_t Append(std::int32_t slot, Kind kind);
  void AppendTail(std::int32_t slot, const std::byte* observation);
  void FinishEpisode(std::int32_t slot);
  void DropOldest();
  void SetHead(const Batch& batch, std::size_t row);

  const ReplayOptions options_;
  const std::int64_t ring_;  // rows: transitions and tails
  const std::size_t observation_bytes_, mask_bytes_, raw_size_;
  std::int64_t first_ = 0, end_ = 0, size_ = 0;
  LazyBytes observations_, masks_, raw_actions_;  // [ring, row_bytes], [ring, mask_bytes], [ring, raw_size]
  std::vector<float> rewards_;                    // [ring]
  std::vector<std::int32_t> slots_, next_;        // [ring] next: a place, or kHead
  std::vector<std::uint8_t> kinds_;               // [ring]
  std::vector<std::int64_t> newest_;              // [N] the row that goes on from what the slot sees now, or -1
  std::vector<std::byte> heads_, next_heads_;     // [N, row_bytes] what each sees now; what is being written
  std::vector<std::uint8_t> head_masks_, next_head_masks_;  // [N, mask_bytes]
  BatchBuffer scratch_;                                     // everything else of a staged batch
  std::vector<std::int32_t> staged_;                        // its slots
  std::optional<Priorities> priorities_;
  std::vector<std::int64_t> oldest_;  // [N] the oldest row of each slot's episode that goes on, or -1; for the index
  std::optional<EpisodeIndex> episodes_;
};

template <class Reward>
Lookahead Replay::Look(std::int64_t place, std::int64_t n, double gamma, Reward&& reward) const {
  Lookahead ahead;
  ahead.discount = 1.0;
  for (std::int64_t left = n;; --left) {
    ahead.reward += ahead.discount * static_cast<double>(reward(rewards_[static_cast<std::size_t>(place)]));
    ahead.discount *= gamma;
    const std::int64_t next = Next(place);
    if (left <= 1 || next < 0) break;
    place = next;
  }
  ahead.next_observation = next_observation(place);
  if (terminated(place)) ahead.discount = 0.0;
  if (mask_bytes_ > 0 && kind(place) == Kind::kGoesOn) {
    const std::int32_t next = next_[static_cast<std::size_t>(place)];
    ahead.next_mask =
        next == kHead ? head_masks_.data() + static_cast<std::size_t>(slot(place)) * mask_bytes_ : mask(next);
  }
  return ahead;
}

}  // namespace consac::learn
