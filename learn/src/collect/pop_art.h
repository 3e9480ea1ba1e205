#pragma once
// Values learned by their running moments, however large they are: what a critic says is a normal number, and its last
// layer moves with the moments so that the values it means stay ("preserving outputs precisely"). Source: van Hasselt
// et al. 2016, arXiv:1602.07714; Stable Baselines 2.10.2, ddpg/ddpg.py and common/mpi_running_mean_std.py. Private to
// learn.

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <vector>

#include "collect/learned_network.h"

namespace consac::learn {

/// Moments of the targets that all outputs of a critics' network learn. Mean 0 and deviation 1 until there are some.
class PopArt {
 public:
  /// Of `critic`, which must stay, whose outputs the layers with `block` in their names say, "/head"; targets are
  /// those of all of `ranks`.
  PopArt(LearnedNetwork* critic, std::string_view block, const Communicator& ranks = {})
      : critic_(*critic), ranks_(ranks) {
    for (const nn::Parameter& tensor : critic_.network().parameters()) {
      const std::string_view name = tensor.name;
      const std::size_t at = name.find(block);
      if (at == std::string_view::npos) continue;
      layer_.push_back({static_cast<std::size_t>(tensor.offset), static_cast<std::size_t>(tensor.count),
                        name.substr(at + block.size()) == "/b"});
    }
    CONSAC_ASSERT(!layer_.empty());
  }

  /// The value that a critic's output means.
  double Value(float output) const { return mean() + deviation() * static_cast<double>(output); }
  /// The output that means a value.
  double Output(float value) const { return (static_cast<double>(value) - mean()) / deviation(); }
  /// Of the targets.
  double mean() const { return of_[kSum] / of_[kCount]; }
  /// Of the targets, 0.1 at least.
  double deviation() const { return std::sqrt(std::max(of_[kSquares] / of_[kCount] - mean() * mean(), kEpsilon)); }

  /// Takes `targets` in, and moves the critic's output and its target's so that both mean what they meant.
  void Take(std::span<const float> targets) {
    const double old_mean = mean(), old_deviation = deviation();
    double more[kNumbers] = {0.0, 0.0, static_cast<double>(targets.size())};
    for (const float target : targets) {
      more[kSum] += static_cast<double>(target);
      more[kSquares] += static_cast<double>(target) * static_cast<double>(target);
    }
    ranks_.Sum(more);
    for (std::size_t i = 0; i < kNumbers; ++i) of_[i] += more[i];
    MoveOutput(old_deviation / deviation(), (old_mean - mean()) / deviation());
  }

  /// The sums.
  void Visit(Archive& archive) {
    archive("sums", std::span<double>(of_));
    archive.Check("sums", of_[kSquares] >= 0.0 && of_[kCount] >= kEpsilon && std::isfinite(of_[kSum]) &&
                              std::isfinite(of_[kSquares]) && std::isfinite(of_[kCount]));
  }

 private:
  enum Number : std::size_t { kSum, kSquares, kCount, kNumbers };
  static constexpr double kEpsilon = 0.01;  // the least variance, and how many targets it began with
  /// A tensor of a layer that says an output.
  struct Tensor {
    std::size_t offset, count;
    bool bias;
  };

  /// Those layers say `scale` times what they said and `shift` more.
  void MoveOutput(double scale, double shift) {
    critic_.Alter([&](std::span<float> parameters) {
      for (const Tensor& tensor : layer_) {
        for (float& number : parameters.subspan(tensor.offset, tensor.count))
          number = static_cast<float>(scale * static_cast<double>(number) + (tensor.bias ? shift : 0.0));
      }
    });
  }

  LearnedNetwork& critic_;
  std::vector<Tensor> layer_;
  Communicator ranks_;
  double of_[kNumbers] = {0.0, kEpsilon, kEpsilon};
};

}  // namespace consac::learn
