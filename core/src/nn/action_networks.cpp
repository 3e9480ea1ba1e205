#include "consac/nn/action_networks.h"

#include <algorithm>
#include <cmath>

namespace consac::nn {
namespace {

/// Appends hidden layers `first` to `end` - 1 of a tower; returns the last value.
Port AddHiddenLayers(NetworkSpec& spec, const TowerOptions& tower, const std::string& prefix, Port from,
                     std::size_t first, std::size_t end) {
  for (std::size_t i = first; i < end; ++i) {
    Block dense;
    dense.name = dense.output = prefix + "/" + std::to_string(i);
    dense.inputs = {from.name};
    dense.in_size = from.size;
    dense.out_size = tower.layers[i];
    dense.activation = tower.layer_norm ? Activation::kLinear : tower.activation;
    dense.init = tower.init;
    from = {dense.output, dense.out_size, {}};
    spec.blocks.push_back(std::move(dense));
    if (!tower.layer_norm) continue;
    Block norm{.op = "layer_norm", .inputs = {from.name}, .output = from.name + "/norm", .name = from.name + "/norm"};
    norm.activation = tower.activation;
    norm.attributes.SetNumber("epsilon", tower.layer_norm_epsilon);
    from.name = norm.output;
    spec.blocks.push_back(std::move(norm));
  }
  return from;
}

/// The output layer. Glorot's bound depends on how many outputs there are: a gain makes it that of `groups` layers.
void AddOutput(NetworkSpec& spec, const TowerOptions& tower, const Port& output, std::int64_t groups, const Port& from,
               Activation activation) {
  Block head;
  head.name = output.name + "/head";
  head.inputs = {from.name};
  head.output = output.name;
  head.in_size = from.size;
  head.out_size = output.size;
  head.activation = activation;
  head.init = tower.init;
  const auto in = static_cast<double>(from.size), out = static_cast<double>(output.size);
  const double bound = std::sqrt(6.0 / (in + out));
  if (tower.output_bound > 0.0) {
    head.init = Init::kXavierUniform;
    head.gain = static_cast<float>(tower.output_bound / bound);
  } else if (tower.init == Init::kXavierUniform) {
    head.gain = static_cast<float>(std::sqrt(6.0 / (in + out / static_cast<double>(groups))) / bound);
  }
  spec.blocks.push_back(std::move(head));
  spec.outputs.push_back(output.name);
}

Port AddTogether(NetworkSpec& spec, const std::string& name, const Port& a, const Port& b) {
  spec.blocks.push_back({.op = "concatenation", .inputs = {a.name, b.name}, .output = name, .name = name});
  return {name, a.size + b.size, {}};
}

}  // namespace

Result<NetworkSpec> Actor(const Layout& observation, const ActorOptions& options, const FeatureOptions& features) {
  NetworkSpec spec;
  const Result<Port> entry = AddFeatures(observation, features, &spec);
  if (!entry.ok()) return entry.status();
  const Port hidden = AddHiddenLayers(spec, options.tower, "pi", *entry, 0, options.tower.layers.size());
  AddOutput(spec, options.tower, {"pi", options.outputs, {}}, options.groups, hidden, options.output);
  if (options.with_features) AppendFeatures(spec, hidden.name);
  return spec;
}

Result<NetworkSpec> Critics(const Layout& observation, const CriticsOptions& options, const FeatureOptions& features) {
  NetworkSpec spec;
  const Result<Port> entry = AddFeatures(observation, features, &spec);
  if (!entry.ok()) return entry.status();
  const Port action{"action", options.action_size, {}};
  spec.inputs.push_back(action);
  const std::size_t layers = options.tower.layers.size();
  const std::size_t alone = std::min(static_cast<std::size_t>(options.action_layer), layers);
  const Port both = alone == 0 ? AddTogether(spec, "observation_action", *entry, action) : Port();
  for (std::int64_t k = 0; k < options.count; ++k) {
    const std::string name = "qf" + std::to_string(k);
    Port from = both;
    if (alone > 0)
      from = AddTogether(spec, name + "/action", AddHiddenLayers(spec, options.tower, name, *entry, 0, alone), action);
    from = AddHiddenLayers(spec, options.tower, name, from, alone, layers);
    AddOutput(spec, options.tower, {name, 1, {}}, 1, from, Activation::kLinear);
  }
  if (options.state_value) {
    const Port from = AddHiddenLayers(spec, options.tower, "vf", *entry, 0, layers);
    AddOutput(spec, options.tower, {"vf", 1, {}}, 1, from, Activation::kLinear);
  }
  return spec;
}

void AppendFeatures(NetworkSpec& spec, const std::string& features) {
  Block& head = spec.blocks.back();
  const std::string name = head.output;
  head.output = name + "/mean";
  spec.blocks.push_back({.op = "concatenation", .inputs = {name + "/mean", features}, .output = name, .name = name});
}

NetworkSpec FirstOutputOf(const NetworkSpec& spec) {
  NetworkSpec part{spec.inputs, {}, {spec.outputs[0]}};
  std::vector<std::string> needed = part.outputs;
  for (std::size_t i = spec.blocks.size(); i-- > 0;) {
    const Block& block = spec.blocks[i];
    if (std::find(needed.begin(), needed.end(), block.output) == needed.end()) continue;
    needed.insert(needed.end(), block.inputs.begin(), block.inputs.end());
    part.blocks.insert(part.blocks.begin(), block);
  }
  return part;
}

}  // namespace consac::nn
