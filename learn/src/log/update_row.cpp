#include "consac/learn/log/update_row.h"

#include <algorithm>

#include "consac/base/names.h"

namespace consac::learn {

const char* StepsKey(LogStyle style) {
  return style == LogStyle::kStableBaselines2 ? "total_timesteps" : "time/total_timesteps";
}

UpdateRow::UpdateRow(LogStyle style, std::string_view name, bool alone, std::int32_t slots)
    : style_(style), prefix_(alone ? std::string() : FileNameOf(std::string(name), "/")), slots_(slots) {}

// Kept here, so that a row outlives what the learner said, and a key that is known allocates nothing. A name may hold a
// comma or a slash; a key may not.
std::string_view UpdateRow::Key(std::string_view key) {
  auto known = keys_.find(key);
  if (known == keys_.end()) known = keys_.emplace(key, prefix_ + std::string(key)).first;
  return known->second;
}

void UpdateRow::Make(const UpdateReport& update, const Moment& now, const EpisodeMeans& episodes) {
  row_.clear();
  for (const Metric& metric : update.metrics) {
    if (metric.table_key.empty()) continue;
    const bool count = metric.table_key == "train/n_updates";  // an int in Stable Baselines3
    Put(metric.table_key, metric.value,
        count                     ? CellKind::kInteger
        : metric.single_precision ? CellKind::kSingle
                                  : CellKind::kDouble);
  }
  if (IsSb2())
    FillSb2(update, now, episodes);
  else
    FillSb3(update, now, episodes);
  started_ = now.seconds;
  started_steps_ = now.steps;
}

// Source: Stable Baselines 2.10.2, ppo2.py: fps is of this update, time_elapsed is when this update started.
void UpdateRow::FillSb2(const UpdateReport& update, const Moment& now, const EpisodeMeans& episodes) {
  const double seconds = std::max(now.seconds - started_, 1e-9);
  Put("fps", static_cast<double>(now.steps - started_steps_) / seconds, CellKind::kInteger);
  Put("n_updates", static_cast<double>(update.updates), CellKind::kInteger);
  Put("time_elapsed", started_, CellKind::kDouble);
  if (update.steps_per_update > 0) {
    const std::int64_t n_steps = update.steps_per_update / std::max(slots_, 1);
    Put("serial_timesteps", static_cast<double>(update.updates) * static_cast<double>(n_steps), CellKind::kInteger);
  }
  if (episodes.count() == 0) return;
  Put("ep_len_mean", episodes.mean_length(), CellKind::kDouble);
  Put("ep_reward_mean", episodes.mean_reward(), CellKind::kDouble);
}

// Source: Stable Baselines3, on_policy_algorithm.py: fps and time_elapsed are of the whole training.
void UpdateRow::FillSb3(const UpdateReport& update, const Moment& now, const EpisodeMeans& episodes) {
  Put("time/fps", static_cast<double>(now.steps) / std::max(now.seconds, 1e-9), CellKind::kInteger);
  if (update.steps_per_update > 0) Put("time/iterations", static_cast<double>(update.updates), CellKind::kInteger);
  Put("time/time_elapsed", now.seconds, CellKind::kInteger);
  if (episodes.count() == 0) return;
  Put("rollout/ep_len_mean", episodes.mean_length(), CellKind::kDouble);
  Put("rollout/ep_rew_mean", episodes.mean_reward(), CellKind::kDouble);
}

// Stable Baselines3 also writes the table's own numbers, but for those that are the axis or count it.
void UpdateRow::WriteScalars(const UpdateReport& update, std::int64_t steps, double wall_time, EventWriter& events) {
  for (const Metric& metric : update.metrics) {
    if (!metric.tensorboard_tag.empty()) events.Scalar(wall_time, steps, Key(metric.tensorboard_tag), metric.value);
  }
  if (IsSb2()) return;
  for (const char* key : {"rollout/ep_len_mean", "rollout/ep_rew_mean", "time/fps"}) {
    for (const Cell& cell : row_) {
      if (cell.key == Key(key)) events.Scalar(wall_time, steps, cell.key, cell.value);
    }
  }
}

void UpdateRow::Visit(Archive& archive) {
  archive("update_started", started_);
  archive("update_started_steps", started_steps_);
}

}  // namespace consac::learn
