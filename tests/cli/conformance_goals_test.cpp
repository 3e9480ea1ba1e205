// The conformance cases of other goals by the program (CONSAC_PROGRAM), before a world that has goals and one without.
#include <gmock/gmock.h>

#include "tests/cli/program_fixture.h"
#include "tests/mixed_env.h"
#include "tests/ticking_host.h"

namespace consac::testing {
namespace {

using ::testing::HasSubstr;

using ConformanceOfGoals = ProgramTest;

TEST_F(ConformanceOfGoals, EveryCaseHoldsForABehaviourWithGoalsBesideOneWithout) {
  EnvServerOptions options;
  options.training_length = 1000000;
  const ServedWorld engine(std::make_unique<MixedEnv>(), options);
  const Outcome outcome = RunProgram(folder(), {"doctor", "--conformance", engine.url()});
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("holds        RELABEL of a behaviour without goals"));
  EXPECT_THAT(outcome.out, HasSubstr("holds        rows as they came are worth what was paid for them"));
}

// Priced by their distance, as agents of a game's are.
TEST_F(ConformanceOfGoals, EveryCaseHoldsForAWorldInAnEnginesTicks) {
  host::Goals goals;
  goals.reward = host::GoalReward::kDense;
  const TickingHost engine("point-reach-dense-v0", 2, 1, 0.001, goals);
  const Outcome outcome = RunProgram(folder(), {"doctor", "--conformance", engine.url()});
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  EXPECT_THAT(outcome.out, HasSubstr("holds        rows as they came are worth what was paid for them"));
}

}  // namespace
}  // namespace consac::testing
