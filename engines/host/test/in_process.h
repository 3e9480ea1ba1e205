#pragma once
// What a training inside an engine is compared with: the same training in a process of its own.

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "consac/env/buffer.h"
#include "consac/host/driver.h"
#include "consac/learn/algo/learner.h"
#include "worlds/registry.h"

namespace consac::testing {

/// A learner that has trained as `options` say, in step with `copies` of a built-in world that began at `seed`.
inline std::unique_ptr<learn::Learner> InProcess(const std::string& world, std::int32_t copies,
                                                 const host::TrainOptions& options, std::uint64_t seed) {
  const std::unique_ptr<VectorEnv> env = (*worlds::FindWorld(world))->create(copies);
  const learn::Algorithm& algorithm = **learn::FindAlgorithm(options.algorithm);
  learn::HyperparameterSet values(algorithm.hyperparameters);
  for (const auto& [name, text] : options.hyperparameters) EXPECT_TRUE(values.Set(name, text).ok()) << name;
  learn::LearnerOptions made;
  made.behaviour = env->spec().behaviours[0];
  made.seed = learn::BehaviourSeed(options.seed, 0);
  made.total_steps = options.total_steps;
  if (env->prices_goals()) {
    made.price_goals = [&env](const std::byte* observations, std::int64_t rows, float* rewards) {
      env->PriceGoals(0, observations, rows, rewards);
      return Status::Ok();
    };
  }
  std::unique_ptr<learn::Learner> learner = *algorithm.create(made, values);
  BatchBuffer rows(made.behaviour);
  Batch& batch = rows.batch();
  env->Reset(seed, {&batch, 1});
  learner->Begin(batch);
  while (learner->steps() < options.total_steps) {
    rows.Advance();
    learner->Act(batch);
    env->Step({&batch, 1});
    learner->Record(batch);
    while (learner->Learn({})) {
    }
  }
  return learner;
}

}  // namespace consac::testing
