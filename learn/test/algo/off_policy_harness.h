#pragma once
// Drives learners that learn from a replay: cut rounds, agents that come and go, what cannot be learned.

#include <cmath>
#include <cstring>
#include <string>

#include "learn/test/algo/training_harness.h"

namespace consac::learn {

/// Saved between two gradient steps of one round, it goes on to the same bits as one that was not; each round of
/// `setting` must have more than one.
inline void ExpectARoundCutInTwoGoesOnToTheSameBits(const Setting& setting,
                                                    const Space& space = *Space::Box(-1, 1, {2})) {
  IdentityEnv env(space, 4), other_env(space, 4);
  const std::unique_ptr<Learner> learner = Make(env, setting), other = Make(other_env, setting);
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  for (int i = 0; i < 31; ++i) Step(env, *learner, first.batch().slots);
  Batch batch = learner->Stage(first.batch().slots);
  learner->Act(batch);
  env.Step({&batch, 1});
  learner->Record(batch);
  ASSERT_TRUE(learner->Learn({1})) << "gradient steps are left";
  StateWriter writer;
  writer("learner", *learner);
  writer("env", env);
  StateReader reader(writer.fields());
  reader("learner", *other);
  reader("env", other_env);
  ASSERT_TRUE(reader.status().ok()) << reader.status().message();
  while (learner->Learn({})) {
  }
  while (other->Learn({1})) {
  }
  for (int i = 0; i < 60; ++i) {
    Step(env, *learner, first.batch().slots);
    Step(other_env, *other, first.batch().slots, 1);
  }
  EXPECT_EQ(HashState(*learner), HashState(*other));
}

/// Any of the slots may step, and all begin again now and then.
inline void ExpectSlotsMayStepAloneAndBeginAgain(const Setting& setting, const Space& space = *Space::Box(-1, 1, {2})) {
  IdentityEnv env(space, 4);
  const std::unique_ptr<Learner> learner = Make(env, setting);
  const Layout& seen = env.spec().behaviours[0].observation_layout;
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  Rng rng(1, 1);
  for (int i = 0; i < 400; ++i) {
    std::vector<std::int32_t> slots;
    for (std::int32_t slot = 0; slot < 4; ++slot) {
      if (rng.Below(2) == 0) slots.push_back(slot);
    }
    if (slots.empty()) continue;
    Batch batch = learner->Stage(slots);
    learner->Act(batch);
    for (std::size_t r = 0; r < slots.size(); ++r) {
      batch.rewards[r] = 1.0f;
      batch.terminated[r] = i % 7 == 0 ? 1 : 0;
      batch.truncated[r] = 0;
      SampleRow(seen, rng, batch.next_observations + r * seen.row_bytes);
    }
    std::memcpy(batch.final_observations, batch.next_observations, slots.size() * seen.row_bytes);
    learner->Record(batch);
    while (learner->Learn({})) {
    }
    if (i % 50 == 0) learner->Begin(first.batch());
  }
  EXPECT_GT(learner->updates(), 20);
  for (const float parameter : learner->Snapshot().parameters) ASSERT_TRUE(std::isfinite(parameter));
}

/// Why no learner can be made; "" where one can.
inline std::string ErrorOf(const char* algorithm, const BehaviourSpec& behaviour, const Settings& settings,
                           std::int64_t max_bytes) {
  LearnerOptions options;
  options.behaviour = behaviour;
  options.max_bytes = max_bytes;
  HyperparameterSet values((*FindAlgorithm(algorithm))->hyperparameters);
  for (const auto& [name, text] : settings) EXPECT_TRUE(values.Set(name, text).ok()) << name;
  const auto learner = (*FindAlgorithm(algorithm))->create(options, values);
  return learner.ok() ? "" : learner.status().message();
}

}  // namespace consac::learn
