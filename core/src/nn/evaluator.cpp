#include <algorithm>

#include "consac/nn/aligned.h"
#include "consac/nn/network.h"
#include "consac/nn/plan.h"

namespace consac::nn {
namespace {

constexpr std::int64_t kEvaluatorRows = 64;  // rows that go through all layers together, so that they stay in cache

}  // namespace

struct Evaluator::State {
  /// Where a value lives: an output for all rows, an inner value for one group of rows.
  struct Value {
    AlignedFloats data;
    std::int64_t stride = 0;
  };

  State(const Network& network, std::int64_t rows)
      : plan(network), parameter_count(network.parameter_count()), max_rows(rows) {
    std::int64_t packed_size = 0;
    for (const PlanStep& step : plan.steps) {
      packed_at.push_back(packed_size);
      packed_size += (step.op->packed_size(step.block) + 15) / 16 * 16;
    }
    packed = AlignedFloats(packed_size);
    for (const PlanValue& value : plan.values) {
      Value& room = values.emplace_back();
      if (value.producer == kNone) continue;
      const bool inner = value.output == kNone;
      room.stride = inner ? InnerStride(value.size) : value.size;
      room.data = AlignedFloats(room.stride * (inner ? std::min(rows, kEvaluatorRows) : rows));
    }
    for (std::size_t s = 0; s < plan.steps.size(); ++s) all_steps.push_back(s);
    for (std::size_t i = 0; i < plan.outputs.size(); ++i) steps_to.push_back(plan.StepsTo(i));
  }

  /// Row `first` of a value.
  Rows At(std::size_t value, std::int64_t first) {
    const bool inner = plan.values[value].output == kNone;
    return {values[value].data.data() + (inner ? 0 : first * values[value].stride), values[value].stride};
  }

  void Run(std::span<const std::size_t> steps, std::span<const float* const> inputs, std::int64_t rows) {
    for (std::int64_t first = 0; first < rows; first += kEvaluatorRows) {
      const std::int64_t count = std::min(kEvaluatorRows, rows - first);
      for (const std::size_t s : steps) {
        const PlanStep& step = plan.steps[s];
        const std::int64_t size = step.block.in_size;
        const ConstRows x = step.input < plan.input_count ? ConstRows(inputs[step.input] + first * size, size)
                                                          : ConstRows(At(step.input, first));
        step.op->forward(step.block, {packed.data() + packed_at[s], count, x, At(step.output, first), {}});
      }
    }
  }

  Plan plan;
  std::int64_t parameter_count;
  std::int64_t max_rows;
  AlignedFloats packed;
  std::vector<std::int64_t> packed_at;  // [steps]
  std::vector<Value> values;            // [plan.values]
  std::vector<std::size_t> all_steps;
  std::vector<std::vector<std::size_t>> steps_to;  // [outputs]
};

Evaluator::Evaluator(const Network& network, std::int64_t max_rows)
    : state_(std::make_unique<State>(network, max_rows)) {}
Evaluator::~Evaluator() = default;
Evaluator::Evaluator(Evaluator&&) noexcept = default;
Evaluator& Evaluator::operator=(Evaluator&&) noexcept = default;

void Evaluator::Load(std::span<const float> parameters) {
  CONSAC_ASSERT(static_cast<std::int64_t>(parameters.size()) >= state_->parameter_count);
  if (static_cast<std::int64_t>(parameters.size()) < state_->parameter_count) return;
  for (std::size_t s = 0; s < state_->plan.steps.size(); ++s) {
    const PlanStep& step = state_->plan.steps[s];
    step.op->pack(step.block, parameters.data() + step.parameter_offset, state_->packed.data() + state_->packed_at[s]);
  }
}

void Evaluator::Forward(std::span<const float* const> inputs, std::int64_t rows) {
  const bool fits = rows <= state_->max_rows && inputs.size() == state_->plan.input_count;
  CONSAC_ASSERT(fits);
  if (!fits) return;
  state_->Run(state_->all_steps, inputs, rows);
}

void Evaluator::ForwardTo(std::size_t index, std::span<const float* const> inputs, std::int64_t rows) {
  const bool fits = rows <= state_->max_rows && inputs.size() == state_->plan.input_count;
  CONSAC_ASSERT(fits);
  if (!fits) return;
  state_->Run(state_->steps_to[index], inputs, rows);
}

const float* Evaluator::output(std::size_t index) const {
  return state_->values[state_->plan.outputs[index]].data.data();
}

}  // namespace consac::nn
