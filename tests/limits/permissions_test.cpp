// What may not be looked into is no less there for it.
#include <filesystem>

#include "tests/limits/limited.h"

namespace consac::testing {
namespace {

namespace fs = std::filesystem;

// Who is root may look anywhere: the limit makes the program a user of its own (Impose).
const std::vector<Limit> kAsAnotherUser = {{RLIMIT_NPROC, 4096}};

TEST(Permissions, ARunThatMayNotBeLookedIntoIsNotSaidToBeNone) {
  const ScratchFolder scratch("permissions");
  Program trained(scratch.path(),
                  {"train", "cartpole-v1", "--steps", "64", "--set", "n_steps=64", "--dir", "runs", "--name", "x"});
  ASSERT_EQ(trained.Wait().code, 0);
  const std::string run = scratch.path() + "/runs/x";
  for (const fs::perms seen : {fs::perms::none, fs::perms::owner_read | fs::perms::others_read}) {
    fs::permissions(run, seen);
    for (const std::vector<std::string>& verb :
         {std::vector<std::string>{"train", "--resume", "--dir", "runs", "--name", "x"},
          {"eval", "x", "--dir", "runs"},
          {"inspect", "x", "--dir", "runs"},
          {"train", "cartpole-v1", "--dir", "runs", "--name", "x"}}) {
      const Outcome refused = Program(scratch.path(), verb, {.limits = kAsAnotherUser}).Wait();
      EXPECT_EQ(refused.code, 6) << verb[0] << verb[1];
      EXPECT_NE(refused.error.find("cannot look into folder 'runs/x': Permission denied"), std::string::npos)
          << refused.error;
    }
    fs::permissions(run, fs::perms::owner_all);
  }
}

}  // namespace
}  // namespace consac::testing
