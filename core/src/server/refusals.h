#pragma once
// What an engine says of connections that it does not serve: the first few in full, then one line every few seconds, so
// that a flood of them fills no disk. Private to core/server.

#include <cstdint>
#include <string>

#include "consac/base/hooks.h"

namespace consac {

/// Lines of warning that may come by the thousand. Not thread-safe.
class Refusals {
 public:
  ~Refusals() { Tell(); }

  /// Logs `line`, or counts it where there have been many.
  void Say(const std::string& line) {
    Look();
    if (in_full_ == kInFull) {
      latest_ = line;
      ++counted_;
      return;
    }
    ++in_full_;
    tell_at_ = Now() + kEvery;
    Log(LogLevel::kWarning, line);
  }

  /// Tells of those that were counted, once it is time; to be called now and then.
  void Look() {
    if (in_full_ == 0 || Now() < tell_at_) return;
    if (counted_ == 0) in_full_ = 0;  // it has been quiet
    Tell();
    tell_at_ = Now() + kEvery;
  }

 private:
  static constexpr int kInFull = 5;
  static constexpr double kEvery = 5.0;  // s

  void Tell() {
    if (counted_ > 0)
      Log(LogLevel::kWarning,
          latest_ + (counted_ > 1 ? " (and " + std::to_string(counted_ - 1) + " more like it)" : ""));
    counted_ = 0;
  }

  int in_full_ = 0;
  std::int64_t counted_ = 0;
  std::string latest_;
  double tell_at_ = 0.0;
};

}  // namespace consac
