#pragma once
// A network in plain float64 loops: what gradients are checked against.

#include <map>
#include <string>
#include <vector>

#include "consac/nn/network.h"
#include "core/test/nn/reference_activation.h"

namespace consac::learn {

/// The outputs of one row, one vector per network output.
inline std::vector<std::vector<double>> ReferenceForward(const nn::Network& network,
                                                         const std::vector<double>& parameters,
                                                         const std::vector<std::vector<double>>& inputs) {
  std::map<std::string, std::vector<double>> values;
  for (std::size_t i = 0; i < inputs.size(); ++i) values[network.spec().inputs[i].name] = inputs[i];
  std::size_t at = 0;
  for (const nn::Block& block : network.spec().blocks) {
    const std::vector<double>& x = values[block.input];
    const auto in = static_cast<std::size_t>(block.in_size);
    const auto out = static_cast<std::size_t>(block.out_size);
    std::vector<double> y(out);
    for (std::size_t o = 0; o < out; ++o) {
      double sum = parameters[at + in * out + o];
      for (std::size_t i = 0; i < in; ++i) sum += parameters[at + o * in + i] * x[i];
      y[o] = nn::ReferenceActivation(block.activation, sum);
    }
    values[block.output] = y;
    at += in * out + out;
  }
  std::vector<std::vector<double>> outputs;
  for (const std::string& name : network.spec().outputs) outputs.push_back(values[name]);
  return outputs;
}

}  // namespace consac::learn
