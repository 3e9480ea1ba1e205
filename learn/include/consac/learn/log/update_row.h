#pragma once
// What is told of an update of one behaviour's learner, under Stable Baselines' keys. Used by runs and by trainings
// inside an engine, for progress.csv and TensorBoard. Where a training has several behaviours, whatever is written of
// one begins with its name and a slash, "hunter/ep_reward_mean"; alone, nothing does.

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "consac/base/archive.h"
#include "consac/learn/algo/learner.h"
#include "consac/learn/log/episode_means.h"
#include "consac/learn/log/row.h"
#include "consac/learn/log/tensorboard.h"

namespace consac::learn {

/// What a learner tells, after as many updates, steps or episodes as its algorithm does.
struct UpdateReport {
  std::size_t behaviour = 0;          ///< whose learner
  std::span<const Metric> metrics;    ///< its numbers
  std::int64_t updates = 0;           ///< its counter
  std::int64_t steps_per_update = 0;  ///< of its own agents; 0: it learns continuously
  std::int64_t reports = 0;           ///< that it has made, this one included
};

/// Where a training is when one of its learners reports.
struct Moment {
  std::int64_t steps = 0;  ///< agent steps of all behaviours
  double seconds = 0.0;    ///< of training
};

/// The key of the steps of all behaviours: "total_timesteps", "time/total_timesteps".
const char* StepsKey(LogStyle style);

/// One behaviour's updates.
class UpdateRow {
 public:
  /// Of the behaviour `name` with so many agents; `alone`: the training has no other.
  UpdateRow(LogStyle style, std::string_view name, bool alone, std::int32_t slots);

  /// `key` as it is written. Lives as long as this does; one that is known allocates nothing.
  std::string_view Key(std::string_view key);
  /// Its learner has reported: row() is made anew.
  void Make(const UpdateReport& update, const Moment& now, const EpisodeMeans& episodes);
  /// The same numbers to TensorBoard. After Make.
  void WriteScalars(const UpdateReport& update, std::int64_t steps, double wall_time, EventWriter& events);
  /// The numbers of the latest update under their keys, but for the steps of the training, which all behaviours share.
  const Row& row() const { return row_; }
  /// When the update under way began.
  void Visit(Archive& archive);

 private:
  bool IsSb2() const { return style_ == LogStyle::kStableBaselines2; }
  void Put(std::string_view key, double value, CellKind kind) { row_.push_back({Key(key), value, kind}); }
  void FillSb2(const UpdateReport& update, const Moment& now, const EpisodeMeans& episodes);
  void FillSb3(const UpdateReport& update, const Moment& now, const EpisodeMeans& episodes);

  LogStyle style_;
  std::string prefix_;
  std::int32_t slots_;
  std::map<std::string, std::string, std::less<>> keys_;  // as the learner says them: as they are written
  Row row_;
  double started_ = 0.0;  // seconds of training, when this update began
  std::int64_t started_steps_ = 0;
};

}  // namespace consac::learn
