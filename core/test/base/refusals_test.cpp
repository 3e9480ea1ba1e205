#include "consac/base/refusals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace consac {
namespace {

using ::testing::ElementsAre;

/// Lines that are said by a clock of the test's own.
class RefusalsTest : public ::testing::Test {
 protected:
  RefusalsTest() {
    Hooks hooks;
    hooks.now = [](void* user) { return static_cast<RefusalsTest*>(user)->now_; };
    hooks.user = this;
    SetHooks(hooks);
  }
  ~RefusalsTest() override { SetHooks({}); }

  double now_ = 100.0;
  std::vector<std::string> said_;
  Refusals refusals_{[this](std::string_view line) { said_.emplace_back(line); }, 5.0, 2};
};

TEST_F(RefusalsTest, TheFirstAreSaidInFullAndThenOneAtATime) {
  for (const char* line : {"a", "b", "c", "d"}) refusals_.Say(line);
  EXPECT_THAT(said_, ElementsAre("a", "b"));
  now_ += 5.0;
  refusals_.Look();
  EXPECT_THAT(said_, ElementsAre("a", "b", "d (and 1 more like it)"));
}

TEST_F(RefusalsTest, AfterAQuietTimeTheNextIsSaidAtOnce) {
  for (const char* line : {"a", "b", "c"}) refusals_.Say(line);
  now_ += 3600.0;  // nobody looked
  refusals_.Say("new");
  EXPECT_THAT(said_, ElementsAre("a", "b", "c", "new"));
}

}  // namespace
}  // namespace consac
