#include "report/budget.h"

#include <iterator>

namespace consac::run {
namespace {

constexpr double kShownShare = 0.005;  // less than half a percent is not worth a word

}  // namespace

void Budget::Add(const TimeSpent& rounds, double now) {
  if (began_ < 0.0) began_ = now;
  if (now - began_ >= kWindow) {
    last_ = present_;
    present_ = {};
    began_ = now;
  }
  present_.Add(rounds);
}

TimeSpent Budget::recent() const {
  TimeSpent sum = last_;
  sum.Add(present_);
  return sum;
}

void AppendBudget(const TimeSpent& spent, const char* world, fmt::memory_buffer* out) {
  const auto to = std::back_inserter(*out);
  const double all = spent.sum();
  if (spent.rounds == 0 || all <= 0.0) return;
  const double rounds = static_cast<double>(spent.rounds);
  const auto per_round = [&](double seconds) { return 1e3 * seconds / rounds; };
  fmt::format_to(to, "a step takes {:.3g} ms:", per_round(all));
  const struct {
    const char* name;
    double seconds;
  } parts[] = {{world, spent.world},
               {"wire", spent.wire},
               {"inference", spent.inference},
               {"learning", spent.learning},
               {"other", spent.other}};
  const char* separator = " ";
  for (const auto& part : parts) {
    if (part.seconds < kShownShare * all) continue;
    fmt::format_to(to, "{}{} {:.3g} ms {:.0f} %", separator, part.name, per_round(part.seconds),
                   100.0 * part.seconds / all);
    separator = ", ";
  }
  fmt::format_to(to, "; that allows {:.0f} steps/s", static_cast<double>(spent.agent_steps) / all);
}

}  // namespace consac::run
