#pragma once
// Values learned by their running moments, however large they are: what a critic says is a normal number, and its last
// layer moves with the moments so that the values it means stay ("preserving outputs precisely"). Source: van Hasselt
// et al. 2016, arXiv:1602.07714; Stable Baselines 2.10.2, ddpg/ddpg.py and common/mpi_running_mean_std.py. Private to
// learn.

#include <algorithm>
#include <cmath>
#include <span>

#include "collect/learned_network.h"

namespace consac::learn {

/// Moments of the targets of one critic. Mean 0 and deviation 1 until there are some.
class PopArt {
 public:
  /// Over all of `ranks`.
  explicit PopArt(const Communicator& ranks = {}) : ranks_(ranks) {}

  /// The value that a critic's output means.
  double Value(float output) const { return mean() + deviation() * static_cast<double>(output); }
  /// The output that means a value.
  double Output(float value) const { return (static_cast<double>(value) - mean()) / deviation(); }
  /// Of the targets.
  double mean() const { return of_[kSum] / of_[kCount]; }
  /// Of the targets, 0.1 at least.
  double deviation() const { return std::sqrt(std::max(of_[kSquares] / of_[kCount] - mean() * mean(), kEpsilon)); }

  /// Takes `targets` in, and moves the output of `critic` whose layer is `block`, "qf0/head", and the target's.
  void Take(std::span<const float> targets, std::string_view block, LearnedNetwork* critic) {
    const double old_mean = mean(), old_deviation = deviation();
    double more[kNumbers] = {0.0, 0.0, static_cast<double>(targets.size())};
    for (const float target : targets) {
      more[kSum] += static_cast<double>(target);
      more[kSquares] += static_cast<double>(target) * static_cast<double>(target);
    }
    ranks_.Sum(more);
    for (std::size_t i = 0; i < kNumbers; ++i) of_[i] += more[i];
    critic->MoveOutput(block, old_deviation / deviation(), (old_mean - mean()) / deviation());
  }

  /// The sums.
  void Visit(Archive& archive) { archive("sums", std::span<double>(of_)); }

 private:
  enum Number : std::size_t { kSum, kSquares, kCount, kNumbers };
  static constexpr double kEpsilon = 0.01;  // the least variance, and how many targets it began with

  Communicator ranks_;
  double of_[kNumbers] = {0.0, kEpsilon, kEpsilon};
};

}  // namespace consac::learn
