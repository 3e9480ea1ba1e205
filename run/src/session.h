#pragma once
// One run in this process, or one session with an engine, from its first observation to its saved model. Private to
// run.

#include <atomic>
#include <memory>

#include "training_loop.h"

namespace consac::run {

/// Trains, or acts where the engine asks for it. `length` says whether config.steps was given or is the engine's to
/// say. A world that fails is an error that says how many steps are missing; what was learned is saved.
Result<RunSummary> RunSession(RunConfig config, Length length, std::unique_ptr<WorldLink> link,
                              const std::atomic<bool>& stop);

}  // namespace consac::run
