#pragma once
// What each algorithm's file offers to the table in registry.cpp: its table of hyperparameters, and how to make one.
// Private to learn.

#include <memory>
#include <span>

#include "consac/learn/algo/learner.h"

namespace consac::learn {

/// ppo.cpp, with Stable Baselines 2.10.2's definitions or Stable Baselines3's.
std::span<const Hyperparameter> PpoTable(Generation generation);
Result<std::unique_ptr<Learner>> CreatePpo(Generation generation, const LearnerOptions& options,
                                           const HyperparameterSet& values);

/// a2c.cpp.
std::span<const Hyperparameter> A2cTable();
Result<std::unique_ptr<Learner>> CreateA2c(const LearnerOptions& options, const HyperparameterSet& values);

/// dqn.cpp.
std::span<const Hyperparameter> DqnTable();
Result<std::unique_ptr<Learner>> CreateDqn(const LearnerOptions& options, const HyperparameterSet& values);

/// sac.cpp.
std::span<const Hyperparameter> SacTable();
Result<std::unique_ptr<Learner>> CreateSac(const LearnerOptions& options, const HyperparameterSet& values);

/// td3.cpp.
std::span<const Hyperparameter> Td3Table();
Result<std::unique_ptr<Learner>> CreateTd3(const LearnerOptions& options, const HyperparameterSet& values);

/// ddpg.cpp.
std::span<const Hyperparameter> DdpgTable();
Result<std::unique_ptr<Learner>> CreateDdpg(const LearnerOptions& options, const HyperparameterSet& values);

}  // namespace consac::learn
