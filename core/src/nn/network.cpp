#include "consac/nn/network.h"

#include <algorithm>
#include <limits>
#include <map>

#include "consac/base/text.h"
#include "consac/nn/ops.h"

namespace consac::nn {
namespace {

constexpr std::int64_t kMostParameters = std::int64_t{1} << 31;
// Each output has a list of the blocks that it needs (Plan).
constexpr std::size_t kMostOutputs = 64;
constexpr std::size_t kMostSuggested = 100;
constexpr std::int64_t kWidestValue = 1 << 20;

/// Shapes of the values known so far, by name.
using KnownShapes = std::map<std::string, Shape, std::less<>>;

Status NetworkFault(std::string message) {
  return Status(StatusCode::kInvalidArgument, "network: " + std::move(message));
}

std::string KnownValues(std::string_view name, const KnownShapes& known) {
  if (known.size() > kMostSuggested) return "";
  std::vector<std::string_view> names;
  for (const auto& [value, shape] : known) names.push_back(value);
  return Suggestion(name, names);
}

Status CheckInputs(NetworkSpec& spec, KnownShapes& known) {
  if (spec.inputs.empty()) return NetworkFault("it has no input");
  for (Port& input : spec.inputs) {
    if (input.name.empty()) return NetworkFault("an input has no name");
    if (input.size < 1 || input.size > kWidestValue)
      return NetworkFault("input " + Quote(input.name) + " has " + std::to_string(input.size) + " features");
    if (input.shape.empty()) input.shape = {input.size};
    if (SizeOf(input.shape) != input.size) {
      return NetworkFault("input " + Quote(input.name) + " has " + std::to_string(input.size) +
                          " features, but its shape has " + std::to_string(SizeOf(input.shape)));
    }
    if (!known.emplace(input.name, input.shape).second)
      return NetworkFault("two inputs are named " + Quote(input.name));
  }
  return {};
}

Status CheckName(const Block& block, const Op* op) {
  if (op == nullptr)
    return NetworkFault("block " + Quote(block.name) + ": unknown op " + Quote(block.op) +
                        Suggestion(block.op, OpNames()));
  if (block.name.empty()) return NetworkFault("the block that writes " + Quote(block.output) + " has no name");
  if (static_cast<std::size_t>(block.activation) > static_cast<std::size_t>(Activation::kSoftplus))
    return NetworkFault("block " + Quote(block.name) + ": no such activation");
  if (!op->activates && block.activation != Activation::kLinear)
    return NetworkFault("block " + Quote(block.name) + ": " + block.op + " has no activation; put a layer behind it");
  if (block.output.empty()) return NetworkFault("block " + Quote(block.name) + ": its output has no name");
  return {};
}

/// The sizes that a block claims, or 0, against those that it has.
Status CheckSizes(const Block& block, std::int64_t in_size, std::int64_t out_size) {
  const std::string who = "block " + Quote(block.name) + ": ";
  if (block.in_size != 0 && block.in_size != in_size) {
    std::string from;
    for (const std::string& input : block.inputs) from += (from.empty() ? "" : ", ") + Quote(input);
    return NetworkFault(who + "takes " + std::to_string(block.in_size) + " features, but " + from + " has " +
                        std::to_string(in_size));
  }
  if (block.out_size != 0 && block.out_size != out_size) {
    return NetworkFault(who + "puts out " + std::to_string(out_size) + " features, not " +
                        std::to_string(block.out_size));
  }
  return {};
}

/// One block against the values known so far: fills in its sizes and shapes, and adds its output to them.
Status PlaceBlock(PlacedBlock& block, const Op* op, KnownShapes& known) {
  CONSAC_RETURN_IF_ERROR(CheckName(block, op));
  const std::string who = "block " + Quote(block.name) + ": ";
  std::int64_t in_size = 0;
  for (const std::string& name : block.inputs) {
    const auto input = known.find(name);
    if (input == known.end()) {
      return NetworkFault(who + "reads " + Quote(name) + ", which nothing before it writes" + KnownValues(name, known));
    }
    block.in_shapes.push_back(input->second);
    in_size += SizeOf(input->second);
  }
  // What it reads is checked before what it makes of it.
  if (block.in_size != 0) CONSAC_RETURN_IF_ERROR(CheckSizes(block, in_size, block.out_size));
  Result<Shape> shape = op->infer(block, block.in_shapes);
  if (!shape.ok()) return shape.status();
  block.out_shape = std::move(*shape);
  const std::int64_t out_size = SizeOf(block.out_shape);
  CONSAC_RETURN_IF_ERROR(CheckSizes(block, in_size, out_size));
  if (out_size < 1 || out_size > kWidestValue)
    return NetworkFault(who + "puts out " + std::to_string(out_size) + " features; at most " +
                        std::to_string(kWidestValue) + " are possible");
  block.in_size = in_size;
  block.out_size = out_size;
  if (op->prepare != nullptr) block.details = op->prepare(block);
  if (!known.emplace(block.output, block.out_shape).second)
    return NetworkFault(who + "writes " + Quote(block.output) + " a second time");
  return {};
}

/// Whether two blocks' tensors have the same shapes one by one.
bool SameTensors(std::span<const Parameter> a, std::span<const Parameter> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Parameter& x, const Parameter& y) { return x.shape == y.shape && x.count == y.count; });
}

Status CheckOutputs(const NetworkSpec& spec, const KnownShapes& known) {
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

std::int64_t SizeOf(const Shape& shape) {
  std::int64_t size = 1;
  for (const std::int64_t dimension : shape) {
    if (dimension < 1 || dimension > std::numeric_limits<std::int64_t>::max() / size) return 0;
    size *= dimension;
  }
  return size;
}

Result<Network> Network::Create(NetworkSpec spec) {
  Network network;
  KnownShapes known;
  std::map<std::string_view, std::size_t> places;  // of blocks, by name
  if (Status status = CheckInputs(spec, known); !status.ok()) return status;
  network.blocks_.reserve(spec.blocks.size());
  for (Block& described : spec.blocks) {
    PlacedBlock& block = network.blocks_.emplace_back(PlacedBlock{described, {}, {}, 0, 0, nullptr});
    const Op* op = FindOp(block.op);
    if (Status status = PlaceBlock(block, op, known); !status.ok()) return status;
    described.in_size = block.in_size;
    described.out_size = block.out_size;
    if (!places.emplace(described.name, network.blocks_.size() - 1).second)
      return NetworkFault("two blocks are named " + Quote(block.name));
    if (Status status = network.PlaceParameters(block, *op, places); !status.ok()) return status;
  }
  if (Status status = network.CheckParameterNames(); !status.ok()) return status;
  if (Status status = CheckOutputs(spec, known); !status.ok()) return status;
  for (const std::string& output : spec.outputs) network.output_sizes_.push_back(SizeOf(known.find(output)->second));
  network.spec_ = std::move(spec);
  return network;
}

Status Network::PlaceParameters(PlacedBlock& block, const Op& op, const Places& places) {
  std::vector<Parameter> own;
  if (op.parameters != nullptr) own = op.parameters(block);
  for (const Parameter& parameter : own) block.parameter_count += parameter.count;
  block.parameter_offset = parameter_count_;
  if (!block.shares.empty()) {
    const auto shared = places.find(block.shares);
    const PlacedBlock* owner = shared == places.end() ? nullptr : &blocks_[shared->second];
    if (owner == nullptr || owner == &block || !owner->shares.empty() || owner->op != block.op ||
        !SameTensors(op.parameters == nullptr ? own : op.parameters(*owner), own)) {
      return NetworkFault("block " + Quote(block.name) + ": it cannot share the parameters of " + Quote(block.shares) +
                          "; name a block before it with the same op and sizes and parameters of its own");
    }
    block.parameter_offset = owner->parameter_offset;
    return {};
  }
  for (Parameter& parameter : own) {
    parameter.offset = parameter_count_;
    parameter_count_ += parameter.count;
    parameters_.push_back(std::move(parameter));
  }
  if (parameter_count_ > kMostParameters) {
    return NetworkFault("block " + Quote(block.name) + " brings it to " + std::to_string(parameter_count_) +
                        " parameters; at most " + std::to_string(kMostParameters) + " are possible");
  }
  return {};
}

Status Network::CheckParameterNames() const {
  std::vector<std::string_view> names;
  for (const Parameter& parameter : parameters_) names.push_back(parameter.name);
  std::sort(names.begin(), names.end());
  const auto twice = std::adjacent_find(names.begin(), names.end());
  return twice == names.end() ? Status() : NetworkFault("two parameters are named " + Quote(*twice));
}

std::int64_t Network::output_size(std::size_t index) const {
  CONSAC_ASSERT(index < output_sizes_.size());
  return index < output_sizes_.size() ? output_sizes_[index] : 0;
}

void Network::Initialise(Rng& rng, std::span<float> parameters) const {
  CONSAC_ASSERT(static_cast<std::int64_t>(parameters.size()) == parameter_count_);
  for (const PlacedBlock& block : blocks_) {
    const Op* op = FindOp(block.op);
    if (op->initialise != nullptr && block.shares.empty())
      op->initialise(block, rng, parameters.data() + block.parameter_offset);
  }
}

}  // namespace consac::nn
