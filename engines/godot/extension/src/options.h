#pragma once
// What a script may say about a driver, read from its Dictionary; every key and its default are those of the options in
// consac/host/driver.h.

#include "binding/values.h"
#include "consac/host/driver.h"

namespace consac::godot {

/// {host, port, training_length, model_name, seed, protocol, terminator, token, quiet_s, deadline_s, ...}
Result<host::ServeOptions> ReadServe(const Dictionary& table);
/// {algorithm, hyperparameters = {...}, total_steps, seed, while_learning = "wait" or "go_on", start_from = [a path for
/// each behaviour]}; the paths are not read.
Result<host::TrainOptions> ReadTrain(const Dictionary& table, std::vector<std::string>* start_from);
/// {models = [a path for each behaviour], mode = "deterministic" or "sample", seed}
Result<host::ActOptions> ReadAct(const Dictionary& table);

/// The algorithms that Train knows: [{name, description}].
Array DescribeAlgorithms();
/// The hyperparameters of one of them: [{name, type, default, low, high, choices, meaning}].
Result<Array> DescribeHyperparameters(const std::string& algorithm);

}  // namespace consac::godot
