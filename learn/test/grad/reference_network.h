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
  for (const nn::PlacedBlock& block : network.blocks()) {
    const auto at = static_cast<std::size_t>(block.parameter_offset);
    const std::vector<double>& x = values[block.inputs[0]];
    if (block.op == "duelling") {
      std::vector<double> q = values[block.inputs[1]];
      double mean = 0.0;
      for (const double a : q) mean += a / static_cast<double>(q.size());
      for (double& a : q) a += x[0] - mean;
      values[block.output] = q;
      continue;
    }
    const auto in = static_cast<std::size_t>(block.in_size);
    const auto out = static_cast<std::size_t>(block.out_size);
    std::vector<double> y(out);
    for (std::size_t o = 0; o < out; ++o) {
      double sum = parameters[at + in * out + o];
      for (std::size_t i = 0; i < in; ++i) sum += parameters[at + o * in + i] * x[i];
      y[o] = nn::ReferenceActivation(block.activation, sum);
    }
    values[block.output] = y;
  }
  std::vector<std::vector<double>> outputs;
  for (const std::string& name : network.spec().outputs) outputs.push_back(values[name]);
  return outputs;
}

}  // namespace consac::learn
