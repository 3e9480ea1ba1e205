#pragma once
// Drives learners that learn from a replay: reports, what cannot be learned.

#include <string>
#include <vector>

#include "learn/test/algo/training_harness.h"

namespace consac::learn {

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
