#pragma once
// Drives learners that learn from a replay: cut rounds, reports, what cannot be learned.

#include <string>
#include <vector>

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

/// Reports after four episodes of a hundred steps, in the table under `keys`, in their order. Two agents.
inline void ExpectReportsEveryFourthEpisode(const Setting& setting, const std::vector<std::string>& keys) {
  IdentityEnv env(*Space::Box(-1, 1, {2}), 2);
  const std::unique_ptr<Learner> learner = Make(env, setting);
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  while (learner->reports() == 0) Step(env, *learner, first.batch().slots);
  EXPECT_EQ(learner->steps(), 400) << "four episodes of a hundred steps";
  std::vector<std::string> found;
  for (const Metric& metric : learner->metrics()) found.emplace_back(metric.table_key);
  EXPECT_EQ(found, keys);
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
