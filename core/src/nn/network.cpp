#include "consac/nn/network.h"

#include <algorithm>
#include <map>
#include <set>

#include "consac/base/text.h"
#include "consac/nn/ops.h"
#include "consac/nn/plan.h"

namespace consac::nn {
namespace {

constexpr std::int64_t kMostParameters = std::int64_t{1} << 31;
// Each output has a list of the blocks that it needs (Evaluator).
constexpr std::size_t kMostOutputs = 64;
constexpr std::size_t kMostSuggested = 100;

/// Widths of the values known so far, by name.
using KnownPorts = std::map<std::string, std::int64_t, std::less<>>;

Status NetworkFault(std::string message) {
  return Status(StatusCode::kInvalidArgument, "network: " + std::move(message));
}

std::string KnownValues(std::string_view name, const KnownPorts& known) {
  if (known.size() > kMostSuggested) return "";
  std::vector<std::string_view> names;
  for (const auto& [value, size] : known) names.push_back(value);
  return Suggestion(name, names);
}

Status CheckInputs(const NetworkSpec& spec, KnownPorts& known) {
  if (spec.inputs.empty()) return NetworkFault("it has no input");
  for (const Port& input : spec.inputs) {
    if (input.name.empty()) return NetworkFault("an input has no name");
    if (input.size < 1)
      return NetworkFault("input " + Quote(input.name) + " has " + std::to_string(input.size) + " features");
    if (!known.emplace(input.name, input.size).second) return NetworkFault("two inputs are named " + Quote(input.name));
  }
  return {};
}

/// One block against the values known so far; adds its own.
Status CheckBlock(const Block& block, KnownPorts& known) {
  const std::string who = "block " + Quote(block.name) + ": ";
  const Op* op = FindOp(block.op);
  if (op == nullptr) return NetworkFault(who + "unknown op " + Quote(block.op) + Suggestion(block.op, OpNames()));
  if (block.name.empty()) return NetworkFault("the block that writes " + Quote(block.output) + " has no name");
  if (static_cast<std::size_t>(block.activation) > static_cast<std::size_t>(Activation::kSoftplus)) {
    return NetworkFault(who + "no such activation");
  }
  const auto input = known.find(block.input);
  if (input == known.end()) {
    return NetworkFault(who + "reads " + Quote(block.input) + ", which nothing before it writes" +
                        KnownValues(block.input, known));
  }
  if (input->second != block.in_size) {
    return NetworkFault(who + "takes " + std::to_string(block.in_size) + " features, but " + Quote(block.input) +
                        " has " + std::to_string(input->second));
  }
  if (block.output.empty()) return NetworkFault(who + "its output has no name");
  CONSAC_RETURN_IF_ERROR(op->validate(block));
  if (!known.emplace(block.output, block.out_size).second)
    return NetworkFault(who + "writes " + Quote(block.output) + " a second time");
  return {};
}

Status CheckOutputs(const NetworkSpec& spec, const KnownPorts& known) {
  if (spec.outputs.empty()) return NetworkFault("it has no output");
  if (spec.outputs.size() > kMostOutputs) {
    return NetworkFault("it has " + std::to_string(spec.outputs.size()) + " outputs; at most " +
                        std::to_string(kMostOutputs) + " are possible");
  }
  for (std::size_t i = 0; i < spec.outputs.size(); ++i) {
    const std::string& name = spec.outputs[i];
    if (!known.contains(name)) return NetworkFault("no block writes output " + Quote(name) + KnownValues(name, known));
    if (std::any_of(spec.inputs.begin(), spec.inputs.end(), [&](const Port& input) { return input.name == name; }))
      return NetworkFault("output " + Quote(name) + " is an input; nothing computes it");
    if (std::find(spec.outputs.begin(), spec.outputs.begin() + static_cast<std::ptrdiff_t>(i), name) !=
        spec.outputs.begin() + static_cast<std::ptrdiff_t>(i)) {
      return NetworkFault("output " + Quote(name) + " is named twice");
    }
  }
  return {};
}

}  // namespace

Result<Network> Network::Create(NetworkSpec spec) {
  Network network;
  KnownPorts known;
  std::set<std::string> named;  // parameters
  if (Status status = CheckInputs(spec, known); !status.ok()) return status;
  for (const Block& block : spec.blocks) {
    if (Status status = CheckBlock(block, known); !status.ok()) return status;
    for (Parameter& parameter : FindOp(block.op)->parameters(block)) {
      if (!named.insert(parameter.name).second) return NetworkFault("two blocks are named " + Quote(block.name));
      parameter.offset = network.parameter_count_;
      network.parameter_count_ += parameter.count;
      network.parameters_.push_back(std::move(parameter));
    }
    if (network.parameter_count_ > kMostParameters) {
      return NetworkFault("block " + Quote(block.name) + " brings it to " + std::to_string(network.parameter_count_) +
                          " parameters; at most " + std::to_string(kMostParameters) + " are possible");
    }
  }
  if (Status status = CheckOutputs(spec, known); !status.ok()) return status;
  network.spec_ = std::move(spec);
  return network;
}

std::int64_t Network::output_size(std::size_t index) const {
  CONSAC_ASSERT(index < spec_.outputs.size());
  for (const Block& block : spec_.blocks) {
    if (index < spec_.outputs.size() && block.output == spec_.outputs[index]) return block.out_size;
  }
  return 0;
}

void Network::Initialise(Rng& rng, std::span<float> parameters) const {
  CONSAC_ASSERT(static_cast<std::int64_t>(parameters.size()) == parameter_count_);
  for (const PlanStep& step : Plan(*this).steps) {
    step.op->initialise(step.block, rng, parameters.data() + step.parameter_offset);
  }
}

}  // namespace consac::nn
