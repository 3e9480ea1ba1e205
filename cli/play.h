#pragma once
// Walking a model through a built-in world step by step, for `play` and `demo`.

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "consac/server/env_client.h"
#include "worlds/registry.h"

namespace consac::cli {

/// How long and how fast.
struct WalkOptions {
  std::int64_t steps = 100;   ///< at most
  std::int64_t episodes = 1;  ///< at most, of each behaviour
  std::int64_t seed = 1000;   ///< of the world
  double delay_s = 0.0;       ///< between steps
  bool stochastic = false;    ///< draw actions instead of taking the most likely
};

/// Prints the thesis' trajectory, a line per step: observation, action, reward; with several behaviours a line for an
/// agent of each. `models` are the files of what acts (run::FindModels). Ok at the end or when stopped.
Status Walk(const std::vector<std::string>& models, std::string_view world, const WalkOptions& options,
            const std::atomic<bool>& stop);
/// The same with the world of an engine, all of whose agents act.
Status Walk(const std::vector<std::string>& models, EnvClient& engine, const WalkOptions& options,
            const std::atomic<bool>& stop);

}  // namespace consac::cli
