#pragma once
// What the tests of training share: a quiet little run on the road.

#include <atomic>
#include <string>

#include "consac/run/training.h"
#include "tests/support.h"

namespace consac::run {

/// Never set.
inline const std::atomic<bool> kNeverStop{false};

/// A run of 4096 steps in 64 updates that writes nothing to the console. Observations are normalised, so that
/// statistics are part of what must survive.
inline RunConfig SmallRun(const std::string& directory, const std::string& name = "small") {
  RunConfig config;
  config.world = "road-v0";
  config.directory = directory;
  config.name = name;
  config.steps = 4096;
  config.seed = 3;
  config.envs = 2;
  config.checkpoint_every_s = 0;
  config.table = config.progress = config.tensorboard = false;
  config.quiet = true;
  config.hyperparameters = {
      {"n_steps", "32"}, {"net_arch", "[{pi: [16], vf: [16]}]"}, {"norm_obs", "true"}, {"norm_reward", "true"}};
  return config;
}

/// One that learns from a replay, which is full long before its end and is drawn from by priority.
inline RunConfig SmallReplayRun(const std::string& directory, const std::string& name = "small") {
  RunConfig config = SmallRun(directory, name);
  config.algorithm = "dqn";
  config.hyperparameters = {{"buffer_size", "500"},           {"learning_starts", "100"}, {"net_arch", "[16]"},
                            {"prioritized_replay", "true"},   {"n_steps", "3"},           {"param_noise", "true"},
                            {"target_update_interval", "64"}, {"norm_obs", "true"},       {"norm_reward", "true"}};
  return config;
}

/// One of continuous actions, whose coefficients, noise and three optimisers are part of what must survive.
inline RunConfig SmallSacRun(const std::string& directory, const std::string& name = "small") {
  RunConfig config = SmallRun(directory, name);
  config.world = "pendulum-v1";
  config.steps = 1200;
  config.algorithm = "sac";
  config.hyperparameters = {{"buffer_size", "300"}, {"learning_starts", "100"}, {"net_arch", "[16]"},
                            {"batch_size", "32"},   {"n_steps", "3"},           {"action_noise", "ornstein_uhlenbeck"},
                            {"norm_obs", "true"},   {"norm_reward", "true"}};
  return config;
}

/// One whose actor explores by noise in its parameters and by noise that remembers.
inline RunConfig SmallDdpgRun(const std::string& directory, const std::string& name = "small") {
  RunConfig config = SmallSacRun(directory, name);
  config.algorithm = "ddpg";
  for (const char* set : {"param_noise", "normalize_returns", "enable_popart"})
    config.hyperparameters.emplace_back(set, "true");
  config.hyperparameters.emplace_back("param_noise_adaption_interval", "7");
  return config;
}

/// One that learns from goals that were not meant; its replay is full long before its end.
inline RunConfig SmallHindsightRun(const std::string& directory, const std::string& name = "small") {
  RunConfig config = SmallRun(directory, name);
  config.world = "bit-flipping-v0";
  config.algorithm = "dqn";
  config.hyperparameters = {{"buffer_size", "500"},
                            {"learning_starts", "100"},
                            {"net_arch", "[16]"},
                            {"replay_buffer_class", "HerReplayBuffer"},
                            {"norm_reward", "true"},
                            {"goal_selection_strategy", "episode"},
                            {"target_update_interval", "64"}};
  return config;
}

}  // namespace consac::run
