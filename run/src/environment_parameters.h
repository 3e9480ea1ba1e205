#pragma once
// Sets the parameters of one world of a run. Private to run.

#include <cstdint>
#include <span>

#include "consac/env/parameter_laws.h"

namespace consac::run {

class WorldLink;

/// Ok where `link` has what `laws` set; one line where it does not.
Status CheckEnvironmentParameters(std::span<const ParameterLaw> laws, const WorldLink& link);

/// Chooses for the environments of one world.
class EnvironmentParameters {
 public:
  /// `steps`: the run's agent steps so far.
  EnvironmentParameters(ParameterChooser chooser, const std::int64_t* steps)
      : chooser_(std::move(chooser)), steps_(steps) {}
  /// How far the run is now, by which is chosen until the next look. By the thread that counts.
  void LookAtSteps() { seen_ = *steps_; }
  /// For every environment, whose episodes begin next.
  void ChooseForAll(WorldLink& link);
  /// For the episode behind the one that environment `i` has just begun; what is fixed stays.
  void ChooseNext(WorldLink& link, std::int32_t i);
  /// Its random numbers.
  void Visit(Archive& archive) { chooser_.Visit(archive); }

 private:
  ParameterChooser chooser_;
  const std::int64_t* steps_;
  std::int64_t seen_ = 0;
};

}  // namespace consac::run
