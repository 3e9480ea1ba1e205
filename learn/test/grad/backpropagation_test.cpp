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
#include "learn/test/grad/reference_network.h"

namespace consac::learn {
namespace {

/// loss = sum over rows and outputs of (weight y + y^2 / 2), plus the extra parameters' own sum of row counts.
class QuadraticLoss final : public BlockLoss {
 public:
  QuadraticLoss(const nn::Network& network, std::int64_t rows, std::uint64_t seed) : network_(network) {
    Rng rng(seed, StreamId("quadratic_loss"));
    for (const nn::Port& input : network.spec().inputs) {
      auto& data = inputs_.emplace_back(static_cast<std::size_t>(rows * input.size));
      for (float& value : data) value = rng.Normal();
    }
  }

  void Gather(const LossBlock& block) override {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const std::int64_t size = network_.spec().inputs[i].size;
      std::memcpy(block.inputs[i], inputs_[i].data() + block.first_row * size,
                  static_cast<std::size_t>(block.rows * size) * sizeof(float));
    }
  }

  void Loss(const LossBlock& block) override {
    for (std::size_t o = 0; o < block.outputs.size(); ++o) {
      for (std::int64_t i = 0; i < block.rows * network_.output_size(o); ++i) {
        block.output_gradients[o][i] = Weight(o) + block.outputs[o][i];
      }
    }
    for (float& value : block.extra_gradient) value += static_cast<float>(block.rows);
  }

  double InFloat64(const std::vector<double>& parameters, std::int64_t rows) const {
    double loss = 0.0;
    for (std::int64_t r = 0; r < rows; ++r) {
      std::vector<std::vector<double>> row;
      for (std::size_t i = 0; i < inputs_.size(); ++i) {
        const std::int64_t size = network_.spec().inputs[i].size;
        row.emplace_back(inputs_[i].begin() + r * size, inputs_[i].begin() + (r + 1) * size);
      }
      const auto outputs = ReferenceForward(network_, parameters, row);
      for (std::size_t o = 0; o < outputs.size(); ++o) {
        for (const double y : outputs[o]) loss += static_cast<double>(Weight(o)) * y + 0.5 * y * y;
      }
    }
    return loss;
  }

 private:
  static float Weight(std::size_t output) { return 0.7f - 0.4f * static_cast<float>(output); }

  const nn::Network& network_;
  std::vector<std::vector<float>> inputs_;
};

nn::Network MustCreate(nn::NetworkSpec spec) {
  Result<nn::Network> network = nn::Network::Create(std::move(spec));
  EXPECT_TRUE(network.ok()) << network.status().message();
  return *std::move(network);
}

std::vector<float> RandomParameters(const nn::Network& network, std::int64_t extra) {
  std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count() + extra));
  Rng rng(21, StreamId("parameters"));
  network.Initialise(rng, std::span(parameters).first(static_cast<std::size_t>(network.parameter_count())));
  for (float& value : parameters) value += 0.05f * rng.Normal();
  return parameters;
}

/// Relative L2 distance between Run's gradient and central differences over at most `samples` parameters.
void ExpectGradient(const nn::Network& network, std::int64_t rows, int samples) {
  QuadraticLoss loss(network, rows, 5);
  const std::vector<float> parameters = RandomParameters(network, 2);
  Backpropagation backpropagation(network, 2, rows + 10);
  backpropagation.Run(parameters, rows, Executor(), loss);
  std::vector<double> at(parameters.begin(), parameters.end());
  const std::int64_t stride = std::max<std::int64_t>(1, network.parameter_count() / samples);
  double difference = 0.0, norm = 0.0;
  for (std::int64_t p = 0; p < network.parameter_count(); p += stride) {
    const auto i = static_cast<std::size_t>(p);
    const double centre = at[i];
    at[i] = centre + 1e-5;
    const double above = loss.InFloat64(at, rows);
    at[i] = centre - 1e-5;
    const double below = loss.InFloat64(at, rows);
    at[i] = centre;
    const double slope = (above - below) / 2e-5;
    const double got = backpropagation.gradient()[i];
    difference += (got - slope) * (got - slope);
    norm += slope * slope;
  }
  EXPECT_LT(std::sqrt(difference), 3e-5 * std::sqrt(norm) + 1e-7) << rows << " rows";
  EXPECT_GT(norm, 0.0);
  for (const float extra : backpropagation.gradient().last(2)) EXPECT_EQ(extra, static_cast<float>(rows));
}

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

nn::Block Dense(std::string name, std::string from, std::int64_t in, std::int64_t out, nn::Activation activation) {
  nn::Block block;
  block.output = name;
  block.name = std::move(name);
  block.inputs = {std::move(from)};
  block.in_size = in;
  block.out_size = out;
  block.activation = activation;
  return block;
}

TEST(Gradient, OfAnOutputThatOthersReadAndOfTwoInputs) {
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 6}, {"goal", 3}};
  spec.blocks = {Dense("a", "obs", 6, 9, nn::Activation::kSilu), Dense("b", "a", 9, 5, nn::Activation::kTanh),
                 Dense("c", "a", 9, 4, nn::Activation::kElu), Dense("g", "goal", 3, 2, nn::Activation::kSigmoid)};
  spec.outputs = {"a", "b", "c", "g"};
  ExpectGradient(MustCreate(spec), 9, 200);
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
