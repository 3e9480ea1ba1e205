// The conformance cases of parameters, statistics and groups by the program (CONSAC_PROGRAM), before worlds that have
// them, and what the doctor says of these.
#include <gmock/gmock.h>

#include "tests/cli/program_fixture.h"
#include "tests/rich_env.h"
#include "tests/ticking_host.h"

namespace consac::testing {
namespace {

using ::testing::HasSubstr;

using ConformanceOfExtras = ProgramTest;

EnvServerOptions ForLong() {
  EnvServerOptions options;
  options.training_length = 1000000;
  return options;
}

TEST_F(ConformanceOfExtras, EveryCaseHoldsForAWorldThatHasAllOfThem) {
  const ServedWorld engine(std::make_unique<RichEnv>(2), ForLong());
  const Outcome outcome = RunProgram(folder(), {"doctor", "--conformance", engine.url()});
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  for (const char* name : {"STEP that sets what is too high", "what a STEP has set, an episode has that begins later",
                           "a session begins with the defaults", "groups, and what they are paid",
                           "statistics, if there are some, are as they should be"})
    EXPECT_THAT(outcome.out, HasSubstr("holds        " + std::string(name))) << outcome.out;
}

TEST_F(ConformanceOfExtras, EveryCaseHoldsForAWorldWhoseFramesAreLong) {
  const ServedWorld engine(std::make_unique<RichEnv>(200), ForLong());
  const Outcome outcome = RunProgram(folder(), {"doctor", "--conformance", engine.url()});
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  for (const char* name :
       {"a limit that RESULT does not fit in (R34)", "a limit that RESULT does not fit in by its groups"})
    EXPECT_THAT(outcome.out, HasSubstr("holds        " + std::string(name))) << outcome.out;
}

TEST_F(ConformanceOfExtras, EveryCaseHoldsForPendulums) {
  const ServedWorld engine((*worlds::FindWorld("pendulum-v1"))->create(2), ForLong());
  const Outcome outcome = RunProgram(folder(), {"doctor", "--conformance", engine.url()});
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  for (const char* name : {"a session that is taken up goes on with what was set", "what is refused sets nothing"})
    EXPECT_THAT(outcome.out, HasSubstr("holds        " + std::string(name))) << outcome.out;
}

TEST_F(ConformanceOfExtras, TheDoctorSaysWhatMayBeSetAndWhatIsNoted) {
  const ServedWorld engine(std::make_unique<RichEnv>(1), ForLong());
  const Outcome outcome = RunProgram(folder(), {"doctor", engine.url()});
  EXPECT_EQ(outcome.code, 0) << outcome.out;
  for (const char* line :
       {"parameter            speed: 1, 0 to 10 (m in a step)\n", "group                both: left, right\n",
        "statistic            walked: 1 over 100 numbers\n"})
    EXPECT_THAT(outcome.out, HasSubstr(line));
}

}  // namespace
}  // namespace consac::testing
