// Gradients against float64 finite differences, for every activation and many shapes; threads and bits.
#include "consac/learn/grad/backpropagation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <thread>
#include <vector>

#include "consac/nn/net_arch.h"
#include "consac/nn/ops.h"
#include "grad/gradient_ops.h"
#include "learn/test/grad/quadratic_loss.h"

namespace consac::learn {
namespace {

nn::NetworkSpec Towers(nn::NetArch arch, std::int64_t in, std::int64_t out, nn::Activation activation) {
  nn::ActorCriticOptions options;
  options.arch = std::move(arch);
  options.observation_size = in;
  options.action_size = out;
  options.activation = activation;
  options.policy_gain = 1.0f;
  return nn::ActorCritic(options);
}

class GradientOfActivation : public testing::TestWithParam<nn::Activation> {};

TEST_P(GradientOfActivation, MatchesDifferences) {
  ExpectGradient(MustCreate(Towers({{12}, {17, 5}, {8}}, 3, 2, GetParam())), 7, 150);
}

INSTANTIATE_TEST_SUITE_P(All, GradientOfActivation,
                         testing::Values(nn::Activation::kLinear, nn::Activation::kTanh, nn::Activation::kRelu,
                                         nn::Activation::kSigmoid, nn::Activation::kElu, nn::Activation::kLeakyRelu,
                                         nn::Activation::kSilu, nn::Activation::kSoftplus),
                         [](const auto& activation) { return std::string(nn::NameOf(activation.param)); });

TEST(Gradient, MatchesDifferencesAtOddSizes) {
  for (const std::int64_t size : {1, 3, 5, 17, 64, 100}) {
    SCOPED_TRACE(size);
    ExpectGradient(MustCreate(Towers({{}, {size, size}, {size}}, size, 3, nn::Activation::kTanh)), 5, 60);
  }
}

TEST(Gradient, MatchesDifferencesOverSeveralBlocks) {
  for (const std::int64_t rows : {1, 63, 64, 65, 130, 700}) {
    ExpectGradient(MustCreate(Towers({{4}, {9}, {6}}, 2, 2, nn::Activation::kTanh)), rows, 25);
  }
}

TEST(Gradient, OfAnOutputThatOthersReadAndOfTwoInputs) {
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 6}, {"goal", 3}};
  spec.blocks = {Dense("a", "obs", 6, 9, nn::Activation::kSilu), Dense("b", "a", 9, 5, nn::Activation::kTanh),
                 Dense("c", "a", 9, 4, nn::Activation::kElu), Dense("g", "goal", 3, 2, nn::Activation::kSigmoid)};
  spec.outputs = {"a", "b", "c", "g"};
  ExpectGradient(MustCreate(spec), 9, 200);
}

// Where one dense block alone reads what another's relu gave, its gradient goes through that as it is written.
TEST(Gradient, ThroughReluOnceWhoeverReadsIt) {
  constexpr nn::Activation kRelu = nn::Activation::kRelu;
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 6}};
  spec.blocks = {Dense("a", "obs", 6, 9, kRelu), Dense("b", "a", 9, 9, kRelu),
                 Dense("c", "b", 9, 2, nn::Activation::kTanh)};
  for (const std::vector<std::string>& outputs : {std::vector<std::string>{"c"}, {"a", "c"}, {"b", "c"}, {"a"}}) {
    spec.outputs = outputs;
    ExpectGradient(MustCreate(spec), 7, 200);
  }
  spec.blocks.push_back(Dense("d", "a", 9, 3, nn::Activation::kTanh));
  spec.outputs = {"c", "d"};
  ExpectGradient(MustCreate(spec), 7, 200);
  nn::Block other;  // a reader of another kind, whose gradient is added behind
  other.op = "layer_norm";
  other.inputs = {"a"};
  other.output = other.name = "n";
  spec.blocks = {Dense("a", "obs", 6, 9, kRelu), other, Dense("b", "a", 9, 2, nn::Activation::kTanh)};
  spec.outputs = {"n", "b"};
  ExpectGradient(MustCreate(spec), 7, 100);
  spec.blocks = {Dense("a", "obs", 6, 6, kRelu), Dense("b", "a", 6, 6, kRelu),
                 Dense("c", "b", 6, 2, nn::Activation::kTanh)};
  spec.blocks[1].shares = "a";
  spec.outputs = {"c"};
  ExpectGradient(MustCreate(spec), 7, 60);
}

TEST(Gradient, OfADuellingNetwork) {
  nn::QNetworkOptions options;
  options.layers = {7};
  options.duelling = true;
  options.activation = nn::Activation::kTanh;
  options.observation_size = 3;
  for (const std::int64_t actions : {1, 2, 5}) {
    options.action_count = actions;
    ExpectGradient(MustCreate(nn::QNetwork(options)), 70, 200);
  }
}

// Both uses of a layer add to one gradient, whichever is reached first, and whether or not the other is reached at all.
TEST(Gradient, OfParametersUsedTwice) {
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 4}, {"goal", 4}};
  spec.blocks = {Dense("a", "obs", 4, 4, nn::Activation::kTanh), Dense("b", "goal", 4, 4, nn::Activation::kTanh),
                 Dense("c", "a", 4, 4, nn::Activation::kTanh), Dense("d", "b", 4, 2, nn::Activation::kTanh)};
  spec.blocks[1].shares = spec.blocks[2].shares = "a";
  spec.outputs = {"c", "d"};
  ExpectGradient(MustCreate(spec), 130, 200);
  spec.outputs = {"d"};
  ExpectGradient(MustCreate(spec), 9, 200);
}

TEST(Gradient, OfABlockThatNoOutputReadsIsZero) {
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 4}};
  spec.blocks = {Dense("used", "obs", 4, 3, nn::Activation::kTanh), Dense("idle", "used", 3, 2, nn::Activation::kTanh)};
  spec.outputs = {"used"};
  const nn::Network network = MustCreate(spec);
  QuadraticLoss loss(network, 5, 1);
  Backpropagation backpropagation(network, 0, 5);
  backpropagation.Run(RandomParameters(network, 0), 5, Executor(), loss);
  EXPECT_NE(backpropagation.gradient()[0], 0.0f);
  for (std::size_t i = 15; i < 23; ++i) EXPECT_EQ(backpropagation.gradient()[i], 0.0f);
}

/// Runs blocks on `user` threads, last index first.
void RunBackwardsOnThreads(void* user, std::int64_t count, void (*task)(void*, std::int64_t), void* context) {
  const std::int64_t threads = *static_cast<std::int64_t*>(user);
  std::vector<std::thread> running;
  for (std::int64_t t = 0; t < threads; ++t) {
    running.emplace_back([=] {
      for (std::int64_t i = count - 1 - t; i >= 0; i -= threads) task(context, i);
    });
  }
  for (std::thread& thread : running) thread.join();
}

TEST(Gradient, AnyNumberOfThreadsGivesTheSameBits) {
  const nn::Network network = MustCreate(Towers({{}, {64, 64}, {64, 64}}, 4, 2, nn::Activation::kTanh));
  const std::vector<float> parameters = RandomParameters(network, 1);
  constexpr std::int64_t kRows = 2000;
  QuadraticLoss loss(network, kRows, 2);
  Backpropagation backpropagation(network, 1, kRows);
  backpropagation.Run(parameters, kRows, Executor(), loss);
  const std::vector<float> alone(backpropagation.gradient().begin(), backpropagation.gradient().end());
  for (std::int64_t threads : {1, 2, 5}) {
    backpropagation.Run(parameters, kRows, Executor{RunBackwardsOnThreads, &threads}, loss);
    EXPECT_EQ(std::memcmp(alone.data(), backpropagation.gradient().data(), alone.size() * sizeof(float)), 0) << threads;
  }
}

// What one packs, an evaluator and another backpropagation run, whatever was packed before.
TEST(Gradient, APackingMayBeShared) {
  const nn::Network network = MustCreate(Towers({{8}, {40, 8}, {8}}, 4, 2, nn::Activation::kTanh));
  QuadraticLoss loss(network, 70, 2);
  Backpropagation owner(network, 0, 70), alone(network, {.max_rows = 70, .input_gradients = true});
  Backpropagation guest(network, {.max_rows = 70, .input_gradients = true, .packed = owner.packed()});
  nn::Evaluator evaluator(owner.packed(), 1), fresh(network, 1);
  const float observation[] = {0.1f, -0.2f, 0.3f, -0.4f};
  const float* inputs[] = {observation};
  std::vector<float> parameters = RandomParameters(network, 0);
  for (int change = 0; change < 2; ++change) {
    for (float& parameter : parameters) parameter *= 1.5f;
    owner.Load(parameters);
    guest.Run(parameters, 70, Executor(), loss);
    alone.Run(parameters, 70, Executor(), loss);
    owner.RunLoaded(70, Executor(), loss);
    const std::size_t bytes = alone.gradient().size_bytes();
    EXPECT_EQ(std::memcmp(guest.gradient().data(), alone.gradient().data(), bytes), 0);
    EXPECT_EQ(std::memcmp(owner.gradient().data(), alone.gradient().data(), bytes), 0);
    fresh.Load(parameters);
    fresh.Forward(inputs, 1);
    evaluator.Forward(inputs, 1);
    EXPECT_EQ(std::memcmp(evaluator.output(0), fresh.output(0), 2 * sizeof(float)), 0);
  }
}

TEST(Gradient, RunsSmallerMinibatchesAfterLargerOnes) {
  const nn::Network network = MustCreate(Towers({{8}, {8}, {8}}, 4, 2, nn::Activation::kTanh));
  const std::vector<float> parameters = RandomParameters(network, 0);
  QuadraticLoss loss(network, 2048, 2);
  Backpropagation large(network, 0, 2048), exact(network, 0, 20);
  large.Run(parameters, 2048, Executor(), loss);
  large.Run(parameters, 20, Executor(), loss);
  exact.Run(parameters, 20, Executor(), loss);
  EXPECT_EQ(std::memcmp(large.gradient().data(), exact.gradient().data(), exact.gradient().size_bytes()), 0);
}

TEST(GradientOps, EveryBlockKindHasItsBackward) {
  for (const std::string_view name : nn::OpNames()) EXPECT_NE(FindGradientOp(name), nullptr) << name;
}

}  // namespace
}  // namespace consac::learn
