#include "report/budget.h"

#include <gtest/gtest.h>

namespace consac::run {
namespace {

std::string Said(const TimeSpent& spent, const char* world) {
  fmt::memory_buffer out;
  AppendBudget(spent, world, &out);
  return {out.data(), out.size()};
}

TEST(Budget, SaysWhereTheTimeOfAStepGoesAndWhatItAllows) {
  TimeSpent spent;
  spent.world = 0.81;
  spent.wire = 0.021;
  spent.inference = 0.04;
  spent.learning = 0.43;
  spent.rounds = 100;
  spent.agent_steps = 800;
  EXPECT_EQ(
      Said(spent, "engine"),
      "a step takes 13 ms: engine 8.1 ms 62 %, wire 0.21 ms 2 %, inference 0.4 ms 3 %, learning 4.3 ms 33 %; that "
      "allows 615 steps/s");
  EXPECT_EQ(Said({}, "engine"), "") << "nothing to tell yet";
}

TEST(Budget, ForgetsWhatIsLongAgo) {
  Budget budget;
  TimeSpent slow, fast;
  slow.world = 1.0;
  fast.world = 0.001;
  slow.rounds = fast.rounds = slow.agent_steps = fast.agent_steps = 1;
  for (int second = 0; second < 10; ++second) budget.Add(slow, second);
  EXPECT_EQ(budget.recent().rounds, 10);
  for (int second = 10; second < 31; ++second) budget.Add(fast, second);
  const TimeSpent recent = budget.recent();
  EXPECT_LT(recent.world / static_cast<double>(recent.rounds), 0.01);
  EXPECT_GE(recent.rounds, 10);
}

}  // namespace
}  // namespace consac::run
