#pragma once
// A penalty on the size of a network's weights: weight / 2 sum w^2 over all but biases and the layer that speaks.
// Private to learn.

#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "consac/nn/network.h"

namespace consac::learn {

/// Which weights are meant is found out once, at creation.
class WeightPenalty {
 public:
  /// `weight` for the weights of `network` but those of layers with `but` in their names, "/head".
  WeightPenalty(const nn::Network& network, std::string_view but, double weight) : weight_(static_cast<float>(weight)) {
    if (weight == 0.0) return;
    for (const nn::Parameter& tensor : network.parameters()) {
      if (tensor.shape.size() < 2 || std::string_view(tensor.name).find(but) != std::string_view::npos) continue;
      tensors_.emplace_back(static_cast<std::size_t>(tensor.offset), static_cast<std::size_t>(tensor.count));
    }
  }

  /// Adds its gradient at `parameters` to `gradient`, both [parameters].
  void AddGradient(std::span<const float> parameters, std::span<float> gradient) const {
    for (const auto& [begin, count] : tensors_) {
      for (std::size_t i = begin; i < begin + count; ++i) gradient[i] += weight_ * parameters[i];
    }
  }

 private:
  float weight_;
  std::vector<std::pair<std::size_t, std::size_t>> tensors_;  // first number and how many; none: nothing is penalised
};

}  // namespace consac::learn
