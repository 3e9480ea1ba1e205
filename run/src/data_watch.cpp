#include "data_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "consac/base/hooks.h"

namespace consac::run {
namespace {

constexpr std::int64_t kStandstill = 1000;      // steps of a slot without any change: a frozen sensor?
constexpr std::int64_t kShortWarning = 1000;    // episodes of one step in a row
constexpr std::int64_t kShortError = 10'000;    // the same
constexpr std::int64_t kLongEpisode = 100'000;  // steps, where the world promises no limit
constexpr float kLargest = std::numeric_limits<float>::max();

// One pass finds NaN, infinity and values outside: open sides are the largest float32, and no comparison with NaN
// holds. Blocks of a fixed length, so that the compiler turns each into vector instructions.
bool AllWithin(const float* values, const float* low, const float* high, std::size_t count) {
  constexpr std::size_t kBlock = 8;
  unsigned outside = 0;
  std::size_t i = 0;
  for (; i + kBlock <= count; i += kBlock) {
    for (std::size_t k = i; k < i + kBlock; ++k)
      outside |= static_cast<unsigned>(!(values[k] >= low[k])) | static_cast<unsigned>(!(values[k] <= high[k]));
  }
  for (; i < count; ++i)
    outside |= static_cast<unsigned>(!(values[i] >= low[i])) | static_cast<unsigned>(!(values[i] <= high[i]));
  return outside == 0;
}

bool AllAtMost(const float* values, float largest, std::size_t count) {
  unsigned outside = 0;
  for (std::size_t i = 0; i < count; ++i) outside |= static_cast<unsigned>(!(std::fabs(values[i]) <= largest));
  return outside == 0;
}

bool SameRow(const std::byte* a, const std::byte* b, std::size_t bytes) {
  std::uint32_t first_a = 0, first_b = 0;  // most rows differ here, which costs no call
  if (bytes < sizeof(first_a)) return std::memcmp(a, b, bytes) == 0;
  std::memcpy(&first_a, a, sizeof(first_a));
  std::memcpy(&first_b, b, sizeof(first_b));
  return first_a == first_b && std::memcmp(a, b, bytes) == 0;
}

float NearestFloat(double bound) {
  return static_cast<float>(std::clamp(bound, -static_cast<double>(kLargest), static_cast<double>(kLargest)));
}

// Bytes from 0 to 255, as of an image: nothing can lie outside.
bool CoversItsType(const Leaf& leaf) {
  if (leaf.dtype != DType::kU8 || leaf.space.kind() != SpaceKind::kBox) return false;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    if (ElementBounds(leaf, i) != std::pair(0.0, 255.0)) return false;
  }
  return true;
}

bool Varies(const Layout& layout) {
  for (const Leaf& leaf : layout.leaves) {
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const auto [low, high] = ElementBounds(leaf, i);
      if (low < high) return true;
    }
  }
  return false;
}

double Replacement(double value, double low, double high) {
  const double bound = value > 0.0 ? high : low;
  if (!std::isnan(value) && std::isfinite(static_cast<float>(bound))) return bound;
  return std::clamp(0.0, low, high);
}

}  // namespace

Status NoReward(std::string_view where, float reward, std::string_view hint) {
  return {StatusCode::kNonFinite, fmt::format("{}: the reward is {}{}; {}", where, reward,
                                              std::isinf(reward) ? ", or a number beyond float32's 3.4e38" : "", hint)};
}

DataWatchOptions DataWatchOptions::Of(const RunConfig& config, const EnvSpec& spec) {
  DataWatchOptions options;
  options.non_finite = config.non_finite == "replace" ? NonFinite::kReplace : NonFinite::kError;
  options.max_abs_reward = config.max_abs_reward;
  options.one_step_episodes = config.one_step_episodes || spec.max_episode_steps == 1;
  options.max_episode_steps = spec.max_episode_steps;
  return options;
}

DataWatch::DataWatch(const BehaviourSpec& behaviour, const DataWatchOptions& options)
    : name_(behaviour.name),
      agents_(behaviour.agents),
      row_bytes_(behaviour.observation_layout.row_bytes),
      varies_(Varies(behaviour.observation_layout)),
      options_(options),
      largest_reward_(options.max_abs_reward > 0.0 ? NearestFloat(options.max_abs_reward) : kLargest),
      lengths_(static_cast<std::size_t>(behaviour.slots)),
      equal_(static_cast<std::size_t>(behaviour.slots)) {
  if (behaviour.masks_actions) {
    choices_ = MaskedChoices(behaviour.action_layout);
    mask_bytes_ = static_cast<std::size_t>(behaviour.action_layout.mask_bytes);
  }
  for (const Leaf& leaf : behaviour.observation_layout.leaves) {
    if (CoversItsType(leaf)) continue;
    WatchedLeaf& watched = leaves_.emplace_back();
    watched.leaf = leaf;
    watched.choices = leaf.space.kind() != SpaceKind::kBox;
    if (leaf.dtype != DType::kF32) continue;
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const auto [low, high] = ElementBounds(leaf, i);
      watched.low.push_back(NearestFloat(low));
      watched.high.push_back(NearestFloat(high));
    }
  }
  // Rows of few numbers are looked at many at a time.
  constexpr std::size_t kTile = 64;  // numbers, at least
  while (behaviour.observation_layout.plain_floats && tile_low_.size() < kTile) {
    for (const WatchedLeaf& watched : leaves_) {
      tile_low_.insert(tile_low_.end(), watched.low.begin(), watched.low.end());
      tile_high_.insert(tile_high_.end(), watched.high.begin(), watched.high.end());
    }
  }
}

// The fast way, for all rows at once: whether every observation and reward is as it should be. False: look closer.
bool DataWatch::AllClean(const Batch& batch) const {
  const auto rows = static_cast<std::size_t>(batch.rows());
  if (tile_low_.empty() || !AllAtMost(batch.rewards, largest_reward_, rows)) return false;
  const std::size_t count = rows * row_bytes_ / sizeof(float);
  const auto* values = reinterpret_cast<const float*>(batch.next_observations);
  for (std::size_t i = 0; i < count; i += tile_low_.size()) {
    if (!AllWithin(values + i, tile_low_.data(), tile_high_.data(), std::min(tile_low_.size(), count - i)))
      return false;
  }
  return true;
}

Status DataWatch::Begin(Batch& batch) {
  for (std::size_t row = 0; row < batch.slots.size(); ++row) {
    const std::int32_t slot = batch.slots[row];
    lengths_[static_cast<std::size_t>(slot)] = equal_[static_cast<std::size_t>(slot)] = 0;
    CONSAC_RETURN_IF_ERROR(CheckRow(slot, batch.next_observations + row * row_bytes_, "first observation"));
    if (!choices_.empty()) CONSAC_RETURN_IF_ERROR(CheckMask(slot, batch.next_action_masks + row * mask_bytes_));
  }
  return Status::Ok();
}

Status DataWatch::Check(Batch& batch, std::span<const std::uint8_t> goes_on) {
  ++steps_;
  const bool clean = AllClean(batch);
  for (std::size_t row = 0; row < batch.slots.size(); ++row) {
    const std::int32_t slot = batch.slots[row];
    const bool ended = (batch.terminated[row] | batch.truncated[row]) != 0;
    if (!clean) {
      CONSAC_RETURN_IF_ERROR(CheckRow(slot, batch.next_observations + row * row_bytes_, "observation"));
      if (!(std::fabs(batch.rewards[row]) <= largest_reward_))
        CONSAC_RETURN_IF_ERROR(CheckReward(slot, &batch.rewards[row]));
    }
    if (ended) CONSAC_RETURN_IF_ERROR(CheckRow(slot, batch.final_observations + row * row_bytes_, "final observation"));
    if (!choices_.empty() && (goes_on.empty() || goes_on[row] != 0))
      CONSAC_RETURN_IF_ERROR(CheckMask(slot, batch.next_action_masks + row * mask_bytes_));
    WatchStandstill(slot, batch, row);
    CONSAC_RETURN_IF_ERROR(WatchLength(slot, ended));
  }
  return Status::Ok();
}

Status DataWatch::CheckRow(std::int32_t slot, std::byte* row, const char* which) {
  for (WatchedLeaf& watched : leaves_) {
    const bool floats = !watched.low.empty();
    const auto* values = reinterpret_cast<const float*>(row + watched.leaf.offset);
    if (floats && AllWithin(values, watched.low.data(), watched.high.data(), watched.low.size())) continue;
    CONSAC_RETURN_IF_ERROR(CheckLeaf(watched, slot, row, which));
  }
  return Status::Ok();
}

// The slow way: element by element, and what is to be done with each.
Status DataWatch::CheckLeaf(WatchedLeaf& watched, std::int32_t slot, std::byte* row, const char* which) {
  const Leaf& leaf = watched.leaf;
  std::int64_t first_outside = -1;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const double value = ReadElement(leaf, row, i);
    const auto [low, high] = ElementBounds(leaf, i);
    const bool finite = std::isfinite(static_cast<float>(value));  // learners take numbers as float32
    if (finite && value >= low && value <= high) continue;
    const auto element = [&] {
      return fmt::format("{}{}, element {}, is {}", which, leaf.name.empty() ? "" : " '" + leaf.name + "'", i, value);
    };
    if (!finite && options_.non_finite == NonFinite::kError) {
      return {StatusCode::kNonFinite,
              fmt::format("{}: {}; mend it in the world, or set non_finite to replace", Where(slot), element())};
    }
    if (!finite) {
      ++replaced_;
      if (!std::exchange(said_replaced_, true))
        Warn(fmt::format("{}: {}; such numbers are replaced and counted", Where(slot), element()));
      WriteElement(leaf, row, i, Replacement(value, low, high));
      continue;
    }
    if (watched.choices) {
      return {StatusCode::kProtocol, fmt::format("{}: {}, which is no choice from {} to {}; mend it in the world",
                                                 Where(slot), element(), low, high)};
    }
    if (first_outside < 0) first_outside = i;
  }
  if (first_outside >= 0 && watched.outside++ == 0) {
    const auto [low, high] = ElementBounds(leaf, first_outside);
    Warn(fmt::format(
        "{}: {}{}, element {}, is {} and lies outside its bounds {} to {}; learning goes on with it, further "
        "ones are only counted",
        Where(slot), which, leaf.name.empty() ? "" : " '" + leaf.name + "'", first_outside,
        ReadElement(leaf, row, first_outside), low, high));
  }
  return Status::Ok();
}

Status DataWatch::CheckReward(std::int32_t slot, float* reward) {
  if (options_.non_finite == NonFinite::kError) {
    if (!std::isfinite(*reward))
      return NoReward(Where(slot), *reward, "mend it in the world, or set non_finite to replace");
    return {StatusCode::kInvalidArgument,
            fmt::format("{}: the reward is {}, beyond max_abs_reward = {}; mend the world or raise the limit",
                        Where(slot), *reward, options_.max_abs_reward)};
  }
  ++replaced_;
  if (!std::exchange(said_replaced_, true))
    Warn(fmt::format("{}: the reward is {}; such numbers are replaced and counted", Where(slot), *reward));
  const bool limited = options_.max_abs_reward > 0.0 && !std::isnan(*reward);
  *reward = limited ? std::copysign(largest_reward_, *reward) : 0.0f;
  return Status::Ok();
}

Status DataWatch::CheckMask(std::int32_t slot, const std::uint8_t* mask) const {
  const std::int64_t choice = ChoiceWithNothingLegal(choices_, mask);
  if (choice < 0) return Status::Ok();
  return {StatusCode::kProtocol,
          fmt::format("{}: choice {} of the action has no legal action left; let the world leave at least one",
                      Where(slot), choice)};
}

void DataWatch::WatchStandstill(std::int32_t slot, const Batch& batch, std::size_t row) {
  if (said_standstill_ || !varies_) return;
  std::int64_t& equal = equal_[static_cast<std::size_t>(slot)];
  const std::size_t at = row * row_bytes_;
  if (!SameRow(batch.observations + at, batch.next_observations + at, row_bytes_)) {
    equal = 0;
    return;
  }
  if (++equal < kStandstill) return;
  said_standstill_ = true;
  Warn(fmt::format("{}: the observation has not changed for {} steps; is a sensor frozen, or does the world not step?",
                   Where(slot), kStandstill));
}

Status DataWatch::WatchLength(std::int32_t slot, bool ended) {
  std::int64_t& length = lengths_[static_cast<std::size_t>(slot)];
  ++length;
  const std::int64_t limit = options_.max_episode_steps > 0 ? options_.max_episode_steps : kLongEpisode;
  if (!ended && !said_long_ && length > limit) {
    said_long_ = true;
    Warn(
        options_.max_episode_steps > 0
            ? fmt::format("{}: the episode goes on after {} steps, where the world promised an end", Where(slot), limit)
            : fmt::format("{}: the episode has not ended after {} steps; mean episode rewards are of ended episodes "
                          "only, so let the world truncate at a time limit if it is not meant to go on",
                          Where(slot), limit));
  }
  if (!ended) return Status::Ok();
  short_in_a_row_ = length == 1 && !options_.one_step_episodes ? short_in_a_row_ + 1 : 0;
  length = 0;
  if (short_in_a_row_ == 0) return Status::Ok();
  if (short_in_a_row_ >= kShortError) {
    return {StatusCode::kProtocol,
            fmt::format("{}: {} episodes in a row ended with their first step; reset the world before the next "
                        "episode, or set one_step_episodes to true where that is meant",
                        Where(slot), kShortError)};
  }
  if (short_in_a_row_ >= kShortWarning && !std::exchange(said_short_, true))
    Warn(fmt::format("{}: {} episodes in a row ended with their first step; is the world reset after an end?",
                     Where(slot), kShortWarning));
  return Status::Ok();
}

std::int64_t DataWatch::outside() const {
  std::int64_t sum = 0;
  for (const WatchedLeaf& watched : leaves_) sum += watched.outside;
  return sum;
}

std::string DataWatch::Summary() const {
  std::string text;
  if (replaced_ > 0) text = fmt::format("{} numbers replaced", replaced_);
  if (outside() > 0) text += fmt::format("{}{} rows outside their bounds", text.empty() ? "" : ", ", outside());
  return text;
}

std::string DataWatch::Where(std::int32_t slot) const {
  const auto agents = static_cast<std::int32_t>(agents_.size());
  std::string where = fmt::format("'{}', environment {}", name_, slot / agents);
  if (agents > 1) where += ", agent '" + agents_[static_cast<std::size_t>(slot % agents)] + "'";
  return where + ", " + (steps_ == 0 ? "reset" : fmt::format("step {}", steps_));
}

void DataWatch::Warn(const std::string& what) const {
  Log(LogLevel::kWarning, what);
}

}  // namespace consac::run
