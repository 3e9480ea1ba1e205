#include "report/progress.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace consac::run {
namespace {

constexpr double kMarkEvery = 0.5;  // s
constexpr int kWidestBar = 40, kNarrowestBar = 8, kWidestLine = 200;
constexpr std::size_t kMostRewards = 4;  // in one line

// 1234567 as 1,234,567.
void AppendGrouped(std::int64_t value, fmt::memory_buffer* out) {
  const fmt::format_int digits(value);
  const std::string_view text(digits.data(), digits.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i > 0 && text[i - 1] != '-' && (text.size() - i) % 3 == 0) out->push_back(',');
    out->push_back(text[i]);
  }
}

void AppendRate(double rate, fmt::memory_buffer* out) {
  if (rate < 100.0) {
    fmt::format_to(std::back_inserter(*out), "{:.1f}", rate);
  } else {
    AppendGrouped(static_cast<std::int64_t>(rate), out);
  }
  out->append(std::string_view(" steps/s"));
}

double Share(const ProgressView& view) {
  if (view.total_steps <= 0) return 0.0;
  return std::clamp(static_cast<double>(view.steps) / static_cast<double>(view.total_steps), 0.0, 1.0);
}

void AppendPercent(const ProgressView& view, fmt::memory_buffer* out) {
  fmt::format_to(std::back_inserter(*out), "{:3.0f}%", std::floor(100.0 * Share(view)));
}

void AppendSteps(const ProgressView& view, std::string_view of, fmt::memory_buffer* out) {
  AppendGrouped(view.steps, out);
  if (view.total_steps <= 0) return;
  out->append(of);
  AppendGrouped(view.total_steps, out);
}

void AppendReward(const RewardView& view, fmt::memory_buffer* out) {
  if (std::isnan(view.reward)) {
    out->append(std::string_view("no episode yet"));
  } else {
    fmt::format_to(std::back_inserter(*out), "{} {:.4g}", view.per_step ? "reward per step" : "mean episode reward",
                   view.reward);
  }
}

// "mean episode reward hunter 3.1, prey 0.02 a step, scout none yet".
void AppendRewards(const ProgressView& view, fmt::memory_buffer* out) {
  const auto to = std::back_inserter(*out);
  if (view.rewards.size() == 1) return AppendReward(view.rewards[0], out);
  if (std::all_of(view.rewards.begin(), view.rewards.end(),
                  [](const RewardView& one) { return std::isnan(one.reward); }))
    return AppendReward({}, out);
  out->append(std::string_view("mean episode reward"));
  for (std::size_t i = 0; i < view.rewards.size(); ++i) {
    if (i == kMostRewards) {
      fmt::format_to(to, ", and of {} more", view.rewards.size() - i);
      break;
    }
    const RewardView& one = view.rewards[i];
    fmt::format_to(to, "{} {} ", i == 0 ? "" : ",", one.behaviour);
    if (std::isnan(one.reward))
      out->append(std::string_view("none yet"));
    else
      fmt::format_to(to, "{:.4g}{}", one.reward, one.per_step ? " a step" : "");
  }
}

void AppendTimeLeft(const ProgressView& view, fmt::memory_buffer* out) {
  if (view.total_steps <= 0) return;
  const double left = static_cast<double>(std::max<std::int64_t>(view.total_steps - view.steps, 0));
  out->append(std::string_view(" | "));
  AppendDuration(left / view.steps_per_second, out);
  out->append(std::string_view(" left"));
}

void AppendRest(const ProgressView& view, fmt::memory_buffer* out) {
  out->append(std::string_view(" | "));
  AppendRate(view.steps_per_second, out);
  out->append(std::string_view(" | "));
  AppendRewards(view, out);
  AppendTimeLeft(view, out);
}

void AppendMeter(double share, int width, bool colour, fmt::memory_buffer* out) {
  const auto filled = static_cast<int>(share * width);
  out->append(std::string_view(colour ? " [\x1b[32m" : " ["));
  for (int i = 0; i < width; ++i) {
    if (i == filled && colour) out->append(std::string_view("\x1b[0m"));
    out->push_back(i < filled ? '#' : '-');
  }
  out->append(std::string_view(colour && filled == width ? "\x1b[0m]" : "]"));
}

}  // namespace

void AppendDuration(double seconds, fmt::memory_buffer* out) {
  const auto to = std::back_inserter(*out);
  if (!std::isfinite(seconds) || seconds < 0.0 || seconds > 1e9) {
    fmt::format_to(to, "-:--");
    return;
  }
  const auto whole = static_cast<std::int64_t>(seconds + 0.5);
  const std::int64_t hours = whole / 3600, minutes = whole / 60 % 60;
  if (hours >= 24) {
    fmt::format_to(to, "{}d {}h", hours / 24, hours % 24);
  } else if (hours > 0) {
    fmt::format_to(to, "{}:{:02}:{:02}", hours, minutes, whole % 60);
  } else {
    fmt::format_to(to, "{}:{:02}", minutes, whole % 60);
  }
}

void AppendProgressLine(const ProgressView& view, fmt::memory_buffer* out) {
  if (view.total_steps > 0) {
    AppendPercent(view, out);
    out->append(std::string_view(" | "));
  }
  AppendSteps(view, " of ", out);
  out->append(std::string_view(" steps"));
  AppendRest(view, out);
}

void AppendProgressBar(const ProgressView& view, int columns, bool colour, fmt::memory_buffer* out) {
  fmt::memory_buffer percent, rest;
  if (view.total_steps > 0) AppendPercent(view, &percent);
  rest.push_back(' ');
  AppendSteps(view, "/", &rest);
  AppendRest(view, &rest);
  const int room = std::clamp(columns, 2, kWidestLine) - 1;
  const int width = std::min(kWidestBar, room - static_cast<int>(percent.size() + rest.size()) - 3);
  out->append(std::string_view(percent.data(), percent.size()));
  if (width >= kNarrowestBar && view.total_steps > 0) AppendMeter(Share(view), width, colour, out);
  out->append(std::string_view(rest.data(), rest.size()));
  if (width < kNarrowestBar) out->resize(std::min(out->size(), static_cast<std::size_t>(room)));
}

void RateMeter::Start(double now, std::int64_t steps) {
  marks_[0] = {now, steps};
  oldest_ = 0;
  count_ = 1;
}

void RateMeter::Note(double now, std::int64_t steps) {
  if (now - marks_[(oldest_ + count_ - 1) % kMarks].time < kMarkEvery) return;
  if (count_ == kMarks) {
    oldest_ = (oldest_ + 1) % kMarks;
    --count_;
  }
  marks_[(oldest_ + count_++) % kMarks] = {now, steps};
}

double RateMeter::Rate(double now, std::int64_t steps) const {
  const Mark& first = marks_[oldest_];
  return now > first.time ? static_cast<double>(steps - first.steps) / (now - first.time) : 0.0;
}

void Progress::Start(double now, std::int64_t steps) {
  meter_.Start(now, steps);
  start_ = drawn_ = now;
  start_steps_ = steps;
}

void Progress::Draw(double now, ProgressView view) {
  drawn_ = now;
  meter_.Note(now, view.steps);
  view.steps_per_second = meter_.Rate(now, view.steps);
  Show(view);
}

void Progress::Finish(double now, ProgressView view) {
  view.steps_per_second = static_cast<double>(view.steps - start_steps_) / std::max(now - start_, 1e-9);
  Show(view);
  console_->EndBar();
}

void Progress::Show(const ProgressView& view) {
  fmt::memory_buffer line;
  if (console_->terminal()) {
    AppendProgressBar(view, console_->columns(), console_->colour(), &line);
    console_->Bar({line.data(), line.size()});
  } else {
    AppendProgressLine(view, &line);
    line.push_back('\n');
    console_->Print({line.data(), line.size()});
  }
}

}  // namespace consac::run
