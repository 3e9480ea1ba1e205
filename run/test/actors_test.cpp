// Models at work for the agents of a world.
#include "consac/run/actors.h"

#include <gtest/gtest.h>

#include "tests/remembering.h"

namespace consac::run {
namespace {

// The action is the sum of what was seen since the agent's episode began; agents' episodes end at different steps.
TEST(Actors, AModelRemembersForEachAgentUntilItsEpisodeEnds) {
  testing::OnesEnv world(4);
  std::vector<PolicyData> models;
  models.push_back(testing::RememberingPolicy());
  Result<Actors> actors = Actors::Of(std::move(models), world.spec());
  ASSERT_TRUE(actors.ok()) << actors.status().message();
  Rng rng(1, 1);
  for (int play = 0; play < 2; ++play) {
    world.Reset(0, actors->batches());
    actors->Begin();
    for (int step = 0; step < 50; ++step) {
      actors->Act(0, {}, ActionMode::kDeterministic, rng);
      for (std::size_t slot = 0; slot < 4; ++slot) {
        const float action = reinterpret_cast<const float*>(actors->batches()[0].actions)[slot];
        ASSERT_EQ(action, static_cast<float>(world.length(slot) + 1)) << slot << " at " << step;
      }
      world.Step(actors->batches());
    }
  }
}

}  // namespace
}  // namespace consac::run
