#pragma once
// A model that remembers and a world in which that shows, for tests of whoever acts by models: its action is the sum of
// what its agent has seen since its episode began, and what an agent sees is always 1.

#include <vector>

#include "consac/env/vector_env.h"
#include "consac/nn/ops.h"
#include "consac/policy/policy.h"

namespace consac::testing {

/// Adds the block "test_sum": y = h = x + h.
inline void AddSumBlock() {
  if (nn::FindOp("test_sum") != nullptr) return;
  static const nn::Op kSum = [] {
    nn::Op op;
    op.name = "test_sum";
    op.infer = [](const nn::Block&, std::span<const nn::Shape> inputs) { return Result<nn::Shape>(inputs[0]); };
    op.needs = [](const nn::PlacedBlock& block, std::int64_t) { return nn::Needs{.state = block.out_size}; };
    op.forward = [](const nn::PlacedBlock& block, const nn::BlockCall& call) {
      for (std::int64_t r = 0; r < call.rows; ++r) {
        float* const state = call.state.data + r * call.state.stride;
        const bool begins = call.begins != nullptr && call.begins[r] != 0;
        for (std::int64_t i = 0; i < block.out_size; ++i) {
          state[i] = call.inputs[0].data[r * call.inputs[0].stride + i] + (begins ? 0.0f : state[i]);
          call.output.data[r * call.output.stride + i] = state[i];
        }
      }
    };
    return op;
  }();
  nn::AddOp(kSum);
}

/// The model. One number in, one out.
inline PolicyData RememberingPolicy() {
  AddSumBlock();
  PolicyData data;
  data.observation_space = *Space::Box(0, 1000, {1});
  data.action_space = *Space::Box(0, 1000, {1});
  data.network.inputs = {{"obs", 1}};
  data.network.blocks = {{.op = "test_sum", .inputs = {"obs"}, .output = "pi", .name = "pi"}};
  data.network.outputs = {"pi"};
  data.log_std = {0.0f};
  return data;
}

/// The world: the episodes of slot i last 3 + i steps; every second of them is truncated. What an agent does is its
/// reward.
class OnesEnv final : public VectorEnv {
 public:
  explicit OnesEnv(std::int32_t slots) : lengths_(static_cast<std::size_t>(slots)), episodes_(lengths_.size()) {
    spec_.id = "ones";
    const PolicyData model = RememberingPolicy();
    spec_.behaviours.push_back(BehaviourSpec::Of("default", model.observation_space, model.action_space, slots));
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t, std::span<Batch> batches) override {
    std::fill(lengths_.begin(), lengths_.end(), 0);
    Show(batches[0].next_observations);
  }
  void Step(std::span<Batch> batches) override {
    Batch& batch = batches[0];
    for (std::size_t i = 0; i < lengths_.size(); ++i) {
      batch.rewards[i] = reinterpret_cast<const float*>(batch.actions)[i];
      const bool over = ++lengths_[i] == 3 + static_cast<std::int64_t>(i);
      if (over) lengths_[i] = 0;
      const bool cut = over && ++episodes_[i] % 2 == 0;
      batch.truncated[i] = cut ? 1 : 0;
      batch.terminated[i] = over && !cut ? 1 : 0;
    }
    Show(batch.final_observations);
    Show(batch.next_observations);
  }
  void Visit(Archive& archive) override {
    archive("lengths", lengths_);
    archive("episodes", episodes_);
  }
  /// Steps that slot `i` has taken of its episode: what its next action is to be, less 1.
  std::int64_t length(std::size_t i) const { return lengths_[i]; }

 private:
  void Show(std::byte* rows) const { std::fill_n(reinterpret_cast<float*>(rows), lengths_.size(), 1.0f); }

  EnvSpec spec_;
  std::vector<std::int64_t> lengths_, episodes_;
};

}  // namespace consac::testing
