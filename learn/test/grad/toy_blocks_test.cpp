// What a new layer needs, shown by layers that exist in this file alone: their halves are added to the tables, and
// they run, act, learn and travel in a model file as the others do. One has a state, one couples rows, one reads an
// attribute.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numeric>

#include "consac/nn/ops.h"
#include "consac/policy/policy.h"
#include "grad/gradient_ops.h"
#include "learn/test/grad/quadratic_loss.h"

namespace consac::learn {
namespace {

// toy_memory: h = tanh(x + w h), one w per feature; h is the slot's state, zero where an episode begins.

Result<nn::Shape> InferToy(const nn::Block& block, std::span<const nn::Shape> inputs) {
  CONSAC_RETURN_IF_ERROR(nn::CheckInputCount(block, inputs, 1));
  return inputs[0];
}
std::vector<nn::Parameter> MemoryParameters(const nn::PlacedBlock& block) {
  return {{block.name + "/w", {block.out_size}, 0, block.out_size}};
}
void InitialiseMemory(const nn::PlacedBlock& block, Rng& rng, float* parameters) {
  for (std::int64_t i = 0; i < block.out_size; ++i) parameters[i] = 0.5f * rng.Normal();
}
std::int64_t MemorySize(const nn::PlacedBlock& block) {
  return block.out_size;
}
void PackMemory(const nn::PlacedBlock& block, const float* parameters, float* packed) {
  std::copy_n(parameters, block.out_size, packed);
}
/// Saved: the state before the step.
nn::Needs MemoryNeeds(const nn::PlacedBlock& block, std::int64_t) {
  return {.saved = block.out_size, .state = block.out_size};
}
void MemoryForward(const nn::PlacedBlock& block, const nn::BlockCall& call) {
  const std::int64_t sequences = call.rows / call.steps;
  for (std::int64_t r = 0; r < call.rows; ++r) {
    float* state = call.state.data + r % sequences * call.state.stride;
    const bool begins = call.begins != nullptr && call.begins[r] != 0;
    for (std::int64_t i = 0; i < block.out_size; ++i) {
      const float before = begins ? 0.0f : state[i];
      if (call.saved.data != nullptr) call.saved.data[r * call.saved.stride + i] = before;
      state[i] = std::tanh(call.inputs[0].data[r * call.inputs[0].stride + i] + call.packed[i] * before);
      call.output.data[r * call.output.stride + i] = state[i];
    }
  }
}
/// Backward through time: what step t gives to step t - 1 is added to that step's dy.
void MemoryBackward(const GradientCall& call) {
  const std::int64_t n = call.block->out_size, sequences = call.rows / call.steps;
  if (call.store == nn::Store::kOverwrite) std::fill_n(call.dparameters, n, 0.0f);
  for (std::int64_t r = call.rows; r-- > 0;) {
    const bool first = r < sequences || (call.begins != nullptr && call.begins[r] != 0);
    for (std::int64_t i = 0; i < n; ++i) {
      const float y = call.y.data[r * call.y.stride + i];
      const float dz = call.dy.data[r * call.dy.stride + i] * (1.0f - y * y);
      call.dparameters[i] += dz * call.saved.data[r * call.saved.stride + i];
      if (!first) call.dy.data[(r - sequences) * call.dy.stride + i] += dz * call.packed[i];
      if (call.inputs[0].dx.data == nullptr) continue;
      float& dx = call.inputs[0].dx.data[r * call.inputs[0].dx.stride + i];
      dx = (call.inputs[0].store == nn::Store::kAdd ? dx : 0.0f) + dz;
    }
  }
}

// toy_centre: the row less `share` times the mean of all rows: while learning, rows are coupled.

nn::Needs CentreNeeds(const nn::PlacedBlock&, std::int64_t) {
  return {.couples_rows = true};
}
/// rows less `share` times their mean, column by column; the same forward and backward, for it is symmetric.
void Centre(double share, std::int64_t rows, std::int64_t columns, nn::ConstRows from, nn::Rows to) {
  for (std::int64_t i = 0; i < columns; ++i) {
    double mean = 0.0;
    for (std::int64_t r = 0; r < rows; ++r) mean += double{from.data[r * from.stride + i]} / static_cast<double>(rows);
    for (std::int64_t r = 0; r < rows; ++r)
      to.data[r * to.stride + i] = from.data[r * from.stride + i] - static_cast<float>(share * mean);
  }
}
void CentreForward(const nn::PlacedBlock& block, const nn::BlockCall& call) {
  Centre(*block.attributes.Number("share"), call.rows, block.out_size, call.inputs[0], call.output);
}
void CentreBackward(const GradientCall& call) {
  if (call.inputs[0].dx.data == nullptr) return;
  Centre(*call.block->attributes.Number("share"), call.rows, call.block->out_size, call.dy, call.inputs[0].dx);
}

/// The rows, added once.
void AddToyBlocks() {
  static const nn::Op kMemory = [] {
    nn::Op op;
    op.name = "toy_memory";
    op.infer = InferToy;
    op.parameters = MemoryParameters;
    op.initialise = InitialiseMemory;
    op.packed_size = MemorySize;
    op.pack = PackMemory;
    op.needs = MemoryNeeds;
    op.forward = MemoryForward;
    return op;
  }();
  static const nn::Op kCentre = [] {
    nn::Op op;
    op.name = "toy_centre";
    op.infer = InferToy;
    op.needs = CentreNeeds;
    op.forward = CentreForward;
    return op;
  }();
  static const GradientOp kMemoryGradient = [] {
    GradientOp op;
    op.name = "toy_memory";
    op.packed_size = MemorySize;
    op.pack = PackMemory;
    op.backward = MemoryBackward;
    return op;
  }();
  static const GradientOp kCentreGradient = [] {
    GradientOp op;
    op.name = "toy_centre";
    op.backward = CentreBackward;
    return op;
  }();
  if (nn::FindOp("toy_memory") != nullptr) return;
  nn::AddOp(kMemory);
  nn::AddOp(kCentre);
  AddGradientOp(kMemoryGradient);
  AddGradientOp(kCentreGradient);
}

nn::Network MemoryNetwork() {
  AddToyBlocks();
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 3}};
  spec.blocks = {Dense("a", "obs", 3, 4, nn::Activation::kTanh),
                 {.op = "toy_memory", .inputs = {"a"}, .output = "h", .name = "h"},
                 Dense("y", "h", 4, 2, nn::Activation::kLinear)};
  spec.outputs = {"y"};
  return MustCreate(spec);
}

TEST(ToyMemory, KeepsAStatePerSlotUntilAnEpisodeBegins) {
  const nn::Network network = MemoryNetwork();
  const std::vector<float> parameters = RandomParameters(network, 0);
  nn::Evaluator together(network, 3), alone(network, 1);
  together.Load(parameters);
  alone.Load(parameters);
  ASSERT_EQ(together.state_size(), 4);
  std::vector<float> states(5 * 4), state(4);
  const std::int32_t slots[] = {0, 2, 4};
  Rng rng(1, 1);
  for (int t = 0; t < 20; ++t) {
    float rows[9];
    for (float& value : rows) value = rng.Normal();
    const std::uint8_t begins[] = {0, static_cast<std::uint8_t>(t % 7 == 0), 0};
    const float* input = rows;
    together.Forward({&input, 1}, 3, {.state = states.data(), .slots = slots, .begins = begins});
    const float* row = rows + 3;
    alone.Forward({&row, 1}, 1, {.state = state.data(), .begins = begins + 1});
    ASSERT_EQ(std::memcmp(alone.output(0), together.output(0) + 2, 2 * sizeof(float)), 0) << t;
    ASSERT_EQ(std::memcmp(state.data(), states.data() + 8, 4 * sizeof(float)), 0);
    nn::Evaluator fresh(network, 1);
    fresh.Load(parameters);
    fresh.Forward({&row, 1}, 1);
    EXPECT_EQ(std::memcmp(fresh.output(0), alone.output(0), 2 * sizeof(float)) == 0, begins[1] != 0) << t;
  }
  for (std::size_t i = 4; i < 8; ++i) EXPECT_EQ(states[i], 0.0f);  // slot 1 never acted
}

// A policy acts for agents that stay: what a slot remembers is its own, also from a file, and ends with its episode.
TEST(ToyMemory, APolicyRemembersForEachOfItsSlots) {
  PolicyData data;
  data.observation_space = *Space::Box(-1, 1, {3});
  data.action_space = *Space::Discrete(2);
  const nn::Network network = MemoryNetwork();
  data.network = network.spec();
  data.parameters = RandomParameters(network, 0);
  auto made = Policy::Create(data, 4);
  ASSERT_TRUE(made.ok()) << made.status().message();
  auto loaded = Policy::FromBytes(made->ToFile(1).Serialise(), 4);
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_TRUE(loaded->recurrent());
  const std::int32_t both[] = {1, 3}, first[] = {0};
  Rng rng(2, 2);
  for (int t = 0; t < 9; ++t) {
    float rows[6];
    for (float& value : rows) value = rng.Normal();
    const std::uint8_t begins[] = {0, static_cast<std::uint8_t>(t == 4)};
    std::int32_t actions[2] = {-1, -1}, action = -1;
    made->Act({.observations = reinterpret_cast<const std::byte*>(rows), .rows = 2, .slots = both, .begins = begins},
              ActionMode::kDeterministic, rng, reinterpret_cast<std::byte*>(actions));
    loaded->Act(
        {.observations = reinterpret_cast<const std::byte*>(rows + 3), .rows = 1, .slots = first, .begins = begins + 1},
        ActionMode::kDeterministic, rng, reinterpret_cast<std::byte*>(&action));
    EXPECT_EQ(action, actions[1]);
    ASSERT_EQ(std::memcmp(loaded->head().data(), made->head().data() + 2, 2 * sizeof(float)), 0) << t;
  }
}

constexpr std::int64_t kSteps = 6;

/// Sequences of kSteps with a begin in their midst; the loss weighs every output.
class SequenceLoss final : public BlockLoss {
 public:
  SequenceLoss(std::int64_t sequences, std::uint64_t seed) : sequences_(sequences) {
    Rng rng(seed, 1);
    for (std::int64_t i = 0; i < sequences * kSteps * 3; ++i) inputs.push_back(rng.Normal());
  }
  bool Begins(std::int64_t sequence, std::int64_t step) const { return step == 3 && sequence % 2 == 0; }
  void Gather(const LossBlock& block) override {
    const std::int64_t count = block.rows / block.steps, first = block.first_row / block.steps;
    for (std::int64_t r = 0; r < block.rows; ++r) {
      const std::int64_t sequence = first + r % count, step = r / count;
      std::copy_n(inputs.data() + (sequence * kSteps + step) * 3, 3, block.inputs[0] + r * 3);
      block.begins[static_cast<std::size_t>(r)] = Begins(sequence, step) ? 1 : 0;
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(count * 4); ++i) block.state[i] = 0.25f;
  }
  void Loss(const LossBlock& block) override {
    for (std::int64_t i = 0; i < block.rows * 2; ++i) block.output_gradients[0][i] = 0.3f + block.outputs[0][i];
  }
  /// The loss by acting step by step, in float64.
  double InFloat64(const nn::Network& network, const std::vector<double>& p) const {
    double loss = 0.0;
    for (std::int64_t s = 0; s < sequences_; ++s) {
      std::vector<double> h(4, 0.25);
      for (std::int64_t t = 0; t < kSteps; ++t) {
        const float* row = inputs.data() + (s * kSteps + t) * 3;
        const auto a = nn::ReferenceBlock(network.blocks()[0], p.data(), {{row, row + 3}});
        for (std::size_t i = 0; i < 4; ++i) h[i] = std::tanh(a[i] + p[16 + i] * (Begins(s, t) ? 0.0 : h[i]));
        for (const double y : nn::ReferenceBlock(network.blocks()[2], p.data() + 20, {h}))
          loss += 0.3 * y + 0.5 * y * y;
      }
    }
    return loss;
  }
  std::vector<float> inputs;

 private:
  std::int64_t sequences_;
};

TEST(ToyMemory, LearnsThroughTime) {
  const nn::Network network = MemoryNetwork();
  for (const std::int64_t sequences : {1, 9, 40}) {
    const std::vector<float> parameters = RandomParameters(network, 0);
    SequenceLoss loss(sequences, 3);
    const std::int64_t rows = sequences * kSteps;
    Backpropagation backpropagation(network, {.max_rows = rows, .steps = kSteps});
    EXPECT_EQ(backpropagation.block_rows(), 60);
    backpropagation.Run(parameters, rows, Executor(), loss);
    std::vector<double> at(parameters.begin(), parameters.end());
    for (std::size_t i = 0; i < at.size(); ++i) {
      const double centre = at[i];
      at[i] = centre + 1e-5;
      const double above = loss.InFloat64(network, at);
      at[i] = centre - 1e-5;
      const double slope = (above - loss.InFloat64(network, at)) / 2e-5;
      at[i] = centre;
      EXPECT_NEAR(backpropagation.gradient()[i], slope, 1e-3 * (1.0 + std::abs(slope))) << i;
    }
  }
}

TEST(ToyCentre, CouplesAllRowsOfAMinibatch) {
  AddToyBlocks();
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 3}};
  nn::Block centre{.op = "toy_centre", .inputs = {"a"}, .output = "c", .name = "c"};
  centre.attributes.SetNumber("share", 0.75);
  spec.blocks = {Dense("a", "obs", 3, 2, nn::Activation::kLinear), centre};
  spec.outputs = {"c"};
  const nn::Network network = MustCreate(spec);
  constexpr std::int64_t kRows = 200;
  Backpropagation backpropagation(network, 0, kRows);
  EXPECT_EQ(backpropagation.block_rows(), kRows);
  QuadraticLoss loss(network, kRows, 4);
  backpropagation.Run(RandomParameters(network, 0), kRows, Executor(), loss);
  // db: the sum over rows of (w + c) less 0.75 of it, where c sums to a quarter of the sum of a.
  nn::NetworkSpec plain = spec;
  plain.blocks.pop_back();
  plain.outputs = {"a"};
  const nn::Network uncoupled = MustCreate(plain);
  Backpropagation beside(uncoupled, 0, kRows);
  QuadraticLoss same(uncoupled, kRows, 4);
  beside.Run(RandomParameters(network, 0), kRows, Executor(), same);
  for (std::size_t i = 6; i < 8; ++i) {
    const double sum_of_a = beside.gradient()[i] - 0.7 * kRows;
    EXPECT_NEAR(backpropagation.gradient()[i], 0.25 * (0.7 * kRows + 0.25 * sum_of_a), 1e-2) << i;
  }
}

TEST(ToyBlocks, TravelInAModelFile) {
  AddToyBlocks();
  PolicyData data;
  data.observation_space = *Space::Box(-1, 1, {3});
  data.action_space = *Space::Discrete(3);
  data.network.inputs = {{"obs", 3}};
  nn::Block centre{.op = "toy_centre", .inputs = {"obs"}, .output = "pi", .name = "pi"};
  centre.attributes.SetNumber("share", 0.0);
  data.network.blocks = {centre};
  data.network.outputs = {"pi"};
  const auto policy = Policy::Create(data, 1);
  ASSERT_TRUE(policy.ok()) << policy.status().message();
  const auto loaded = Policy::FromBytes(policy->ToFile(1).Serialise());
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->data().network.blocks[0].attributes.Number("share"), 0.0);
}

}  // namespace
}  // namespace consac::learn
