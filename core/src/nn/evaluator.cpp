#include "consac/nn/activations.h"

namespace consac::nn {

struct Evaluator::State {
  State(std::shared_ptr<PackedNetwork> mine, std::shared_ptr<const PackedNetwork> any, std::int64_t most)
      : own(std::move(mine)),
        packed(std::move(any)),
        max_rows(most),
        activations(packed->plan(), {.rows = most, .group_rows = kRowsTogether}) {
    const Plan& plan = packed->plan();
    for (std::size_t s = 0; s < plan.steps.size(); ++s) all_steps.push_back(s);
    for (std::size_t i = 0; i < plan.outputs.size(); ++i) steps_to.push_back(plan.StepsTo(i));
  }

  void Run(std::span<const std::size_t> steps, std::span<const float* const> inputs, std::int64_t rows,
           const RecurrentRows& recurrent) {
    const bool fits = rows <= max_rows && inputs.size() == packed->plan().input_count;
    CONSAC_ASSERT(fits);
    if (fits) activations.Run(*packed, steps, {.inputs = inputs, .rows = rows, .recurrent = recurrent});
  }

  std::shared_ptr<PackedNetwork> own;  // null: the packing is somebody else's
  std::shared_ptr<const PackedNetwork> packed;
  std::int64_t max_rows;
  Activations activations;
  std::vector<std::size_t> all_steps;
  std::vector<std::vector<std::size_t>> steps_to;  // [outputs]
};

Evaluator::Evaluator(const Network& network, std::int64_t max_rows) {
  auto packed = std::make_shared<PackedNetwork>(network);
  state_ = std::make_unique<State>(packed, packed, max_rows);
}
Evaluator::Evaluator(std::shared_ptr<const PackedNetwork> packed, std::int64_t max_rows)
    : state_(std::make_unique<State>(nullptr, std::move(packed), max_rows)) {}
Evaluator::~Evaluator() = default;
Evaluator::Evaluator(Evaluator&&) noexcept = default;
Evaluator& Evaluator::operator=(Evaluator&&) noexcept = default;

void Evaluator::Load(std::span<const float> parameters) {
  CONSAC_ASSERT(state_->own != nullptr);
  if (state_->own != nullptr) state_->own->Load(parameters);
}

void Evaluator::Forward(std::span<const float* const> inputs, std::int64_t rows, const RecurrentRows& recurrent) {
  state_->Run(state_->all_steps, inputs, rows, recurrent);
}

void Evaluator::ForwardTo(std::size_t index, std::span<const float* const> inputs, std::int64_t rows,
                          const RecurrentRows& recurrent) {
  state_->Run(state_->steps_to[index], inputs, rows, recurrent);
}

const float* Evaluator::output(std::size_t index) const {
  return state_->activations.Value(state_->packed->plan().outputs[index]).data;
}

std::int64_t Evaluator::state_size() const {
  return state_->packed->plan().state_size;
}

}  // namespace consac::nn
