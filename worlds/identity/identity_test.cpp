// The identity worlds: what is observed is what pays, for each kind of space.
#include "worlds/identity/identity.h"

#include <gtest/gtest.h>

namespace consac::worlds {
namespace {

template <class W>
class IdentityWorlds : public ::testing::Test {};
using IdentityKinds = ::testing::Types<IdentityDiscrete, IdentityBox, IdentityMultiDiscrete, IdentityMultiBinary>;
TYPED_TEST_SUITE(IdentityWorlds, IdentityKinds);

TYPED_TEST(IdentityWorlds, DoingWhatIsObservedPaysAndNothingElseDoes) {
  TypeParam world;
  Rng rng(1, 1);
  typename TypeParam::Observation seen[4] = {};
  world.Reset(rng, seen);
  for (int i = 0; i < 100; ++i) {
    typename TypeParam::Action action[4];
    std::copy_n(seen, 4, action);
    const bool wrong = i % 2 == 1;
    if (wrong) action[0] = static_cast<typename TypeParam::Action>(action[0] > 0 ? action[0] - 1 : action[0] + 1);
    const StepResult result = world.Step(action, rng, seen);
    EXPECT_EQ(result.reward, wrong ? 0.0f : 1.0f);
    EXPECT_FALSE(result.terminated);
  }
}

}  // namespace
}  // namespace consac::worlds
