// A wide network's rows in slices, by a reversed order of slices, beside an nn::Evaluator's whole rows: to the bit.
#include "collect/sliced_evaluator.h"

#include <gtest/gtest.h>

#include <cstring>

#include "consac/base/rng.h"
#include "consac/nn/activations.h"
#include "learn/test/grad/quadratic_loss.h"

namespace consac::learn {
namespace {

/// Two inputs and two outputs, of 3 and 2 numbers.
nn::Network TwoTowers(std::int64_t width) {
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 5}, {"action", 2}};
  spec.blocks = {Dense("first", "obs", 5, width, nn::Activation::kRelu),
                 Dense("second", "first", width, width, nn::Activation::kRelu),
                 Dense("a", "second", width, 3, nn::Activation::kTanh),
                 Dense("b", "action", 2, 2, nn::Activation::kTanh)};
  spec.outputs = {"a", "b"};
  return MustCreate(spec);
}

/// Runs the blocks from the last to the first, and counts them.
struct Reversed {
  std::int64_t blocks = 0;
  Executor executor() {
    return {[](void* user, std::int64_t count, void (*task)(void*, std::int64_t), void* context) {
              static_cast<Reversed*>(user)->blocks += count;
              while (count-- > 0) task(context, count);
            },
            this};
  }
};

void ExpectWhole(std::int64_t width, std::int64_t rows, std::int64_t blocks) {
  SCOPED_TRACE(testing::Message() << width << " wide, " << rows << " rows");
  constexpr std::int64_t kMostRows = 300;
  const nn::Network network = TwoTowers(width);
  Rng rng(1, 1);
  std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count()));
  network.Initialise(rng, parameters);
  std::vector<float> observations(static_cast<std::size_t>(rows * 5)), actions(static_cast<std::size_t>(rows * 2));
  for (std::vector<float>* numbers : {&observations, &actions})
    for (float& number : *numbers) number = rng.Normal();
  const float* inputs[] = {observations.data(), actions.data()};
  const auto packed = std::make_shared<nn::PackedNetwork>(network);
  packed->Load(parameters);
  nn::Evaluator whole(packed, kMostRows);
  whole.Forward(inputs, rows);
  Reversed reversed;
  SlicedEvaluator sliced(network, packed, kMostRows, reversed.executor());
  sliced.Forward(inputs, rows);
  EXPECT_EQ(reversed.blocks, blocks);
  const auto expect_equal = [&](std::size_t output) {
    const auto bytes = static_cast<std::size_t>(rows * network.output_size(output)) * sizeof(float);
    EXPECT_EQ(std::memcmp(sliced.output(output), whole.output(output), bytes), 0) << "output " << output;
  };
  expect_equal(0);
  expect_equal(1);
  for (float& number : actions) number = -number;
  whole.ForwardTo(1, inputs, rows);
  sliced.ForwardTo(1, inputs, rows);
  expect_equal(1);
}

TEST(SlicedEvaluator, SlicesOfAWideNetworkAreTheWholeToTheBit) {
  ExpectWhole(256, 300, 3);
  ExpectWhole(256, 256, 2);
  ExpectWhole(256, 129, 2);
}

TEST(SlicedEvaluator, FewRowsAndNarrowNetworksStayWhole) {
  ExpectWhole(256, 128, 0);
  ExpectWhole(64, 300, 0);
}

}  // namespace
}  // namespace consac::learn
