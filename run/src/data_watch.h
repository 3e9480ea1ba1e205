#pragma once
// Looks at what a world sends before a learner sees it: numbers that are none, values outside their bounds, sensors
// that stand still, choices without a legal action, episodes that never end or end at once. One watch per behaviour,
// which is shown every batch. Private to run.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/env/vector_env.h"
#include "consac/run/config.h"

namespace consac::run {

/// Of a reward that is no number: whose it is (`where`), what it is, what is to be done (`hint`). kNonFinite.
Status NoReward(std::string_view where, float reward, std::string_view hint);

/// What is done with a NaN or an infinity.
enum class NonFinite : std::uint8_t {
  kError,    ///< the run ends and names it
  kReplace,  ///< NaN becomes 0, infinity the bound on its side (0 where there is none); counted
};

/// What a watch accepts.
struct DataWatchOptions {
  NonFinite non_finite = NonFinite::kError;
  double max_abs_reward = 0.0;         ///< a larger reward is treated as a NaN is; 0: any finite one is taken
  bool one_step_episodes = false;      ///< episodes of a single step are meant so
  std::int64_t max_episode_steps = 0;  ///< what the world promised; 0: nothing

  /// As the run and the world say.
  static DataWatchOptions Of(const RunConfig& config, const EnvSpec& spec);
};

/// Watches one behaviour. No allocation while there is nothing to say. Batches may hold any of its slots.
class DataWatch {
 public:
  /// For the slots of `behaviour`.
  DataWatch(const BehaviourSpec& behaviour, const DataWatchOptions& options);

  /// After a reset: looks at next_observations. Episodes under way are forgotten.
  Status Begin(Batch& batch);
  /// After a step: looks at everything that the world wrote. With kReplace it mends the batch. An error names
  /// environment, step (of this watch, from 1), leaf and element. `goes_on`: one byte per row, whether its agent takes
  /// part in the next step, so that its mask means something; empty: all do.
  Status Check(Batch& batch, std::span<const std::uint8_t> goes_on = {});

  /// Numbers that were replaced so far.
  std::int64_t replaced() const { return replaced_; }
  /// Rows, leaf by leaf, that lay outside their bounds so far.
  std::int64_t outside() const;
  /// "3 numbers replaced, 12 rows outside their bounds"; "" when there was nothing.
  std::string Summary() const;

 private:
  struct WatchedLeaf {
    Leaf leaf;
    std::vector<float> low, high;  // of a float32 leaf, element by element; an open side is the largest float32
    bool choices = false;          // what lies outside is no value at all
    std::int64_t outside = 0;      // rows
  };

  bool AllClean(const Batch& batch) const;
  Status CheckRow(std::int32_t slot, std::byte* row, const char* which);
  Status CheckLeaf(WatchedLeaf& watched, std::int32_t slot, std::byte* row, const char* which);
  Status CheckReward(std::int32_t slot, float* reward);
  Status CheckMask(std::int32_t slot, const std::uint8_t* mask) const;
  void WatchStandstill(std::int32_t slot, const Batch& batch, std::size_t row);
  Status WatchLength(std::int32_t slot, bool ended);
  std::string Where(std::int32_t slot) const;
  void Warn(const std::string& what) const;

  const std::string name_;                 // of the behaviour
  const std::vector<std::string> agents_;  // of one environment
  const std::size_t row_bytes_;
  const bool varies_;  // the observation space has more than one value
  const DataWatchOptions options_;
  const float largest_reward_;
  std::vector<std::int64_t> choices_;  // mask bytes of each choice that is to be made; empty where nothing is masked
  std::size_t mask_bytes_ = 0;         // of a row
  std::vector<WatchedLeaf> leaves_;    // those that can be wrong at all
  std::vector<std::int64_t> lengths_, equal_;  // [slots] steps of the episode under way; steps without a change
  std::vector<float> tile_low_, tile_high_;    // bounds of some whole rows; empty unless rows are floats throughout
  std::int64_t steps_ = 0, replaced_ = 0, short_in_a_row_ = 0;
  bool said_replaced_ = false, said_standstill_ = false, said_long_ = false, said_short_ = false;
};

}  // namespace consac::run
