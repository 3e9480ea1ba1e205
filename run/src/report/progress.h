#pragma once
// How far a run is, in one line: percent, steps, steps/s, reward, time left. On a terminal it is a bar that is redrawn
// ten times a second; elsewhere a plain line every few seconds.

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

#include "report/console.h"

namespace consac::run {

/// How a behaviour does.
struct RewardView {
  std::string_view behaviour;                                ///< empty: the only one
  double reward = std::numeric_limits<double>::quiet_NaN();  ///< NaN: there is none yet
  bool per_step = false;  ///< `reward` is of a step, not of an episode (episodes do not end any more)
};

/// What the line says.
struct ProgressView {
  std::int64_t steps = 0;        ///< agent steps so far
  std::int64_t total_steps = 0;  ///< planned; 0: nobody knows
  double steps_per_second = 0.0;
  std::span<const RewardView> rewards;  ///< one per behaviour
};

/// The plain line, without a newline.
void AppendProgressLine(const ProgressView& view, fmt::memory_buffer* out);
/// The bar, at most `columns` - 1 characters wide, so that no terminal wraps it.
void AppendProgressBar(const ProgressView& view, int columns, bool colour, fmt::memory_buffer* out);
/// "0:07", "1:02:03", "3d 4h"; "-:--" for what is not finite.
void AppendDuration(double seconds, fmt::memory_buffer* out);

/// Steps per second over about the last half minute.
class RateMeter {
 public:
  /// Begins at `steps`.
  void Start(double now, std::int64_t steps);
  /// Notes where the run is; more often than every half second changes nothing.
  void Note(double now, std::int64_t steps);
  /// Steps per second up to `now`; 0 while no time has passed.
  double Rate(double now, std::int64_t steps) const;

 private:
  struct Mark {
    double time;
    std::int64_t steps;
  };
  static constexpr std::size_t kMarks = 64;
  std::array<Mark, kMarks> marks_{};
  std::size_t oldest_ = 0, count_ = 0;
};

/// Decides when the line is due and draws it. Never allocates.
class Progress {
 public:
  /// Draws on `console`, which must outlive it.
  explicit Progress(Console* console) : console_(console) {}
  /// Begins measuring, at `steps`.
  void Start(double now, std::int64_t steps);
  /// True when it is time for Draw.
  bool Due(double now) const { return now - drawn_ >= (console_->terminal() ? kBarEvery : kLineEvery); }
  /// Draws; fills in view.steps_per_second.
  void Draw(double now, ProgressView view);
  /// Draws a last time, with the mean rate of the whole session, and goes on below.
  void Finish(double now, ProgressView view);

  static constexpr double kBarEvery = 0.1;   ///< seconds
  static constexpr double kLineEvery = 5.0;  ///< seconds

 private:
  void Show(const ProgressView& view);

  Console* console_;
  RateMeter meter_;
  double start_ = 0.0, drawn_ = 0.0;
  std::int64_t start_steps_ = 0;
};

}  // namespace consac::run
