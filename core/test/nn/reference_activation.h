#pragma once
// The activations in float64, by their formulas: what kernels and gradients are checked against.

#include <cmath>

#include "consac/nn/network.h"

namespace consac::nn {

/// activation(x) in float64.
inline double ReferenceActivation(Activation activation, double x) {
  switch (activation) {
    case Activation::kLinear:
      return x;
    case Activation::kTanh:
      return std::tanh(x);
    case Activation::kRelu:
      return x > 0 ? x : 0.0;
    case Activation::kSigmoid:
      return 1.0 / (1.0 + std::exp(-x));
    case Activation::kElu:
      return x > 0 ? x : std::expm1(x);
    case Activation::kLeakyRelu:
      return x > 0 ? x : 0.01 * x;
    case Activation::kSilu:
      return x / (1.0 + std::exp(-x));
    case Activation::kSoftplus:
      return std::log1p(std::exp(x));
  }
  return 0.0;
}

}  // namespace consac::nn
