#pragma once
// A network of action values with what belongs to it: the parameters that learn, a packed copy that acts, and the
// target network, which follows. Private to learn.

#include <string>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/communicator.h"
#include "consac/env/vector_env.h"
#include "consac/nn/network.h"
#include "consac/policy/policy.h"

namespace consac::learn {

/// One network and its target. What acts changes with Publish alone.
class QNetwork {
 public:
  /// Fresh parameters from the first rank's `seed`, the target's alike. For at most `max_rows` rows at once.
  QNetwork(nn::Network network, std::uint64_t seed, std::int64_t max_rows, const Communicator& ranks = {});

  /// Takes over the parameters of a model of the same network, for the target too; they act at once.
  Status StartFrom(const PolicyData& model);

  /// The network.
  const nn::Network& network() const { return network_; }
  /// [parameters]: what an optimiser steps.
  std::span<float> parameters() { return parameters_; }
  /// The parameters of now are those that act; they are packed when they first do.
  void Publish() { packed_ = false; }
  /// target = tau parameters + (1 - tau) target.
  void UpdateTarget(double tau);

  /// Q by what acts, features [rows, F] -> [rows, choices]; until the next call.
  const float* Values(const float* features, std::int64_t rows);
  /// Q by the target network.
  const float* TargetValues(const float* features, std::int64_t rows);

  /// A complete acting model of this moment but for its heads; `training_json` is told to people.
  PolicyData Snapshot(const BehaviourSpec& behaviour, const ObservationNormaliser& normaliser,
                      std::string training_json) const;
  /// Both networks' parameters; what was loaded acts.
  void Visit(Archive& archive);

 private:
  nn::Network network_;
  std::vector<float> parameters_, target_;  // [parameters]
  nn::Evaluator evaluator_, target_evaluator_;
  bool packed_ = false, target_packed_ = false;  // packed into the evaluators
};

}  // namespace consac::learn
