#pragma once
// How models are judged in a world that is open: by `consac eval`, and in between a training. Private to run.

#include "consac/run/actors.h"
#include "consac/run/training.h"
#include "link.h"

namespace consac::run {

/// The world of `options`, or `world`, opened for so many episodes.
Result<std::unique_ptr<WorldLink>> OpenToJudge(const EvaluateOptions& options, const std::string& world,
                                               const std::atomic<bool>& stop);

/// The returns of `actors` over options.episodes episodes in the world of `link`, which is reset from options.seed; of
/// fewer once `stop` is set. `meanwhile` is called after each step.
Result<std::vector<EvaluateSummary>> Judge(const EvaluateOptions& options, WorldLink& link, Actors& actors,
                                           const std::atomic<bool>& stop, const std::function<void()>& meanwhile);

}  // namespace consac::run
