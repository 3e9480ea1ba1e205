#include "grad/workspace.h"

#include <algorithm>

namespace consac::learn {
namespace {

constexpr std::int64_t RoundUpToLine(std::int64_t count) {
  return (count + 15) / 16 * 16;
}

/// Rows of one block: as many whole sequences as fit into kBlockRows, at least one; all rows where they are coupled.
std::int64_t BlockRows(const nn::Plan& plan, const BackpropagationOptions& options) {
  for (const nn::PlanStep& step : plan.steps) {
    if (step.op->needs != nullptr && step.op->needs(step.block, options.max_rows).couples_rows) return options.max_rows;
  }
  return std::max(kBlockRows / options.steps, std::int64_t{1}) * options.steps;
}

}  // namespace

GradientSchedule::GradientSchedule(const nn::Network& network, const BackpropagationOptions& what)
    : options(what),
      own(what.packed == nullptr ? std::make_shared<nn::PackedNetwork>(network) : nullptr),
      forward(own == nullptr ? what.packed : own),
      block_rows(BlockRows(forward->plan(), what)) {
  if (options.parameter_count < 0) options.parameter_count = network.parameter_count() - options.first_parameter;
  for (std::size_t s = 0; s < forward->plan().steps.size(); ++s) order.push_back(s);
  PlanBackward();
  PlanRectified();
  PlanMemory();
}

bool GradientSchedule::Learns(const nn::PlacedBlock& block) const {
  return block.parameter_count > 0 && block.parameter_offset >= options.first_parameter &&
         block.parameter_offset + block.parameter_count <= options.first_parameter + options.parameter_count;
}

bool GradientSchedule::WantsInput(std::size_t input) const {
  return options.input_gradients && input >= static_cast<std::size_t>(options.first_input);
}

void GradientSchedule::PlanBackward() {
  const nn::Plan& plan = forward->plan();
  backward.resize(plan.steps.size());
  std::vector<bool> reached(plan.values.size()), wanted(plan.values.size());
  for (const std::size_t output : plan.outputs) reached[output] = true;
  for (std::size_t i = 0; i < plan.input_count; ++i) wanted[i] = WantsInput(i);
  for (std::size_t s = 0; s < plan.steps.size(); ++s) {
    const nn::PlanStep& step = plan.steps[s];
    backward[s].learns = Learns(step.block);
    bool learns = backward[s].learns;
    for (const std::size_t input : step.inputs) learns = learns || wanted[input];
    wanted[step.output] = learns;
  }
  std::vector<std::int64_t> used;  // parameter offsets
  for (std::size_t s = plan.steps.size(); s-- > 0;) {
    const nn::PlanStep& step = plan.steps[s];
    BackwardStep& back = backward[s];
    back.op = FindGradientOp(step.block.op);
    CONSAC_ASSERT(back.op != nullptr);
    back.reached = reached[step.output] && wanted[step.output];
    back.inputs.resize(step.inputs.size());
    if (!back.reached) continue;
    if (back.learns) {
      back.first_use = std::find(used.begin(), used.end(), step.block.parameter_offset) == used.end();
      used.push_back(step.block.parameter_offset);
    }
    for (std::size_t i = 0; i < step.inputs.size(); ++i) {
      const std::size_t value = step.inputs[i];
      back.inputs[i].wanted = wanted[value];
      if (!wanted[value]) continue;
      back.inputs[i].store = reached[value] ? nn::Store::kAdd : nn::Store::kOverwrite;
      reached[value] = true;
    }
  }
}

// A dense block's gradient that has come to another's relu goes through it as it is written, where nobody else reads
// what the relu gave.
void GradientSchedule::PlanRectified() {
  const nn::Plan& plan = forward->plan();
  std::vector<int> readers(plan.values.size());
  for (const nn::PlanStep& step : plan.steps) {
    for (const std::size_t input : step.inputs) ++readers[input];
  }
  for (std::size_t s = 0; s < plan.steps.size(); ++s) {
    if (plan.steps[s].block.op != "dense" || !backward[s].reached || !backward[s].inputs[0].wanted) continue;
    const std::size_t value = plan.steps[s].inputs[0], producer = plan.values[value].producer;
    if (producer == nn::kNone || plan.values[value].output != nn::kNone || readers[value] > 1) continue;
    const nn::PlacedBlock& before = plan.steps[producer].block;
    if (before.op != "dense" || before.activation != nn::Activation::kRelu) continue;
    backward[s].inputs[0].rectified = backward[producer].is_dz = true;
  }
}

void GradientSchedule::PlanMemory() {
  std::int64_t size = 0, tangent_size = 0;
  std::vector<bool> moves(forward->plan().values.size());
  for (std::size_t s = 0; s < backward.size(); ++s) {
    const nn::PlanStep& step = forward->plan().steps[s];
    BackwardStep& back = backward[s];
    if (back.op->scratch != nullptr) scratch = std::max(scratch, back.op->scratch(step.block, block_rows));
    back.moves = step.block.parameter_count > 0;
    for (const std::size_t input : step.inputs) back.moves = back.moves || moves[input];
    moves[step.output] = back.moves;
    if (options.tangents && back.op->tangent_size != nullptr) {
      back.tangent_at = tangent_size;
      tangent_size += RoundUpToLine(back.op->tangent_size(step.block));
    }
    const bool wanted = std::any_of(back.inputs.begin(), back.inputs.end(), [](auto& input) { return input.wanted; });
    if (!wanted || back.op->pack == nullptr) continue;
    back.packed_at = size;
    size += RoundUpToLine(back.op->packed_size(step.block));
  }
  packed = nn::AlignedFloats(size);
  tangent = nn::AlignedFloats(tangent_size);
}

void GradientSchedule::Pack(std::span<const float> parameters) {
  if (own != nullptr) own->Load(parameters);
  for (std::size_t s = 0; s < backward.size(); ++s) {
    const BackwardStep& back = backward[s];
    const nn::PlacedBlock& block = forward->plan().steps[s].block;
    if (back.packed_at >= 0)
      back.op->pack(block, parameters.data() + block.parameter_offset, packed.data() + back.packed_at);
  }
}

void GradientSchedule::PackTangent(std::span<const float> parameters, std::span<const float> direction) {
  for (std::size_t s = 0; s < backward.size(); ++s) {
    const BackwardStep& back = backward[s];
    const nn::PlacedBlock& block = forward->plan().steps[s].block;
    if (back.tangent_at < 0) continue;
    back.op->pack_tangent(block, parameters.data() + block.parameter_offset, direction.data() + block.parameter_offset,
                          tangent.data() + back.tangent_at);
  }
}

BlockWorkspace::BlockWorkspace(const GradientSchedule& schedule)
    : schedule_(schedule),
      activations_(schedule.forward->plan(),
                   {.rows = schedule.block_rows, .group_rows = schedule.block_rows, .learning = true}),
      scratch_(schedule.scratch) {
  const nn::Plan& plan = schedule.forward->plan();
  std::size_t most_inputs = 0;
  for (std::size_t v = 0; v < plan.values.size(); ++v) {
    const bool given = plan.values[v].producer == nn::kNone;
    const std::int64_t room = activations_.Value(v).stride * schedule.block_rows;
    const bool differentiated = !given || schedule.WantsInput(v);
    gradients_.push_back(differentiated ? nn::AlignedFloats(room) : nn::AlignedFloats());
    tangents_.push_back(schedule.options.tangents && !given ? nn::AlignedFloats(room) : nn::AlignedFloats());
  }
  for (const nn::PlanStep& step : plan.steps) most_inputs = std::max(most_inputs, step.inputs.size());
  step_inputs_.resize(most_inputs);
  step_values_.resize(most_inputs);
  step_tangents_.resize(most_inputs);
  for (std::size_t i = 0; i < plan.input_count; ++i) {
    inputs_.push_back(activations_.Value(i).data);
    input_gradients_.push_back(gradients_[i].data());
  }
  for (const std::size_t output : plan.outputs) {
    outputs_.push_back(activations_.Value(output).data);
    output_gradients_.push_back(gradients_[output].data());
    output_tangents_.push_back(tangents_[output].data());
  }
  if (plan.state_size == 0) return;
  state_.resize(static_cast<std::size_t>(schedule.block_rows / schedule.options.steps * plan.state_size));
  begins_.resize(static_cast<std::size_t>(schedule.block_rows));
}

nn::Rows BlockWorkspace::Gradient(std::size_t value) {
  return {gradients_[value].data(), activations_.Value(value).stride};
}

nn::Rows BlockWorkspace::Tangent(std::size_t value) {
  return {tangents_[value].data(), activations_.Value(value).stride};
}

void BlockWorkspace::Run(LossBlock block, BlockLoss& loss, bool along_tangent, float* gradient, nn::Store store) {
  block.inputs = inputs_;
  block.outputs = outputs_;
  block.output_gradients = output_gradients_;
  nn::ForwardRows call{.inputs = {inputs_.data(), inputs_.size()}, .rows = block.rows};
  if (!state_.empty()) {
    call.steps = block.steps = schedule_.options.steps;
    std::fill(state_.begin(), state_.end(), 0.0f);
    std::fill(begins_.begin(), begins_.end(), std::uint8_t{0});
    block.state = state_;
    block.begins = begins_;
    call.recurrent = {.state = state_.data(), .begins = begins_.data()};
  }
  loss.Gather(block);
  activations_.Run(*schedule_.forward, schedule_.order, call);
  if (along_tangent) {
    Along(block.rows);
    block.output_tangents = output_tangents_;
  }
  loss.Loss(block);
  Backward(block, gradient, store);
  if (!schedule_.options.input_gradients) return;
  block.input_gradients = input_gradients_;
  loss.InputGradients(block);
}

void BlockWorkspace::Along(std::int64_t rows) {
  const nn::Plan& plan = schedule_.forward->plan();
  for (std::size_t s = 0; s < plan.steps.size(); ++s) {
    const nn::PlanStep& step = plan.steps[s];
    const BackwardStep& back = schedule_.backward[s];
    if (!back.moves) continue;  // its tangent is zero from the beginning
    for (std::size_t i = 0; i < step.inputs.size(); ++i) {
      step_values_[i] = activations_.Value(step.inputs[i]);
      const std::size_t producer = plan.values[step.inputs[i]].producer;
      const bool moved = producer != nn::kNone && schedule_.backward[producer].moves;
      step_tangents_[i] = moved ? nn::ConstRows(Tangent(step.inputs[i])) : nn::ConstRows();
    }
    TangentCall call;
    call.block = &step.block;
    call.packed = back.tangent_at < 0 ? nullptr : schedule_.tangent.data() + back.tangent_at;
    call.rows = rows;
    call.inputs = {step_values_.data(), step.inputs.size()};
    call.tangents = {step_tangents_.data(), step.inputs.size()};
    call.y = activations_.Value(step.output);
    call.saved = activations_.Saved(s);
    call.dy = Tangent(step.output);
    call.scratch = scratch_.data();
    back.op->tangent(call);
  }
}

void BlockWorkspace::Backward(const LossBlock& block, float* gradient, nn::Store store) {
  const nn::Plan& plan = schedule_.forward->plan();
  for (std::size_t s = plan.steps.size(); s-- > 0;) {
    const nn::PlanStep& step = plan.steps[s];
    const BackwardStep& back = schedule_.backward[s];
    if (!back.reached) continue;
    for (std::size_t i = 0; i < step.inputs.size(); ++i) {
      const BackwardInput& input = back.inputs[i];
      step_inputs_[i] = {activations_.Value(step.inputs[i]), input.wanted ? Gradient(step.inputs[i]) : nn::Rows(),
                         input.store, input.rectified};
    }
    GradientCall call;
    call.block = &step.block;
    call.packed = back.packed_at < 0 ? nullptr : schedule_.packed.data() + back.packed_at;
    call.rows = block.rows;
    call.inputs = {step_inputs_.data(), step.inputs.size()};
    call.y = activations_.Value(step.output);
    call.saved = activations_.Saved(s);
    call.dy = Gradient(step.output);
    call.is_dz = back.is_dz;
    call.dparameters = back.learns ? gradient + step.block.parameter_offset : nullptr;
    call.store = back.first_use ? store : nn::Store::kAdd;
    call.scratch = scratch_.data();
    call.steps = block.steps;
    call.begins = begins_.empty() ? nullptr : begins_.data();
    back.op->backward(call);
    if (BlockObserver* observer = schedule_.options.observer; observer != nullptr) {
      const nn::ConstRows& x = call.inputs[0].x;
      observer->Observe(block, s, x.data, x.stride, call.dy.data, call.dy.stride);
    }
  }
}

}  // namespace consac::learn
