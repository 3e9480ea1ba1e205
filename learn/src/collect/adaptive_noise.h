#pragma once
// Exploration by noise in an actor's parameters that is as strong as moves its actions by a given distance. Source:
// Plappert et al. 2018, arXiv:1706.01905; Stable Baselines 2.10.2, ddpg/noise.py. Private to learn.

#include <algorithm>
#include <optional>

#include "collect/learned_network.h"
#include "collect/parameter_noise.h"

namespace consac::learn {

/// Whether there is any, and how it is adapted.
struct AdaptiveNoiseOptions {
  bool on = false;             ///< otherwise the actor acts itself
  double deviation = 0.1;      ///< of the parameters at the start
  double distance = 0.1;       ///< that actions shall be moved, which go from -1 to 1
  double factor = 1.01;        ///< by which the deviation grows or shrinks
  std::int64_t interval = 50;  ///< gradient steps between two of those
};

/// What of an actor acts: a disturbed copy, or without noise the actor itself.
class AdaptiveNoise {
 public:
  /// Of `actor`, which must stay; what it measures is the mean over `ranks`.
  AdaptiveNoise(const AdaptiveNoiseOptions& options, LearnedNetwork* actor, std::uint64_t seed,
                const Communicator& ranks)
      : options_(options), actor_(*actor), ranks_(ranks) {
    if (options.on) noise_.emplace(actor_.network(), seed, actor_.run_rows(), options.deviation);
    Perturb();
  }

  /// New noise for what acts.
  void Perturb() {
    if (noise_) noise_->Perturb(actor_.parameters());
  }
  /// What acts for features [rows, F]: [rows, actions]; until it or the actor runs again.
  const float* Output(const float* features, std::int64_t rows) {
    return noise_ ? noise_->Values(features, rows) : actor_.Output(features, rows);
  }
  /// After gradient step `update` on `features` [rows, F]: every so many of them noise of the present strength is tried
  /// on those, and strengthened or weakened.
  void AfterStep(std::int64_t update, const float* features, std::int64_t rows) {
    if (!noise_ || update % options_.interval != 0) return;
    const double own = noise_->Distance(actor_.parameters(), features, actor_.Output(features, rows), rows);
    distance_ = ranks_.Sum(own) / static_cast<double>(ranks_.size);
    noise_->AdaptTo(distance_, options_.distance, options_.factor);
  }

  /// Whether there is any.
  bool on() const { return noise_.has_value(); }
  /// How far it moved actions when it was adapted last.
  double distance() const { return distance_; }
  /// Standard deviation of the noise, where there is any.
  double deviation() const { return noise_->deviation(); }

  /// The noise under its name, and the distance.
  void Visit(Archive& archive) {
    if (noise_) archive("parameter_noise", *noise_);
    archive("distance", distance_);
  }

 private:
  const AdaptiveNoiseOptions options_;
  LearnedNetwork& actor_;
  const Communicator ranks_;
  std::optional<ParameterNoise> noise_;
  double distance_ = 0.0;
};

}  // namespace consac::learn
