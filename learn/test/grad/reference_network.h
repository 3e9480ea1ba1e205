#pragma once
// A network in plain float64 loops: what gradients are checked against.

#include <map>
#include <string>
#include <vector>

#include "consac/nn/network.h"
#include "core/test/nn/reference_blocks.h"

namespace consac::learn {

/// The outputs of one row, one vector per network output.
inline std::vector<std::vector<double>> ReferenceForward(const nn::Network& network,
                                                         const std::vector<double>& parameters,
                                                         const std::vector<std::vector<double>>& inputs) {
  std::map<std::string, std::vector<double>> values;
  for (std::size_t i = 0; i < inputs.size(); ++i) values[network.spec().inputs[i].name] = inputs[i];
  for (const nn::PlacedBlock& block : network.blocks()) {
    std::vector<std::vector<double>> read;
    for (const std::string& input : block.inputs) read.push_back(values[input]);
    values[block.output] = nn::ReferenceBlock(block, parameters.data() + block.parameter_offset, read);
  }
  std::vector<std::vector<double>> outputs;
  for (const std::string& name : network.spec().outputs) outputs.push_back(values[name]);
  return outputs;
}

}  // namespace consac::learn
