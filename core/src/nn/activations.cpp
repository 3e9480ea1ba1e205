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

/// Writes what has changed alone. A processor waits where it reads sixteen bytes of which it has just written eight,
/// and a block reads several numbers of its call at once.
template <typename Value>
void Update(Value value, Value& in_call) {
  if (in_call != value) in_call = value;
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
    room.of_group = !given && value.output == kNone;
    room.stride = room.of_group ? InnerStride(value.size) : value.size;
    room.data = AlignedFloats(room.stride * (room.of_group ? options_.group_rows : options_.rows));
  }
  std::int64_t scratch = 0;
  std::size_t all_inputs = 0, most_inputs = 0;
  std::vector<Needs> needs;
  for (const PlanStep& step : plan.steps) {
    Room& room = saved_.emplace_back();
    all_inputs += step.inputs.size();
    most_inputs = std::max(most_inputs, step.inputs.size());
    needs.push_back(step.op->needs == nullptr ? Needs() : step.op->needs(step.block, options_.group_rows));
    scratch = std::max(scratch, needs.back().scratch);
    if (!options_.learning || needs.back().saved == 0) continue;
    room.stride = InnerStride(needs.back().saved);
    room.data = AlignedFloats(room.stride * options_.group_rows);
  }
  scratch_ = AlignedFloats(scratch);
  state_ = AlignedFloats(options_.group_rows * plan.state_size);
  inputs_.reserve(all_inputs);
  moved_inputs_.resize(most_inputs);
  for (std::size_t s = 0; s < plan.steps.size(); ++s) MakeReady(s, needs[s]);
}

void Activations::MakeReady(std::size_t s, const Needs& needs) {
  const PlanStep& step = plan_.steps[s];
  BlockCall call;
  call.inputs = {inputs_.data() + inputs_.size(), step.inputs.size()};
  for (const std::size_t value : step.inputs) {
    if (value < plan_.input_count) {
      given_.push_back({inputs_.size(), value});
      inputs_.emplace_back(nullptr, plan_.values[value].size);
    } else {
      inputs_.emplace_back(Value(value));
    }
  }
  call.output = Value(step.output);
  if (saved_[s].stride > 0) call.saved = Saved(s);
  call.scratch = scratch_.data();
  if (step.state_size > 0) call.state = {state_.data() + step.state_at, plan_.state_size};
  ready_.push_back({&step, call, HasImages(step, needs)});
}

Rows Activations::Value(std::size_t value, std::int64_t first_row) {
  Room& room = values_[value];
  return {room.data.data() + (room.of_group ? 0 : first_row * room.stride), room.stride};
}

Rows Activations::Saved(std::size_t step) {
  return {saved_[step].data.data(), saved_[step].stride};
}

void Activations::Run(const PackedNetwork& packed, std::span<const std::size_t> steps, const ForwardRows& call) {
  for (const Given& given : given_) Update(call.inputs[given.input], inputs_[given.at].data);
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
    end = begin + 1;
    if (!ready_[steps[begin]].images || call.steps > 1) {
      RunStep(steps[begin], packed, call, group, {0, group.count});
      continue;
    }
    while (end < steps.size() && ready_[steps[end]].images) ++end;
    for (std::int64_t at = 0; at < group.count; at += kImagesInCache) {
      for (std::size_t s = begin; s < end; ++s)
        RunStep(steps[s], packed, call, group, {at, std::min(kImagesInCache, group.count - at)});
    }
  }
}

void Activations::RunStep(std::size_t s, const PackedNetwork& packed, const ForwardRows& call, const Group& group,
                          const Group& part) {
  ReadyStep& ready = ready_[s];
  const std::int64_t first = group.first + part.first;
  Update(packed.of_step(s), ready.call.packed);
  Update(part.count, ready.call.rows);
  Update(call.steps, ready.call.steps);
  if (ready.step->state_size > 0)
    ready.call.begins = call.recurrent.begins == nullptr ? nullptr : call.recurrent.begins + group.first;
  if (first == 0)
    ready.step->op->forward(ready.step->block, ready.call);
  else
    ready.step->op->forward(ready.step->block, MovedOn(ready, part, first));
}

BlockCall Activations::MovedOn(const ReadyStep& ready, const Group& part, std::int64_t first) {
  const PlanStep& step = *ready.step;
  BlockCall call = ready.call;
  const auto rows_on = [&](std::size_t value) { return values_[value].of_group ? part.first : first; };
  for (std::size_t i = 0; i < step.inputs.size(); ++i) {
    const ConstRows& rows = ready.call.inputs[i];
    moved_inputs_[i] = {rows.data + rows_on(step.inputs[i]) * rows.stride, rows.stride};
  }
  call.inputs = {moved_inputs_.data(), step.inputs.size()};
  call.output.data += rows_on(step.output) * call.output.stride;
  call.saved.data += part.first * call.saved.stride;
  return call;
}

}  // namespace consac::nn
