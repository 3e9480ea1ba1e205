#pragma once
// What a run that goes on is configured by: its own config.yaml, and what the caller may change. Private to run.

#include "consac/run/config.h"

namespace consac::run {

/// The configuration that directory/name was started with. Whatever `asked` gives that is not the default overrules it,
/// but for what the result depends on: another world, algorithm, seed, number of copies or hyperparameter is an error
/// that names it. An engine may have moved to another address.
Result<RunConfig> ResumedConfig(const RunConfig& asked);

}  // namespace consac::run
