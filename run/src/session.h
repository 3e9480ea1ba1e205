#pragma once
// One run in this process, or one session with an engine, from its first observation to its saved model. Private to
// run.

#include <atomic>
#include <memory>

#include "training_loop.h"

namespace consac::run {

/// A run's one world, which cannot be connected to again.
inline std::vector<WorldSource> Only(std::unique_ptr<WorldLink> link) {
  std::vector<WorldSource> worlds;
  worlds.push_back({std::move(link), nullptr});
  return worlds;
}

/// Trains on all of `worlds` together, or acts where the first, an engine, asks for it. `length` says whether
/// config.steps was given or is the engine's to say. A world that fails is an error that says how many steps are
/// missing; what was learned is saved.
Result<RunSummary> RunSession(RunConfig config, Length length, std::vector<WorldSource> worlds,
                              const std::atomic<bool>& stop);

}  // namespace consac::run
