#include "grad/workspace.h"

#include <algorithm>

namespace consac::learn {
namespace {

constexpr std::int64_t RoundUpToLine(std::int64_t count) {
  return (count + 15) / 16 * 16;
}

}  // namespace

GradientSchedule::GradientSchedule(const nn::Network& network) : forward(network) {
  PlanBackward();
  std::int64_t size = 0;
  for (std::size_t s = 0; s < backward.size(); ++s) {
    order.push_back(s);
    backward_at.push_back(size);
    const BackwardStep& back = backward[s];
    const bool wanted = std::any_of(back.inputs.begin(), back.inputs.end(), [](auto& input) { return input.wanted; });
    if (!wanted || back.op->pack == nullptr) {
      backward_at.back() = -1;
      continue;
    }
    size += RoundUpToLine(back.op->packed_size(forward.plan().steps[s].block));
  }
  packed = nn::AlignedFloats(size);
}

void GradientSchedule::PlanBackward() {
  const nn::Plan& plan = forward.plan();
  backward.resize(plan.steps.size());
  std::vector<bool> reached(plan.values.size()), learns(plan.values.size());
  for (const std::size_t output : plan.outputs) reached[output] = true;
  for (const nn::PlanStep& step : plan.steps) {
    learns[step.output] = step.block.parameter_count > 0;
    for (const std::size_t input : step.inputs) learns[step.output] = learns[step.output] || learns[input];
  }
  std::vector<std::int64_t> used;  // parameter offsets
  for (std::size_t s = plan.steps.size(); s-- > 0;) {
    const nn::PlanStep& step = plan.steps[s];
    BackwardStep& back = backward[s];
    back.op = FindGradientOp(step.block.op);
    CONSAC_ASSERT(back.op != nullptr);
    back.reached = reached[step.output];
    back.inputs.resize(step.inputs.size());
    if (!back.reached) continue;
    if (step.block.parameter_count > 0) {
      back.first_use = std::find(used.begin(), used.end(), step.block.parameter_offset) == used.end();
      used.push_back(step.block.parameter_offset);
    }
    for (std::size_t i = 0; i < step.inputs.size(); ++i) {
      const std::size_t value = step.inputs[i];
      back.inputs[i].wanted = learns[value];
      if (!learns[value]) continue;
      back.inputs[i].store = reached[value] ? nn::Store::kAdd : nn::Store::kOverwrite;
      reached[value] = true;
    }
  }
}

void GradientSchedule::Pack(std::span<const float> parameters) {
  forward.Load(parameters);
  for (std::size_t s = 0; s < backward.size(); ++s) {
    const nn::PlacedBlock& block = forward.plan().steps[s].block;
    if (backward_at[s] < 0) continue;
    backward[s].op->pack(block, parameters.data() + block.parameter_offset, packed.data() + backward_at[s]);
  }
}

BlockWorkspace::BlockWorkspace(const GradientSchedule& schedule)
    : schedule_(schedule),
      activations_(schedule.forward.plan(), {.rows = kBlockRows, .group_rows = kBlockRows, .learning = true}) {
  const nn::Plan& plan = schedule.forward.plan();
  std::size_t most_inputs = 0;
  for (std::size_t v = 0; v < plan.values.size(); ++v) {
    const bool given = plan.values[v].producer == nn::kNone;
    gradients_.push_back(given ? nn::AlignedFloats() : nn::AlignedFloats(activations_.Value(v).stride * kBlockRows));
  }
  for (const nn::PlanStep& step : plan.steps) most_inputs = std::max(most_inputs, step.inputs.size());
  step_inputs_.resize(most_inputs);
  for (std::size_t i = 0; i < plan.input_count; ++i) inputs_.push_back(activations_.Value(i).data);
  for (const std::size_t output : plan.outputs) {
    outputs_.push_back(activations_.Value(output).data);
    output_gradients_.push_back(gradients_[output].data());
  }
}

nn::Rows BlockWorkspace::Gradient(std::size_t value) {
  return {gradients_[value].data(), activations_.Value(value).stride};
}

void BlockWorkspace::Run(LossBlock block, BlockLoss& loss, float* gradient, nn::Store store) {
  block.inputs = inputs_;
  block.outputs = outputs_;
  block.output_gradients = output_gradients_;
  loss.Gather(block);
  activations_.Run(schedule_.forward, schedule_.order,
                   {.inputs = {inputs_.data(), inputs_.size()}, .rows = block.rows});
  loss.Loss(block);
  Backward(block.rows, gradient, store);
}

void BlockWorkspace::Backward(std::int64_t rows, float* gradient, nn::Store store) {
  const nn::Plan& plan = schedule_.forward.plan();
  for (std::size_t s = plan.steps.size(); s-- > 0;) {
    const nn::PlanStep& step = plan.steps[s];
    const BackwardStep& back = schedule_.backward[s];
    if (!back.reached) continue;
    for (std::size_t i = 0; i < step.inputs.size(); ++i) {
      const BackwardInput& input = back.inputs[i];
      step_inputs_[i] = {activations_.Value(step.inputs[i]), input.wanted ? Gradient(step.inputs[i]) : nn::Rows(),
                         input.store};
    }
    GradientCall call;
    call.block = &step.block;
    call.packed = schedule_.backward_at[s] < 0 ? nullptr : schedule_.packed.data() + schedule_.backward_at[s];
    call.rows = rows;
    call.inputs = {step_inputs_.data(), step.inputs.size()};
    call.y = activations_.Value(step.output);
    call.saved = activations_.Saved(s);
    call.dy = Gradient(step.output);
    call.dparameters = gradient + step.block.parameter_offset;
    call.store = back.first_use ? store : nn::Store::kAdd;
    back.op->backward(call);
  }
}

}  // namespace consac::learn
