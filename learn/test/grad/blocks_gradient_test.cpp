// Gradients of each kind of block against float64 finite differences: of parameters, of inputs, of some parameters
// alone, along a tangent; and what an observer sees.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "consac/nn/features.h"
#include "consac/nn/net_arch.h"
#include "learn/test/grad/quadratic_loss.h"

namespace consac::learn {
namespace {

using nn::Activation;

nn::Block Named(std::string op, std::vector<std::string> inputs, std::string name,
                Activation activation = Activation::kLinear) {
  return {.op = std::move(op), .inputs = std::move(inputs), .output = name, .name = name, .activation = activation};
}

nn::Block Convolution(std::string from, std::string name, std::int64_t kernel, std::int64_t stride,
                      std::int64_t filters, Activation activation) {
  nn::Block block = Named("convolution", {std::move(from)}, std::move(name), activation);
  block.attributes.SetIntegers("kernel", nn::Shape{kernel, kernel});
  block.attributes.SetIntegers("stride", nn::Shape{stride, stride});
  block.attributes.SetInteger("filters", filters);
  return block;
}

/// Two convolutions of a small image cut out of the observation, beside the rest of it.
nn::NetworkSpec SmallCnn(Activation activation, bool channels_first) {
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 9 * 8 * 2 + 3}};
  nn::Block image = Named("slice", {"obs"}, "image"), rest = Named("slice", {"obs"}, "rest");
  image.attributes.SetIntegers("shape", channels_first ? nn::Shape{2, 9, 8} : nn::Shape{9, 8, 2});
  image.attributes.SetNumber("divide_by", 2.0);
  rest.attributes.SetInteger("offset", 144);
  rest.attributes.SetIntegers("shape", nn::Shape{3});
  nn::Block first = Convolution("image", "c0", 3, 2, 5, activation);
  if (channels_first) first.attributes.SetText("layout", "CHW");
  spec.blocks = {image,
                 rest,
                 first,
                 Convolution("c0", "c1", 2, 1, 4, activation),
                 Named("flatten", {"c1"}, "flat"),
                 Named("concatenation", {"rest", "flat", "rest"}, "all"),
                 Dense("y", "all", 30, 3, activation)};
  spec.outputs = {"y", "c0"};
  return spec;
}

/// Dense layers with norms in between.
nn::NetworkSpec Normed(Activation activation) {
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 4}};
  spec.blocks = {Dense("a", "obs", 4, 9, Activation::kLinear), Named("layer_norm", {"a"}, "an", activation),
                 Dense("b", "an", 9, 6, activation), Named("layer_norm", {"b"}, "bn"),
                 Dense("y", "bn", 6, 2, activation)};
  spec.outputs = {"y", "an"};
  return spec;
}

TEST(ConvolutionGradient, MatchesDifferences) {
  for (const Activation activation : {Activation::kTanh, Activation::kSilu}) {
    for (const bool channels_first : {false, true})
      ExpectGradient(MustCreate(SmallCnn(activation, channels_first)), 3, 250);
  }
  ExpectGradient(MustCreate(SmallCnn(Activation::kTanh, false)), 66, 60);
}

TEST(LayerNormGradient, MatchesDifferences) {
  for (const Activation activation : {Activation::kTanh, Activation::kSilu, Activation::kLinear})
    ExpectGradient(MustCreate(Normed(activation)), 70, 200);
}

/// Keeps what InputGradients is told.
class InputLoss final : public QuadraticLoss {
 public:
  using QuadraticLoss::QuadraticLoss;
  void InputGradients(const LossBlock& block) override {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const std::int64_t size = network_.spec().inputs[i].size;
      gradients[{i, block.first_row}].assign(block.input_gradients[i], block.input_gradients[i] + block.rows * size);
    }
  }
  std::vector<std::vector<float>>& inputs() { return inputs_; }
  std::map<std::pair<std::size_t, std::int64_t>, std::vector<float>> gradients;
};

void ExpectInputGradient(const nn::Network& network, std::int64_t rows) {
  InputLoss loss(network, rows, 5);
  const std::vector<float> parameters = RandomParameters(network, 0);
  const std::vector<double> exact(parameters.begin(), parameters.end());
  Backpropagation backpropagation(network, {.max_rows = rows, .input_gradients = true});
  backpropagation.Run(parameters, rows, Executor(), loss);
  for (std::size_t i = 0; i < network.spec().inputs.size(); ++i) {
    const std::int64_t size = network.spec().inputs[i].size;
    for (std::int64_t e = 0; e < rows * size; e += std::max<std::int64_t>(1, rows * size / 60)) {
      float& x = loss.inputs()[i][static_cast<std::size_t>(e)];
      const float kept = x;
      const std::int64_t row = e / size, first = row / kBlockRows * kBlockRows;
      x = kept + 1e-3f;
      const double above = loss.InFloat64(exact, rows), high = x;
      x = kept - 1e-3f;
      const double below = loss.InFloat64(exact, rows), low = x;
      x = kept;
      const double slope = (above - below) / (high - low);
      const float got = loss.gradients[{i, first}][static_cast<std::size_t>(e - first * size)];
      EXPECT_NEAR(got, slope, 2e-3 * (1.0 + std::abs(slope))) << i << " " << e;
    }
  }
}

TEST(InputGradients, MatchDifferences) {
  ExpectInputGradient(MustCreate(SmallCnn(Activation::kTanh, true)), 3);
  ExpectInputGradient(MustCreate(SmallCnn(Activation::kSilu, false)), 3);
  ExpectInputGradient(MustCreate(Normed(Activation::kTanh)), 70);
  nn::NetworkSpec spec;  // a critic of states and actions
  spec.inputs = {{"obs", 3}, {"action", 2}};
  spec.blocks = {Named("concatenation", {"obs", "action"}, "both"), Dense("h", "both", 5, 8, Activation::kTanh),
                 Dense("q", "h", 8, 1, Activation::kLinear)};
  spec.outputs = {"q"};
  ExpectInputGradient(MustCreate(spec), 130);
}

// An actor that learns through a critic that stays: one network, a part of whose parameters has gradients. What they
// are is what they are without the limit; the others' are 0.
TEST(HeldFastParameters, HaveNoGradientAndLetTheOthersThrough) {
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 3}};
  spec.blocks = {Dense("actor", "obs", 3, 2, Activation::kTanh), Named("concatenation", {"obs", "actor"}, "both"),
                 Dense("critic", "both", 5, 6, Activation::kTanh), Dense("q", "critic", 6, 1, Activation::kLinear)};
  spec.outputs = {"q"};
  const nn::Network network = MustCreate(spec);
  const std::vector<float> parameters = RandomParameters(network, 0);
  QuadraticLoss loss(network, 70, 2);
  Backpropagation all(network, 0, 70);
  Backpropagation actor(network, {.max_rows = 70, .parameter_count = 8});
  Backpropagation critic(network, {.max_rows = 70, .first_parameter = 8});
  all.Run(parameters, 70, Executor(), loss);
  actor.Run(parameters, 70, Executor(), loss);
  critic.Run(parameters, 70, Executor(), loss);
  for (std::size_t i = 0; i < all.gradient().size(); ++i) {
    EXPECT_NE(all.gradient()[i], 0.0f) << i;
    EXPECT_EQ(actor.gradient()[i], i < 8 ? all.gradient()[i] : 0.0f) << i;
    EXPECT_EQ(critic.gradient()[i], i < 8 ? 0.0f : all.gradient()[i]) << i;
  }
}

/// Keeps the outputs' tangents and uses them as gradients: J^T J v.
class TangentLoss final : public QuadraticLoss {
 public:
  using QuadraticLoss::QuadraticLoss;
  void Loss(const LossBlock& block) override {
    for (std::size_t o = 0; o < block.outputs.size(); ++o) {
      const std::int64_t size = network_.output_size(o);
      for (std::int64_t i = 0; i < block.rows * size; ++i) {
        block.output_gradients[o][i] = block.output_tangents[o][i];
        tangents[{o, block.first_row * size + i}] = block.output_tangents[o][i];
      }
    }
  }
  std::vector<double> Row(std::size_t output, std::int64_t row, const std::vector<double>& parameters) const {
    std::vector<std::vector<double>> x;
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const std::int64_t size = network_.spec().inputs[i].size;
      x.emplace_back(inputs_[i].begin() + row * size, inputs_[i].begin() + (row + 1) * size);
    }
    return ReferenceForward(network_, parameters, x)[output];
  }
  std::map<std::pair<std::size_t, std::int64_t>, float> tangents;
};

void ExpectTangent(const nn::Network& network, std::int64_t rows) {
  ASSERT_TRUE(Backpropagation::HasTangent(network));
  TangentLoss loss(network, rows, 5);
  const std::vector<float> parameters = RandomParameters(network, 0);
  std::vector<float> direction(parameters.size());
  Rng rng(3, 9);
  for (float& value : direction) value = rng.Normal();
  Backpropagation backpropagation(network, {.max_rows = rows, .tangents = true});
  backpropagation.RunAlong(parameters, direction, rows, Executor(), loss);
  std::vector<double> above(parameters.begin(), parameters.end()), below = above;
  for (std::size_t i = 0; i < direction.size(); ++i) {
    above[i] += 1e-5 * static_cast<double>(direction[i]);
    below[i] -= 1e-5 * static_cast<double>(direction[i]);
  }
  double squares = 0.0;
  for (std::size_t o = 0; o < network.spec().outputs.size(); ++o) {
    for (std::int64_t r = 0; r < rows; ++r) {
      const std::vector<double> high = loss.Row(o, r, above), low = loss.Row(o, r, below);
      for (std::size_t i = 0; i < high.size(); ++i) {
        const double slope = (high[i] - low[i]) / 2e-5;
        const float got = loss.tangents[{o, r * network.output_size(o) + static_cast<std::int64_t>(i)}];
        EXPECT_NEAR(got, slope, 1e-3 * (1.0 + std::abs(slope))) << o << " " << r << " " << i;
        squares += static_cast<double>(got) * got;
      }
    }
  }
  double product = 0.0;  // v^T J^T J v, both ways round
  for (std::size_t i = 0; i < direction.size(); ++i)
    product += static_cast<double>(direction[i]) * backpropagation.gradient()[i];
  EXPECT_NEAR(product, squares, 1e-3 * squares);
}

TEST(Tangent, MatchesDifferencesAndIsTheTransposeOfTheGradient) {
  ExpectTangent(MustCreate(SmallCnn(Activation::kTanh, false)), 3);
  ExpectTangent(MustCreate(SmallCnn(Activation::kSilu, true)), 2);
  ExpectTangent(MustCreate(Normed(Activation::kTanh)), 70);
  ExpectTangent(MustCreate(Normed(Activation::kSilu)), 70);
  nn::QNetworkOptions options;
  options.layers = {7, 5};
  options.duelling = true;
  options.activation = Activation::kElu;
  options.observation_size = 3;
  options.action_count = 4;
  ExpectTangent(MustCreate(nn::QNetwork(options)), 130);
}

/// Adds up x dz^T and dz of one step, as Kronecker factors are made.
class OuterProducts final : public BlockObserver {
 public:
  void Observe(const LossBlock& block, std::size_t step, const float* x, std::int64_t x_stride, const float* dz,
               std::int64_t dz_stride) override {
    for (std::int64_t r = 0; step == 1 && r < block.rows; ++r) {
      for (std::int64_t o = 0; o < 3; ++o) {
        for (std::int64_t i = 0; i < 4; ++i) sums[o * 4 + i] += double{dz[r * dz_stride + o]} * x[r * x_stride + i];
        sums[12 + o] += double{dz[r * dz_stride + o]};
      }
    }
  }
  double sums[15] = {};
};

TEST(BlockObservers, SeeWhatTheGradientIsMadeOf) {
  nn::NetworkSpec spec;
  spec.inputs = {{"obs", 2}};
  spec.blocks = {Dense("a", "obs", 2, 4, Activation::kTanh), Dense("b", "a", 4, 3, Activation::kTanh)};
  spec.outputs = {"b"};
  const nn::Network network = MustCreate(spec);
  QuadraticLoss loss(network, 100, 2);
  OuterProducts observer;
  Backpropagation backpropagation(network, {.max_rows = 100, .observer = &observer});
  backpropagation.Run(RandomParameters(network, 0), 100, Executor(), loss);
  for (std::size_t i = 0; i < 15; ++i) EXPECT_NEAR(observer.sums[i], backpropagation.gradient()[12 + i], 1e-3) << i;
}

}  // namespace
}  // namespace consac::learn
