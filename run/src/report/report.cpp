// The one Report: keeps the episode window and hands each event to the sinks.
#include "consac/run/report.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "consac/base/text.h"
#include "report/curve.h"
#include "report/table.h"
#include "report/tensorboard.h"
#include "report/text_files.h"

namespace consac::run {
namespace {

constexpr std::size_t kEpisodeWindow = 100;       // Stable Baselines' ep_info buffer
constexpr double kBarEvery = 0.1, kLineEvery = 5.0;  // s between refreshes on a terminal and elsewhere
constexpr int kCallsPerLook = 64;                 // steps between looks at the clock
constexpr std::int64_t kMonitorFlush = 64;        // episodes between flushes

double SystemTime() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

std::string DurationText(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0) return "--:--";
  const auto whole = static_cast<std::int64_t>(seconds + 0.5);
  return whole >= 3600 ? fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60) : fmt::format("{:02}:{:02}", whole / 60, whole % 60);
}

class FullReport final : public Report {
 public:
  explicit FullReport(const ReportOptions& options) : options_(options), terminal_(isatty(STDOUT_FILENO) != 0) {
    rewards_.reserve(kEpisodeWindow);
    lengths_.reserve(kEpisodeWindow);
    start_ = last_update_ = last_line_ = Now();
  }

  Status OpenFiles() {
    if (options_.directory.empty()) return Status::Ok();
    CONSAC_RETURN_IF_ERROR(progress_.Open(options_.directory + "/progress.csv", StepKey(), options_.append, options_.resume_step));
    if (options_.tensorboard) {
      const std::string folder = TensorBoardFolder(options_.directory + "/tensorboard", options_.algorithm, options_.append);
      CONSAC_RETURN_IF_ERROR(tensorboard_.Open(folder));
    }
    return options_.append ? Status::Ok() : OpenMonitor(false);
  }

  void OnEpisode(const EpisodeEnd& episode) override {
    if (rewards_.size() < kEpisodeWindow) {
      rewards_.push_back(episode.reward);
      lengths_.push_back(static_cast<double>(episode.length));
    } else {
      rewards_[static_cast<std::size_t>(episodes_) % kEpisodeWindow] = episode.reward;
      lengths_[static_cast<std::size_t>(episodes_) % kEpisodeWindow] = static_cast<double>(episode.length);
    }
    ++episodes_;
    last_episode_step_ = episode.at_step;
    episode_curve_.Add(episode.at_step, episode.reward, 1.0);
    WriteMonitor(episode);
    tensorboard_.Scalar(episode.at_step, "episode_reward", episode.reward);
  }

  void OnUpdate(std::span<const learn::Metric> metrics, std::int64_t steps, std::int64_t updates, std::int64_t steps_per_update) override {
    const double now = Now();
    Cells cells = MakeCells(steps, updates, steps_per_update, now);
    for (const learn::Metric& metric : metrics) {
      if (!metric.table_key.empty()) cells[std::string(metric.table_key)] = {metric.value, metric.table_key == "train/n_updates", metric.single_precision};
      if (!metric.tensorboard_tag.empty()) tensorboard_.Scalar(steps, metric.tensorboard_tag, metric.value);
    }
    if (options_.style == learn::LogStyle::kStableBaselines3) {
      for (const auto& [key, cell] : cells) {
        if (!key.starts_with("train/")) tensorboard_.Scalar(steps, key, cell.value);
      }
    }
    if (!options_.directory.empty()) progress_.Add(cells);
    if (options_.console_table && (updates % options_.log_interval == 0 || updates == 1)) Print(RenderTable(cells, options_.style));
    if (now - last_flush_ > 1.0) Flush(now);
    last_update_ = now;
    last_update_steps_ = steps;
  }

  void OnStep(std::int64_t steps, double reward_sum) override {
    step_reward_ += reward_sum;
    step_count_ += steps - steps_;
    steps_ = steps;
    if (++calls_ % kCallsPerLook != 0) return;
    step_curve_.Add(steps, step_reward_, static_cast<double>(step_count_));
    step_reward_ = 0.0;
    step_count_ = 0;
    if (!options_.progress) return;
    const double now = Now();
    if (terminal_ && now - last_line_ >= kBarEvery) DrawBar(now);
    if (!terminal_ && now - last_line_ >= kLineEvery) {
      last_line_ = now;
      fmt::print("{}\n", ProgressText(now));
      std::fflush(stdout);
    }
  }

  void Line(std::string_view line) override { Print(std::string(line) + "\n"); }

  Status Finish() override {
    if (options_.progress) Print(ProgressText(Now()) + "\n");
    if (options_.directory.empty()) return Status::Ok();
    Flush(Now());
    CONSAC_RETURN_IF_ERROR(progress_.status());
    CONSAC_RETURN_IF_ERROR(tensorboard_.status());
    CONSAC_RETURN_IF_ERROR(monitor_.status());
    // Where episodes have stopped ending (a road that is no longer left), the reward of a step tells more.
    const bool ends = episodes_ >= 20 && last_episode_step_ * 10 >= steps_ * 9;
    const std::string title = options_.algorithm + " on " + options_.world_id;
    return DrawCurve(options_.directory + "/curve", {title, ends ? "reward per episode" : "reward per step"}, ends ? episode_curve_.Points() : step_curve_.Points());
  }

  double mean_episode_reward() const override { return Mean(rewards_); }
  double mean_episode_length() const override { return Mean(lengths_); }

  void Visit(Archive& archive) override {
    double elapsed = Now() - start_;
    archive("elapsed", elapsed);
    archive("rewards", rewards_);
    archive("lengths", lengths_);
    archive("episodes", episodes_);
    archive("monitor_rows", monitor_rows_);
    archive("last_episode_step", last_episode_step_);
    archive("steps", steps_);
    archive("episode_curve", episode_curve_);
    archive("step_curve", step_curve_);
    if (!archive.loading()) return;
    start_ = Now() - elapsed;
    last_update_ = Now();
    first_steps_ = last_update_steps_ = steps_;
    rewards_.reserve(kEpisodeWindow);
    lengths_.reserve(kEpisodeWindow);
    if (options_.append && !options_.directory.empty()) {
      const Status status = OpenMonitor(true);
      if (!status.ok()) Line("error: " + status.message());
    }
  }

 private:
  static double Mean(const std::vector<double>& values) {
    if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  }

  std::string StepKey() const { return options_.style == learn::LogStyle::kStableBaselines2 ? "total_timesteps" : "time/total_timesteps"; }

  Status OpenMonitor(bool again) {
    const std::string path = options_.directory + "/monitor.csv";
    if (again) {
      CONSAC_RETURN_IF_ERROR(TruncateMonitor(path, monitor_rows_));
      return monitor_.Open(path, true);
    }
    CONSAC_RETURN_IF_ERROR(monitor_.Open(path, false));
    monitor_.Write("#" + nlohmann::json({{"t_start", SystemTime()}, {"env_id", options_.world_id}}).dump() + "\nr,l,t\n");
    monitor_.Flush();
    return monitor_.status();
  }

  // Formatted on the stack: an episode may end in any step, and no step allocates.
  void WriteMonitor(const EpisodeEnd& episode) {
    if (!monitor_.is_open()) return;
    char line[128];
    const auto end = fmt::format_to_n(line, sizeof(line), "{:.6f},{},{:.6f}\n", episode.reward, episode.length, Now() - start_);
    monitor_.Write({line, static_cast<std::size_t>(end.out - line)});
    ++monitor_rows_;
    if (monitor_rows_ % kMonitorFlush == 0) monitor_.Flush();
  }

  Cells MakeCells(std::int64_t steps, std::int64_t updates, std::int64_t steps_per_update, double now) const {
    Cells cells;
    const bool sb2 = options_.style == learn::LogStyle::kStableBaselines2;
    const auto put = [&](const char* sb2_key, const char* sb3_key, double value, bool whole) {
      const char* key = sb2 ? sb2_key : sb3_key;
      if (key != nullptr) cells[key] = {value, whole, false};
    };
    // SB2: steps of this update over its duration, and the time at which it started. SB3: over the whole run.
    const double update_fps = static_cast<double>(steps - last_update_steps_) / std::max(now - last_update_, 1e-9);
    const double run_fps = static_cast<double>(steps - first_steps_) / std::max(now - start_, 1e-9);
    put("fps", "time/fps", std::floor(sb2 ? update_fps : run_fps), true);
    put("n_updates", nullptr, static_cast<double>(updates), true);
    put(nullptr, "time/iterations", static_cast<double>(updates), true);
    put("serial_timesteps", nullptr, static_cast<double>(updates * steps_per_update / options_.slots), true);
    put("total_timesteps", "time/total_timesteps", static_cast<double>(steps), true);
    put("time_elapsed", "time/time_elapsed", sb2 ? last_update_ - start_ : std::floor(now - start_), !sb2);
    if (!rewards_.empty()) {
      put("ep_reward_mean", "rollout/ep_rew_mean", mean_episode_reward(), false);
      put("ep_len_mean", "rollout/ep_len_mean", mean_episode_length(), false);
    }
    return cells;
  }

  std::string ProgressText(double now) const {
    const double seconds = std::max(now - start_, 1e-9), rate = static_cast<double>(steps_ - first_steps_) / seconds;
    const double share = options_.total_steps > 0 ? static_cast<double>(steps_) / static_cast<double>(options_.total_steps) : 0.0;
    const double left = rate > 0 ? static_cast<double>(options_.total_steps - steps_) / rate : std::numeric_limits<double>::infinity();
    const std::string reward = rewards_.empty() ? "no episode yet" : fmt::format("episode reward {:.4g}", mean_episode_reward());
    return fmt::format("{:3.0f}%  {} of {} steps  {:.0f} steps/s  {}  {} left", 100.0 * share, steps_, options_.total_steps, rate, reward, DurationText(std::max(left, 0.0)));
  }

  void DrawBar(double now) {
    last_line_ = now;
    winsize size{};
    const int columns = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
    std::string text = ProgressText(now);
    const int room = columns - static_cast<int>(text.size()) - 4;
    if (room >= 10) {
      const double share = options_.total_steps > 0 ? static_cast<double>(steps_) / static_cast<double>(options_.total_steps) : 0.0;
      const auto filled = static_cast<std::size_t>(std::min(1.0, share) * room);
      text = "[" + std::string(filled, '#') + std::string(static_cast<std::size_t>(room) - filled, ' ') + "] " + text;
    }
    text.resize(std::min(text.size(), static_cast<std::size_t>(columns - 1)));
    fmt::print("\r\x1b[K{}", text);
    std::fflush(stdout);
    bar_drawn_ = true;
  }

  void Print(const std::string& text) {
    if (bar_drawn_) fmt::print("\r\x1b[K");
    bar_drawn_ = false;
    fmt::print("{}", text);
    std::fflush(stdout);
  }

  void Flush(double now) {
    last_flush_ = now;
    progress_.Flush();
    tensorboard_.Flush();
    monitor_.Flush();
    for (const Status* status : {&progress_.status(), &tensorboard_.status(), &monitor_.status()}) {
      if (status->ok() || failure_said_) continue;
      failure_said_ = true;
      Line("error: " + status->message() + "; training goes on without this log");
    }
  }

  const ReportOptions options_;
  const bool terminal_;
  ProgressCsv progress_;
  TensorBoardFile tensorboard_;
  LineFile monitor_;
  std::vector<double> rewards_, lengths_;      // of the last episodes
  CurvePoints episode_curve_, step_curve_;
  std::int64_t episodes_ = 0, monitor_rows_ = 0, last_episode_step_ = 0;
  std::int64_t steps_ = 0, first_steps_ = 0, last_update_steps_ = 0, step_count_ = 0;
  double step_reward_ = 0.0;
  double start_ = 0.0, last_update_ = 0.0, last_line_ = 0.0, last_flush_ = 0.0;
  std::uint32_t calls_ = 0;
  bool bar_drawn_ = false, failure_said_ = false;
};

}  // namespace

Result<std::unique_ptr<Report>> Report::Open(const ReportOptions& options) {
  auto report = std::make_unique<FullReport>(options);
  CONSAC_RETURN_IF_ERROR(report->OpenFiles());
  return std::unique_ptr<Report>(std::move(report));
}

}  // namespace consac::run
