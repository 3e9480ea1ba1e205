#pragma once
// What a training sets of its world's parameters: fixed, drawn anew for every episode, or moved along with the steps.
// Used by runs (`environment_parameters`) and by trainings inside an engine.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/rng.h"
#include "consac/env/parameters.h"

namespace consac {

/// How one parameter is chosen.
struct ParameterLaw {
  /// In which way.
  enum class Kind : std::uint8_t { kFixed, kUniform, kLogUniform, kRamp } kind = Kind::kFixed;
  std::string name;              ///< of the parameter
  double low = 0.0, high = 0.0;  ///< between which it is drawn; where a ramp begins and ends; fixed: both are it
  double steps = 0.0;            ///< of a ramp
};

/// "gravity=uniform 5 15, mass=2, length=ramp 1 2 1e5" taken apart; the error names what cannot be used.
Result<std::vector<ParameterLaw>> ParseParameterLaws(std::string_view text);
/// Ok where every law is of one of `parameters`, which can be all that it may choose; the error names the nearest.
Status CheckParameterLaws(std::span<const ParameterLaw> laws, std::span<const ParameterSpec> parameters);

/// Chooses by laws, from random numbers of its own. A value; copying it forks these.
class ParameterChooser {
 public:
  /// `laws` have been checked against `parameters`; `index` tells apart many with one seed.
  ParameterChooser(std::vector<ParameterLaw> laws, std::span<const ParameterSpec> parameters, std::uint64_t seed,
                   std::uint32_t index);
  /// A value for each of the parameters, `steps` agent steps into the training; NaN of those without a law. Valid until
  /// the next call.
  std::span<const double> Choose(std::int64_t steps);
  /// Whether all values are the same each time.
  bool fixed() const { return fixed_; }
  /// Its random numbers.
  void Visit(Archive& archive) { archive("rng", rng_); }

 private:
  double ChooseBy(const ParameterLaw& law, std::int64_t steps);

  std::vector<ParameterLaw> laws_;
  std::vector<std::size_t> places_;  // [laws]
  std::vector<double> values_;       // [parameters]
  Rng rng_;
  bool fixed_ = true;
};

}  // namespace consac
