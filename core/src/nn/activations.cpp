#include "consac/nn/activations.h"

#include <algorithm>

namespace consac::nn {

PackedNetwork::PackedNetwork(const Network& network) : plan_(network), parameter_count_(network.parameter_count()) {
  std::int64_t size = 0;
  for (const PlanStep& step : plan_.steps) {
    places_.push_back(size);
    if (step.op->packed_size != nullptr) size += (step.op->packed_size(step.block) + 15) / 16 * 16;
  }
  packed_ = AlignedFloats(size);
}

void PackedNetwork::Load(std::span<const float> parameters) {
  const bool whole = static_cast<std::int64_t>(parameters.size()) >= parameter_count_;
  CONSAC_ASSERT(whole);
  if (!whole) return;
  for (std::size_t s = 0; s < plan_.steps.size(); ++s) {
    const PlanStep& step = plan_.steps[s];
    if (step.op->pack == nullptr) continue;
    step.op->pack(step.block, parameters.data() + step.block.parameter_offset, packed_.data() + places_[s]);
  }
}

Activations::Activations(const Plan& plan, const ActivationsOptions& options) : plan_(plan), options_(options) {
  options_.group_rows = std::min(options_.group_rows, options_.rows);
  for (const PlanValue& value : plan.values) {
    Room& room = values_.emplace_back();
    const bool given = value.producer == kNone;
    if (given && !options_.learning) continue;
    const bool inner = !given && value.output == kNone;
    room.stride = inner ? InnerStride(value.size) : value.size;
    room.data = AlignedFloats(room.stride * (inner ? options_.group_rows : options_.rows));
  }
  std::int64_t scratch = 0;
  std::size_t most_inputs = 0;
  for (const PlanStep& step : plan.steps) {
    Room& room = saved_.emplace_back();
    most_inputs = std::max(most_inputs, step.inputs.size());
    if (step.op->needs == nullptr) continue;
    const Needs needs = step.op->needs(step.block, options_.group_rows);
    scratch = std::max(scratch, needs.scratch);
    if (!options_.learning || needs.saved == 0) continue;
    room.stride = InnerStride(needs.saved);
    room.data = AlignedFloats(room.stride * options_.group_rows);
  }
  scratch_ = AlignedFloats(scratch);
  inputs_.resize(most_inputs);
  state_ = AlignedFloats(options_.group_rows * plan.state_size);
}

Rows Activations::Value(std::size_t value, std::int64_t first_row) {
  Room& room = values_[value];
  const bool inner = plan_.values[value].output == kNone && plan_.values[value].producer != kNone;
  return {room.data.data() + (inner ? 0 : first_row * room.stride), room.stride};
}

Rows Activations::Saved(std::size_t step) {
  return {saved_[step].data.data(), saved_[step].stride};
}

void Activations::Run(const PackedNetwork& packed, std::span<const std::size_t> steps, const ForwardRows& call) {
  for (std::int64_t first = 0; first < call.rows; first += options_.group_rows) {
    const std::int64_t count = std::min(options_.group_rows, call.rows - first);
    const bool stateful = plan_.state_size > 0;
    if (stateful) LoadState(call.recurrent, first, count / call.steps);
    for (const std::size_t s : steps) RunStep(s, packed, call, first, count);
    if (stateful) StoreState(call.recurrent, first, count / call.steps);
  }
}

void Activations::LoadState(const RecurrentRows& recurrent, std::int64_t first, std::int64_t count) {
  const std::int64_t size = plan_.state_size;
  if (recurrent.state == nullptr) {
    std::fill_n(state_.data(), count * size, 0.0f);
    return;
  }
  for (std::int64_t r = 0; r < count; ++r) {
    const std::int64_t slot = recurrent.slots == nullptr ? first + r : recurrent.slots[first + r];
    std::copy_n(recurrent.state + slot * size, size, state_.data() + r * size);
  }
}

void Activations::StoreState(const RecurrentRows& recurrent, std::int64_t first, std::int64_t count) const {
  const std::int64_t size = plan_.state_size;
  for (std::int64_t r = 0; recurrent.state != nullptr && r < count; ++r) {
    const std::int64_t slot = recurrent.slots == nullptr ? first + r : recurrent.slots[first + r];
    std::copy_n(state_.data() + r * size, size, recurrent.state + slot * size);
  }
}

void Activations::RunStep(std::size_t s, const PackedNetwork& packed, const ForwardRows& call, std::int64_t first,
                          std::int64_t count) {
  const PlanStep& step = plan_.steps[s];
  for (std::size_t i = 0; i < step.inputs.size(); ++i) {
    const std::size_t value = step.inputs[i];
    const std::int64_t size = plan_.values[value].size;
    inputs_[i] =
        value < plan_.input_count ? ConstRows(call.inputs[value] + first * size, size) : ConstRows(Value(value, first));
  }
  BlockCall work;
  work.packed = packed.of_step(s);
  work.rows = count;
  work.inputs = {inputs_.data(), step.inputs.size()};
  work.output = Value(step.output, first);
  work.saved = Saved(s);
  work.scratch = scratch_.data();
  work.steps = call.steps;
  if (step.state_size > 0) {
    work.state = {state_.data() + step.state_at, plan_.state_size};
    work.begins = call.recurrent.begins == nullptr ? nullptr : call.recurrent.begins + first;
  }
  step.op->forward(step.block, work);
}

}  // namespace consac::nn
