#pragma once
// What the tests of the built program share.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/program.h"
#include "tests/support.h"

namespace consac::testing {

/// What the program does, called with these arguments in a folder.
inline Outcome RunProgram(const std::string& folder, const std::vector<std::string>& arguments) {
  return Program(folder, arguments).Wait();
}

/// One line on stderr that holds `part`, and this exit code.
inline void ExpectRefusal(const Outcome& outcome, int code, const std::string& part) {
  EXPECT_EQ(outcome.code, code) << outcome.error;
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  EXPECT_NE(outcome.error.find(part), std::string::npos) << outcome.error;
}

/// The program in a folder of its own.
class ProgramTest : public ::testing::Test {
 protected:
  ProgramTest() : scratch_("program") {}
  const std::string& folder() const { return scratch_.path(); }
  /// Trains a small run and returns its model's path.
  std::string SmallRun(const std::string& name) {
    const Outcome outcome =
        RunProgram(folder(), {"train", "road-v0", "--steps", "300", "--name", name, "--no-table", "--no-progress"});
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return folder() + "/runs/" + name + "/model.consac";
  }

 private:
  ScratchFolder scratch_;
};

}  // namespace consac::testing
