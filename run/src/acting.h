#pragma once
// A session in which an engine asks for a model to act and nothing is learned. Private to run.

#include <atomic>

#include "consac/run/training.h"
#include "link.h"

namespace consac::run {

/// Loads the model that the engine's setup names (`config.name` overrules it) and acts with it, taking the most likely
/// action, until the engine closes or `stop` is set. A model that is not there or does not fit is an error.
Result<RunSummary> ActForEngine(const RunConfig& config, WorldLink& link, const std::atomic<bool>& stop);

}  // namespace consac::run
