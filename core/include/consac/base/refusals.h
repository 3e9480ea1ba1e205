#pragma once
// What is said of connections that come to nothing: the first few in full, then one line every few seconds, so that a
// flood of them fills no disk. Used by servers and by who tells of their sessions.

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "consac/base/hooks.h"

namespace consac {

/// Lines that may come by the thousand. Not thread-safe.
class Refusals {
 public:
  /// Takes a line.
  using Sayer = std::function<void(std::string_view line)>;
  /// Lines go to `say`: the first `in_full`, then one every `every_s` seconds. By default they are warnings in the log.
  explicit Refusals(
      Sayer say = [](std::string_view line) { Log(LogLevel::kWarning, line); }, double every_s = 5.0, int in_full = 5)
      : say_(std::move(say)), every_s_(every_s), most_in_full_(in_full) {}
  /// Tells of those that were counted.
  ~Refusals() { Tell(); }
  Refusals(const Refusals&) = delete;
  Refusals& operator=(const Refusals&) = delete;

  /// Says `line`, or counts it where there have been many.
  void Say(const std::string& line) {
    Look();
    if (in_full_ >= most_in_full_) {
      latest_ = line;
      ++counted_;
      return;
    }
    ++in_full_;
    tell_at_ = Now() + every_s_;
    say_(line);
  }

  /// Tells of those that were counted, once it is time; to be called now and then.
  void Look() {
    if (in_full_ == 0 || Now() < tell_at_) return;
    const bool quiet = counted_ == 0 || Now() >= tell_at_ + every_s_;
    Tell();
    if (quiet) in_full_ = 0;
    tell_at_ = Now() + every_s_;
  }

 private:
  void Tell() {
    if (counted_ > 0) say_(latest_ + (counted_ > 1 ? " (and " + std::to_string(counted_ - 1) + " more like it)" : ""));
    counted_ = 0;
  }

  const Sayer say_;
  const double every_s_;
  const int most_in_full_;
  int in_full_ = 0;
  std::int64_t counted_ = 0;
  std::string latest_;
  double tell_at_ = 0.0;
};

}  // namespace consac
