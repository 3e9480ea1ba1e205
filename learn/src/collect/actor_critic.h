#pragma once
// The network of an actor-critic algorithm with what belongs to it: the arena of parameters that learns (network, then
// the free log standard deviations of Box actions) and the packed copy that acts. Private to learn.

#include <string>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/communicator.h"
#include "consac/env/vector_env.h"
#include "consac/nn/network.h"
#include "consac/policy/policy.h"

namespace consac::learn {

/// A network with outputs "pi" and "vf". What acts changes with Publish alone.
class ActorCritic {
 public:
  /// Fresh parameters from the first rank's `seed`. Acts for all slots of `behaviour` at once at most.
  ActorCritic(nn::Network network, ActionHead head, const BehaviourSpec& behaviour, std::uint64_t seed,
              float log_std_init, const Communicator& ranks);

  /// Takes over the parameters of a model of the same network, those outside it too; they act at once.
  Status StartFrom(const PolicyData& model);

  /// The network.
  const nn::Network& network() const { return network_; }
  /// How actions follow from its first output.
  const ActionHead& action_head() const { return action_head_; }
  /// [network parameters + log_std]: what an optimiser steps.
  std::span<float> parameters() { return parameters_; }
  /// [ActionHead::log_std_size] behind the network's.
  std::span<float> log_std() { return std::span(parameters_).subspan(network_count()); }
  /// The parameters of now are those that act.
  void Publish() { evaluator_.Load(std::span(parameters_).first(network_count())); }

  /// Whether V costs less by ValuesOf, of many steps at once, than by Forward with each step's actions: actor and
  /// critic share no layer, and no image fills the cache by itself.
  bool apart() const { return apart_; }
  /// Rows that go through it at once: all slots', or more where it is apart.
  std::int64_t most_rows() const { return most_rows_; }
  /// Runs actor and critic for `rows` <= most_rows rows of network inputs.
  void Forward(const float* features, std::int64_t rows) { evaluator_.Forward({&features, 1}, rows); }
  /// The actor alone.
  void ForwardActor(const float* features, std::int64_t rows) { evaluator_.ForwardTo(0, {&features, 1}, rows); }
  /// The head's numbers of the last Forward or ForwardActor, [rows, ActionHead::size].
  const float* head() const { return evaluator_.output(0); }
  /// V of the last Forward, [rows].
  const float* values() const { return evaluator_.output(1); }
  /// V alone of `rows` <= most_rows rows, [rows], until the next call: as Forward's, bit for bit.
  const float* ValuesOf(const float* features, std::int64_t rows) {
    evaluator_.ForwardTo(1, {&features, 1}, rows);
    return evaluator_.output(1);
  }

  /// A complete acting model of this moment; `training_json` is told to people.
  PolicyData Snapshot(const BehaviourSpec& behaviour, const ObservationNormaliser& normaliser,
                      std::string training_json) const;
  /// The parameters; what was loaded acts.
  void Visit(Archive& archive);

 private:
  std::size_t network_count() const { return static_cast<std::size_t>(network_.parameter_count()); }

  nn::Network network_;
  ActionHead action_head_;
  bool apart_;
  std::int64_t most_rows_;
  std::vector<float> parameters_;  // network, then log_std
  nn::Evaluator evaluator_;
};

}  // namespace consac::learn
