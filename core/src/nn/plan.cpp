#include "consac/nn/plan.h"

#include <algorithm>
#include <map>
#include <string_view>

namespace consac::nn {

Plan::Plan(const Network& network) {
  const NetworkSpec& spec = network.spec();
  std::map<std::string_view, std::size_t> places;  // of values by name; Network has checked that each is there once
  const auto value_of = [&](std::string_view name) { return places.find(name)->second; };
  for (const Port& input : spec.inputs) {
    places.emplace(input.name, values.size());
    values.push_back({input.size, kNone, kNone});
  }
  input_count = values.size();
  for (const PlacedBlock& block : network.blocks()) {
    PlanStep step{block, FindOp(block.op), {}, values.size(), state_size, 0};
    if (step.op->needs != nullptr) step.state_size = step.op->needs(block, 1).state;
    state_size += step.state_size;
    for (const std::string& input : block.inputs) step.inputs.push_back(value_of(input));
    places.emplace(block.output, values.size());
    values.push_back({block.out_size, steps.size(), kNone});
    steps.push_back(std::move(step));
  }
  for (const std::string& output : spec.outputs) {
    outputs.push_back(value_of(output));
    values[outputs.back()].output = outputs.size() - 1;
  }
}

std::vector<std::size_t> Plan::StepsTo(std::size_t index) const {
  std::vector<bool> wanted(values.size());
  wanted[outputs[index]] = true;
  std::vector<std::size_t> needed;
  for (std::size_t s = steps.size(); s-- > 0;) {
    if (!wanted[steps[s].output]) continue;
    for (const std::size_t input : steps[s].inputs) wanted[input] = true;
    needed.push_back(s);
  }
  std::reverse(needed.begin(), needed.end());
  return needed;
}

std::int64_t InnerStride(std::int64_t size) {
  const std::int64_t stride = (size + 15) / 16 * 16;
  return stride % 256 == 0 ? stride + 16 : stride;
}

}  // namespace consac::nn
