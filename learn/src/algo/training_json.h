#pragma once
// What a model says of its training, for people. Private to learn.

#include <string>

#include "consac/learn/algo/hyperparameters.h"

namespace consac::learn {

/// Values by name as a JSON object.
std::string HyperparametersJson(const HyperparameterSet& values);
/// What a model says of its training; `hyperparameters` is JSON.
std::string TrainingJson(const std::string& hyperparameters, std::int64_t steps, std::int64_t updates);

}  // namespace consac::learn
