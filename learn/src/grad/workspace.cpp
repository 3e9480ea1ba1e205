#include "grad/workspace.h"

namespace consac::learn {
namespace {

constexpr std::int64_t RoundUpToLine(std::int64_t count) {
  return (count + 15) / 16 * 16;
}

}  // namespace

GradientSchedule::GradientSchedule(const nn::Network& network) : plan(network) {
  PlanBackward();
  std::int64_t size = 0;
  for (std::size_t s = 0; s < plan.steps.size(); ++s) {
    const nn::PlanStep& step = plan.steps[s];
    forward_at.push_back(size);
    size += RoundUpToLine(step.op->packed_size(step.block));
    backward_at.push_back(size);
    if (backward[s].input_wanted) size += RoundUpToLine(backward[s].op->packed_size(step.block));
  }
  packed = nn::AlignedFloats(size);
}

void GradientSchedule::PlanBackward() {
  backward.resize(plan.steps.size());
  std::vector<bool> reached(plan.values.size());
  for (const std::size_t output : plan.outputs) reached[output] = true;
  for (std::size_t s = plan.steps.size(); s-- > 0;) {
    const nn::PlanStep& step = plan.steps[s];
    BackwardStep& back = backward[s];
    back.op = FindGradientOp(step.block.op);
    CONSAC_ASSERT(back.op != nullptr);
    back.reached = reached[step.output];
    back.input_wanted = back.reached && plan.values[step.input].producer != nn::kNone;
    if (!back.input_wanted) continue;
    back.input_store = reached[step.input] ? nn::Store::kAdd : nn::Store::kOverwrite;
    reached[step.input] = true;
  }
}

void GradientSchedule::Pack(const float* parameters) {
  for (std::size_t s = 0; s < plan.steps.size(); ++s) {
    const nn::PlanStep& step = plan.steps[s];
    const float* from = parameters + step.parameter_offset;
    step.op->pack(step.block, from, packed.data() + forward_at[s]);
    if (backward[s].input_wanted) backward[s].op->pack(step.block, from, packed.data() + backward_at[s]);
  }
}

BlockWorkspace::BlockWorkspace(const GradientSchedule& schedule) : schedule_(schedule) {
  const nn::Plan& plan = schedule.plan;
  for (const nn::PlanValue& value : plan.values) {
    const bool given = value.producer == nn::kNone;
    const bool inner = !given && value.output == nn::kNone;
    const bool keep = !given && nn::NeedsPreActivation(plan.steps[value.producer].block.activation);
    const std::int64_t stride = inner ? nn::InnerStride(value.size) : value.size;
    strides_.push_back(stride);
    values_.emplace_back(stride * kBlockRows);
    gradients_.push_back(given ? nn::AlignedFloats() : nn::AlignedFloats(stride * kBlockRows));
    pre_.push_back(keep ? nn::AlignedFloats(stride * kBlockRows) : nn::AlignedFloats());
  }
  for (std::size_t i = 0; i < plan.input_count; ++i) inputs_.push_back(values_[i].data());
  for (const std::size_t output : plan.outputs) {
    outputs_.push_back(values_[output].data());
    output_gradients_.push_back(gradients_[output].data());
  }
}

void BlockWorkspace::Run(LossBlock block, BlockLoss& loss, float* gradient, nn::Store store) {
  block.inputs = inputs_;
  block.outputs = outputs_;
  block.output_gradients = output_gradients_;
  loss.Gather(block);
  Forward(block.rows);
  loss.Loss(block);
  Backward(block.rows, gradient, store);
}

void BlockWorkspace::Forward(std::int64_t rows) {
  const nn::Plan& plan = schedule_.plan;
  for (std::size_t s = 0; s < plan.steps.size(); ++s) {
    const nn::PlanStep& step = plan.steps[s];
    step.op->forward(step.block, {schedule_.packed.data() + schedule_.forward_at[s], rows, Value(step.input),
                                  Value(step.output), PreActivation(step.output)});
  }
}

void BlockWorkspace::Backward(std::int64_t rows, float* gradient, nn::Store store) {
  const nn::Plan& plan = schedule_.plan;
  for (std::size_t s = plan.steps.size(); s-- > 0;) {
    const nn::PlanStep& step = plan.steps[s];
    const BackwardStep& back = schedule_.backward[s];
    if (!back.reached) continue;
    GradientCall call;
    call.block = &step.block;
    call.packed = schedule_.packed.data() + schedule_.backward_at[s];
    call.rows = rows;
    call.x = Value(step.input);
    call.y = Value(step.output);
    call.z = PreActivation(step.output);
    call.dy = Gradient(step.output);
    if (back.input_wanted) call.dx = Gradient(step.input);
    call.dx_store = back.input_store;
    call.dparameters = gradient + step.parameter_offset;
    call.store = store;
    back.op->backward(call);
  }
}

}  // namespace consac::learn
