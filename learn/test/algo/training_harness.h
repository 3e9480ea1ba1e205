#pragma once
// Drives learners in tests: makes one for an identity task, trains it, judges its model, saves and restores it; and
// looks into an algorithm's table.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "consac/env/buffer.h"
#include "consac/learn/algo/learner.h"
#include "learn/test/algo/identity_env.h"

namespace consac::learn {

using Settings = std::vector<std::pair<const char*, const char*>>;

struct Setting {
  std::string algorithm = "ppo2";
  Settings values;
  std::int64_t steps = 20000;
  std::uint64_t seed = 1;
  Executor executor = {};
  Communicator ranks = {};
};

inline LearnerOptions OptionsOf(const VectorEnv& env, const Setting& setting) {
  LearnerOptions options;
  options.behaviour = env.spec().behaviours[0];
  options.seed = setting.seed;
  options.total_steps = setting.steps;
  options.executor = setting.executor;
  options.ranks = setting.ranks;
  if (env.prices_goals()) {
    options.price_goals = [&env](const std::byte* observations, std::int64_t rows, float* rewards) {
      env.PriceGoals(0, observations, rows, rewards);
      return Status::Ok();
    };
  }
  return options;
}

inline std::unique_ptr<Learner> Make(const LearnerOptions& options, const Setting& setting) {
  const Algorithm* algorithm = *FindAlgorithm(setting.algorithm);
  HyperparameterSet values(algorithm->hyperparameters);
  for (const auto& [name, text] : setting.values) EXPECT_TRUE(values.Set(name, text).ok()) << name;
  auto learner = algorithm->create(options, values);
  EXPECT_TRUE(learner.ok()) << learner.status().message();
  return learner.ok() ? std::move(*learner) : nullptr;
}

inline std::unique_ptr<Learner> Make(const VectorEnv& env, const Setting& setting) {
  return Make(OptionsOf(env, setting), setting);
}

inline void Begin(VectorEnv& env, Learner& learner, BatchBuffer& first) {
  env.Reset(1, {&first.batch(), 1});
  learner.Begin(first.batch());
}

/// One vector step; returns the rewards' sum.
inline double Step(VectorEnv& env, Learner& learner, std::span<const std::int32_t> slots,
                   std::int64_t budget = INT64_MAX) {
  Batch batch = learner.Stage(slots);
  learner.Act(batch);
  env.Step({&batch, 1});
  double sum = 0;
  for (std::int64_t i = 0; i < batch.rows(); ++i) sum += batch.rewards[i];
  learner.Record(batch);
  while (budget > 0 && learner.Learn({budget})) {
  }
  return sum;
}

/// Trains, then returns the mean reward of a step of the model taken deterministically.
inline double TrainedReward(const Space& space, std::int32_t copies, const Setting& setting) {
  IdentityEnv env(space, copies);
  const std::unique_ptr<Learner> learner = Make(env, setting);
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  while (learner->steps() < setting.steps) Step(env, *learner, first.batch().slots);
  Result<Policy> policy = Policy::Create(learner->Snapshot(), copies);
  EXPECT_TRUE(policy.ok()) << policy.status().message();
  BatchBuffer buffer(env.spec().behaviours[0]);
  Rng rng(3, 3);
  env.Reset(9, {&buffer.batch(), 1});
  double sum = 0;
  constexpr int kSteps = 500;
  for (int i = 0; i < kSteps; ++i) {
    buffer.Advance();
    Batch& batch = buffer.batch();
    policy->Act(batch.observations, nullptr, batch.rows(), ActionMode::kDeterministic, rng, batch.actions);
    env.Step({&batch, 1});
    for (std::int64_t r = 0; r < batch.rows(); ++r) sum += batch.rewards[r];
  }
  return sum / (kSteps * copies);
}

/// Blocks on real threads, started for each job.
inline Executor Threads(int& count) {
  return {[](void* user, std::int64_t blocks, void (*task)(void*, std::int64_t), void* context) {
            const int threads = *static_cast<int*>(user);
            std::vector<std::thread> workers;
            for (int t = 0; t < threads; ++t) {
              workers.emplace_back([=] {
                for (std::int64_t b = t; b < blocks; b += threads) task(context, b);
              });
            }
            for (std::thread& worker : workers) worker.join();
          },
          &count};
}

inline std::uint64_t WeightsAfter(const Setting& setting, const Space& space = *Space::Box(-1, 1, {3})) {
  IdentityEnv env(space, 8);
  const std::unique_ptr<Learner> learner = Make(env, setting);
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  while (learner->steps() < setting.steps) Step(env, *learner, first.batch().slots);
  return HashState(*learner);
}

/// Two learners in worlds of their own, of which the second takes over what the first has saved.
struct LearnerTwins {
  std::unique_ptr<VectorEnv> env, other_env;
  std::unique_ptr<Learner> learner, other;
  BatchBuffer first;

  LearnerTwins(std::unique_ptr<VectorEnv> world, std::unique_ptr<VectorEnv> other_world, const Setting& setting)
      : env(std::move(world)),
        other_env(std::move(other_world)),
        learner(Make(*env, setting)),
        other(Make(*other_env, setting)),
        first(env->spec().behaviours[0]) {
    Begin(*env, *learner, first);
  }
  /// The first goes on alone.
  void Step(int steps, std::int64_t budget = INT64_MAX) {
    for (int i = 0; i < steps; ++i) learn::Step(*env, *learner, first.batch().slots, budget);
  }
  void Restore() {
    StateWriter writer;
    writer("learner", *learner);
    writer("env", *env);
    ASSERT_TRUE(writer.status().ok()) << writer.status().message();
    StateReader reader(writer.fields());
    reader("learner", *other);
    reader("env", *other_env);
    ASSERT_TRUE(reader.status().ok()) << reader.status().message();
  }
  /// Both go on, the second by one gradient step at a time, and end in the same state.
  void ExpectTheSameBitsAfter(int steps) {
    for (int i = 0; i < steps; ++i) {
      Step(1);
      learn::Step(*other_env, *other, first.batch().slots, 1);
    }
    EXPECT_EQ(HashState(*learner), HashState(*other));
    EXPECT_GE(learner->updates(), 3);
  }
};

/// The algorithm's defaults: Stable Baselines3's at first, 2.10.2's where they are asked for, each under its names, and
/// logs in the same generation's style.
inline void ExpectDefaults(const char* algorithm, const Settings& sb3, const Settings& sb2) {
  const Algorithm& row = **FindAlgorithm(algorithm);
  HyperparameterSet values(row.hyperparameters);
  for (const auto& [name, text] : sb3) EXPECT_EQ(values.Text(name), text) << name;
  EXPECT_EQ(LogStyleOf(row, values), LogStyle::kStableBaselines3);
  values.UseDefaultsOf(Generation::kStableBaselines2);
  for (const auto& [name, text] : sb2) EXPECT_EQ(values.Text(name), text) << name;
  EXPECT_EQ(LogStyleOf(row, values), LogStyle::kStableBaselines2);
}

}  // namespace consac::learn
