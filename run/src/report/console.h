#pragma once
// Where a run's words go: one stream, whose last line may be a bar that is redrawn in place.

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>

#include "consac/base/hooks.h"

namespace consac::run {

/// A stream and what it can do.
struct ConsoleOptions {
  std::FILE* stream = stdout;
  bool terminal = false;  ///< understands escape codes, so a line can be redrawn
  bool colour = false;    ///< a terminal whose user has not set NO_COLOR (https://no-color.org)
  int columns = 0;        ///< width; 0: ask the terminal each time
  double hold_until = 0;  ///< until then [s, Now()] lines wait for what follows, or go with the console
};

/// What standard output is: a terminal, unless piped or TERM is "dumb".
ConsoleOptions StandardConsole();

/// Prints; failures are nobody's business (the reader went away). A reader that stands still is waited for once, a
/// second; until it reads again it misses what is said, and the training goes on.
class Console {
 public:
  /// Prints to `options.stream`, which must outlive it.
  explicit Console(const ConsoleOptions& options) : options_(options) {}

  /// Prints text that ends in a newline; a bar moves below it. What does not show becomes \xNN (consac/base/names.h).
  void Print(std::string_view text);
  /// Prints one line; what comes from outside cannot make it two.
  void Line(std::string_view line);
  /// Prints one line that must not be overlooked.
  void Alarm(std::string_view line);
  /// Draws or redraws the bar: one line, at most columns() wide. Terminals only. Never allocates.
  void Bar(std::string_view line);
  /// Leaves the bar where it is and goes on below it.
  void EndBar();

  /// Characters that fit beside each other on one line; 80 where nobody says.
  int columns() const;
  /// See ConsoleOptions.
  bool terminal() const { return options_.terminal; }
  /// See ConsoleOptions.
  bool colour() const { return options_.colour; }

 private:
  void Put(std::string_view text);
  bool Holds() const { return options_.hold_until > 0.0 && Now() < options_.hold_until && held_.size() < kMostHeld; }
  void Release();
  void PrintAbove(std::string_view text);

  static constexpr std::size_t kMostHeld = std::size_t{64} << 10;  // bytes: who says so much is heard

  ConsoleOptions options_;
  std::string held_;
  bool unread_ = false;     // the reader stands still
  fmt::memory_buffer bar_;  // as drawn; empty: none
};

}  // namespace consac::run
