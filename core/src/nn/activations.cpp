#include "consac/nn/activations.h"

#include <algorithm>

namespace consac::nn {
namespace {

constexpr std::int64_t kImagesInCache = 4;  // 84 x 84 x 4 with what the nature CNN makes of them: 1.2 MB
constexpr std::int64_t kNumbersOfAnImage = 1 << 12;

/// Whether a step's rows are large and its parameters few beside a dense layer's: each row pays for itself.
bool HasImages(const PlanStep& step, const Needs& needs) {
  const PlacedBlock& block = step.block;
  return std::max(block.in_size, block.out_size) >= kNumbersOfAnImage &&
         block.parameter_count < block.in_size * block.out_size && step.state_size == 0 && !needs.couples_rows;
}

}  // namespace

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
    const Needs needs = step.op->needs == nullptr ? Needs() : step.op->needs(step.block, options_.group_rows);
    images_.push_back(HasImages(step, needs));
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
    RunGroup(packed, steps, call, {first, count});
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

// Images go through one block after another a few at a time, so that each finds them in cache; a dense layer wants many
// rows, since its weights are what has to come from far.
void Activations::RunGroup(const PackedNetwork& packed, std::span<const std::size_t> steps, const ForwardRows& call,
                           const Group& group) {
  for (std::size_t begin = 0, end = 0; begin < steps.size(); begin = end) {
    const bool images = images_[steps[begin]] && call.steps == 1;
    end = begin + 1;
    while (images && end < steps.size() && images_[steps[end]]) ++end;
    const std::int64_t together = images ? kImagesInCache : group.count;
    for (std::int64_t at = 0; at < group.count; at += together) {
      for (std::size_t s = begin; s < end; ++s)
        RunStep(steps[s], packed, call, group, {at, std::min(together, group.count - at)});
    }
  }
}

void Activations::RunStep(std::size_t s, const PackedNetwork& packed, const ForwardRows& call, const Group& group,
                          const Group& part) {
  const PlanStep& step = plan_.steps[s];
  const auto rows_of = [&](Rows rows) { return Rows{rows.data + part.first * rows.stride, rows.stride}; };
  for (std::size_t i = 0; i < step.inputs.size(); ++i) {
    const std::size_t value = step.inputs[i];
    const std::int64_t size = plan_.values[value].size;
    inputs_[i] = value < plan_.input_count ? ConstRows(call.inputs[value] + (group.first + part.first) * size, size)
                                           : ConstRows(rows_of(Value(value, group.first)));
  }
  BlockCall work;
  work.packed = packed.of_step(s);
  work.rows = part.count;
  work.inputs = {inputs_.data(), step.inputs.size()};
  work.output = rows_of(Value(step.output, group.first));
  work.saved = saved_[s].stride == 0 ? Rows{} : rows_of(Saved(s));
  work.scratch = scratch_.data();
  work.steps = call.steps;
  if (step.state_size > 0) {
    work.state = {state_.data() + step.state_at, plan_.state_size};
    work.begins = call.recurrent.begins == nullptr ? nullptr : call.recurrent.begins + group.first;
  }
  step.op->forward(step.block, work);
}

}  // namespace consac::nn
