// Every kind of block against float64 loops, what each refuses, and images on their way into a network.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "consac/nn/features.h"
#include "consac/nn/net_arch.h"
#include "consac/nn/ops.h"
#include "core/test/nn/reference_blocks.h"

namespace consac::nn {
namespace {

using testing::HasSubstr;

/// A network of one block over inputs of these shapes.
NetworkSpec OneBlock(Block block, const std::vector<Shape>& inputs) {
  NetworkSpec spec;
  block.inputs.clear();
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    spec.inputs.push_back({"x" + std::to_string(i), SizeOf(inputs[i]), inputs[i]});
    block.inputs.push_back(spec.inputs.back().name);
  }
  block.output = block.name = "y";
  spec.blocks = {std::move(block)};
  spec.outputs = {"y"};
  return spec;
}

Block Convolution(Shape kernel, Shape stride, std::int64_t filters, Activation activation = Activation::kRelu) {
  Block block{.op = "convolution", .inputs = {}, .output = "", .name = "", .activation = activation};
  block.attributes.SetIntegers("kernel", kernel);
  block.attributes.SetIntegers("stride", stride);
  block.attributes.SetInteger("filters", filters);
  return block;
}

/// Runs `rows` random rows and compares each with the reference, and each alone with itself among the others.
void ExpectReference(const NetworkSpec& spec, std::int64_t rows = 5) {
  const Result<Network> network = Network::Create(spec);
  ASSERT_TRUE(network.ok()) << network.status().message();
  std::vector<float> parameters(static_cast<std::size_t>(network->parameter_count()));
  Rng rng(7, 7);
  for (float& value : parameters) value = 0.3f * rng.Normal();
  const std::vector<double> exact(parameters.begin(), parameters.end());
  std::vector<std::vector<float>> inputs;
  std::vector<const float*> pointers;
  for (const Port& port : network->spec().inputs) {
    inputs.emplace_back(static_cast<std::size_t>(rows * port.size));
    for (float& value : inputs.back()) value = rng.Normal();
    pointers.push_back(inputs.back().data());
  }
  Evaluator evaluator(*network, rows), alone(*network, 1);
  evaluator.Load(parameters);
  alone.Load(parameters);
  evaluator.Forward(pointers, rows);
  const std::int64_t size = network->output_size(0);
  for (std::int64_t r = 0; r < rows; ++r) {
    std::vector<std::vector<double>> row;
    std::vector<const float*> one;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const std::int64_t width = network->spec().inputs[i].size;
      one.push_back(pointers[i] + r * width);
      row.emplace_back(one.back(), one.back() + width);
    }
    const std::vector<double> expected = ReferenceBlock(network->blocks()[0], exact.data(), row);
    ASSERT_EQ(static_cast<std::int64_t>(expected.size()), size);
    for (std::int64_t i = 0; i < size; ++i)
      ASSERT_NEAR(evaluator.output(0)[r * size + i], expected[static_cast<std::size_t>(i)], 2e-4) << r << " " << i;
    alone.Forward(one, 1);
    ASSERT_EQ(std::memcmp(alone.output(0), evaluator.output(0) + r * size, static_cast<std::size_t>(size) * 4), 0) << r;
  }
}

std::string Refusal(const NetworkSpec& spec) {
  return Network::Create(spec).status().message();
}

TEST(ConvolutionBlock, IsTheSumOverItsKernel) {
  ExpectReference(OneBlock(Convolution({3, 2}, {2, 1}, 5), {{9, 7, 3}}));
  ExpectReference(OneBlock(Convolution({1, 1}, {1, 1}, 1), {{4, 4, 1}}), 70);
  ExpectReference(OneBlock(Convolution({8, 8}, {4, 4}, 32), {{36, 44, 4}}), 2);
  ExpectReference(OneBlock(Convolution({4, 4}, {2, 2}, 64, Activation::kSilu), {{20, 20, 32}}), 1);
  Block first = Convolution({3, 2}, {2, 3}, 6, Activation::kTanh);
  first.attributes.SetText("layout", "CHW");
  ExpectReference(OneBlock(first, {{3, 9, 8}}));
}

TEST(ConvolutionBlock, SaysWhatItCannotBe) {
  EXPECT_THAT(Refusal(OneBlock(Convolution({9, 3}, {1, 1}, 2), {{8, 8, 1}})), HasSubstr("9 x 3 does not fit"));
  EXPECT_THAT(Refusal(OneBlock(Convolution({3, 3}, {0, 1}, 2), {{8, 8, 1}})), HasSubstr("stride"));
  EXPECT_THAT(Refusal(OneBlock(Convolution({3}, {1, 1}, 2), {{8, 8, 1}})), HasSubstr("kernel"));
  EXPECT_THAT(Refusal(OneBlock(Convolution({3, 3}, {1, 1}, 0), {{8, 8, 1}})), HasSubstr("filters"));
  EXPECT_THAT(Refusal(OneBlock(Convolution({3, 3}, {1, 1}, 2), {{64}})), HasSubstr("three sizes, not of 1"));
  Block layout = Convolution({3, 3}, {1, 1}, 2);
  layout.attributes.SetText("layout", "HCW");
  EXPECT_THAT(Refusal(OneBlock(layout, {{8, 8, 1}})), HasSubstr("HCW"));
  EXPECT_THAT(Refusal(OneBlock(Convolution({1, 1}, {1, 1}, 1 << 16), {{64, 64, 1}})), HasSubstr("at most"));
}

TEST(LayerNormBlock, BringsEachRowToMeanZeroAndDeviationOne) {
  for (const Activation activation : {Activation::kLinear, Activation::kRelu, Activation::kSilu}) {
    Block block{.op = "layer_norm", .inputs = {}, .output = "", .name = "", .activation = activation};
    ExpectReference(OneBlock(block, {{17}}), 70);
    block.attributes.SetNumber("epsilon", 0.5);
    ExpectReference(OneBlock(block, {{2, 3, 4}}));
  }
  Block block{.op = "layer_norm", .inputs = {}, .output = "", .name = ""};
  block.attributes.SetNumber("epsilon", 0.0);
  EXPECT_THAT(Refusal(OneBlock(block, {{17}})), HasSubstr("epsilon"));
}

TEST(LayerNormBlock, StartsAsTheIdentityOfNormalRows) {
  const Result<Network> network =
      Network::Create(OneBlock({.op = "layer_norm", .inputs = {}, .output = "", .name = ""}, {{3}}));
  std::vector<float> parameters(6);
  Rng rng(1);
  network->Initialise(rng, parameters);
  EXPECT_THAT(parameters, testing::ElementsAre(1, 1, 1, 0, 0, 0));
}

TEST(ShapingBlocks, MoveNumbers) {
  ExpectReference(OneBlock({.op = "flatten", .inputs = {}, .output = "", .name = ""}, {{3, 4, 2}}));
  ExpectReference(OneBlock({.op = "concatenation", .inputs = {}, .output = "", .name = ""}, {{3}, {2, 2}, {1}}), 70);
  Block slice{.op = "slice", .inputs = {}, .output = "", .name = ""};
  slice.attributes.SetInteger("offset", 2);
  slice.attributes.SetIntegers("shape", Shape{2, 3});
  slice.attributes.SetNumber("divide_by", 255.0);
  ExpectReference(OneBlock(slice, {{9}}));
  slice.attributes.SetInteger("offset", 4);
  EXPECT_THAT(Refusal(OneBlock(slice, {{9}})), HasSubstr("within 9 features"));
  slice.attributes.SetInteger("offset", 0);
  slice.attributes.SetNumber("divide_by", 0.0);
  EXPECT_THAT(Refusal(OneBlock(slice, {{9}})), HasSubstr("divide_by"));
}

Layout LayoutOf(const Result<Space>& space) {
  EXPECT_TRUE(space.ok());
  return Layout::Of(*space);
}

TEST(Features, WithoutImagesTheObservationIsWhatTheLayersRead) {
  NetworkSpec spec;
  const auto port = AddFeatures(LayoutOf(Space::Box(-1, 1, {5})), {}, &spec);
  ASSERT_TRUE(port.ok());
  EXPECT_EQ(port->name, "obs");
  EXPECT_TRUE(spec.blocks.empty());
  EXPECT_FALSE(HasImage(LayoutOf(Space::Box(0, 255, {5}, DType::kU8))));
  EXPECT_FALSE(HasImage(LayoutOf(Space::Box(0, 1, {8, 8, 3}))));
}

// 84 x 84 x 4: the network of Mnih et al. with 1,684,128 parameters before the actions, as Stable Baselines3 has it.
TEST(Features, TheNatureNetworkHasTheParametersOfThePaper) {
  QNetworkOptions options;
  options.layers = {};
  options.action_count = 6;
  for (const Shape& shape : {Shape{84, 84, 4}, Shape{4, 84, 84}}) {
    const auto spec =
        QNetwork(LayoutOf(Space::Box(0, 255, shape, DType::kU8)), options, {.extractor = Extractor::kNatureCnn});
    ASSERT_TRUE(spec.ok()) << spec.status().message();
    const auto network = Network::Create(*spec);
    ASSERT_TRUE(network.ok()) << network.status().message();
    EXPECT_EQ(network->parameter_count(), 1684128 + 512 * 6 + 6);
    EXPECT_EQ(network->blocks()[3].out_shape, (Shape{7, 7, 64}));
  }
}

// Images are worked on a few at a time, whatever their number.
TEST(Features, AnImageGivesTheSameBitsAmongManyAsAlone) {
  QNetworkOptions options;
  options.layers = {16};
  options.action_count = 3;
  const Layout layout = LayoutOf(Space::Box(0, 255, {50, 48, 3}, DType::kU8));
  const auto network = Network::Create(*QNetwork(layout, options, {.extractor = Extractor::kNatureCnn}));
  ASSERT_TRUE(network.ok()) << network.status().message();
  std::vector<float> parameters(static_cast<std::size_t>(network->parameter_count()));
  Rng rng(1, 1);
  network->Initialise(rng, parameters);
  constexpr std::int64_t kRows = 71;  // a whole group, part of another, and not whole fours
  const auto size = static_cast<std::size_t>(layout.feature_count);
  std::vector<float> images(kRows * size);
  for (float& value : images) value = static_cast<float>(rng.Below(256));
  Evaluator many(*network, kRows), one(*network, 1);
  many.Load(parameters);
  one.Load(parameters);
  const float* all = images.data();
  many.Forward({&all, 1}, kRows);
  for (std::size_t r = 0; r < kRows; ++r) {
    const float* image = images.data() + r * size;
    one.Forward({&image, 1}, 1);
    for (std::size_t a = 0; a < 3; ++a) ASSERT_EQ(many.output(0)[r * 3 + a], one.output(0)[a]) << r;
  }
}

TEST(Features, ImagesAreDividedBy255AndTheRestIsAsItIs) {
  const Space space = *Space::Dict({{"camera", *Space::Box(0, 255, {2, 2, 1}, DType::kU8)},
                                    {"gear", *Space::Discrete(3)},
                                    {"speed", *Space::Box(-1, 1, {1})}});
  NetworkSpec spec;
  const auto port = AddFeatures(Layout::Of(space), {}, &spec);
  ASSERT_TRUE(port.ok()) << port.status().message();
  spec.outputs = {port->name};
  const auto network = Network::Create(spec);
  ASSERT_TRUE(network.ok()) << network.status().message();
  Evaluator evaluator(*network, 1);
  const float row[] = {0, 51, 102, 255, 0, 1, 0, -0.5f};
  const float* input = row;
  evaluator.Forward({&input, 1}, 1);
  EXPECT_THAT(std::span(evaluator.output(0), 8),
              testing::ElementsAre(0, 51.0f / 255.0f, 102.0f / 255.0f, 1, 0, 1, 0, -0.5f));
}

TEST(Features, ImagesThatAreTooSmallAreNamed) {
  NetworkSpec spec;
  const auto port =
      AddFeatures(LayoutOf(Space::Box(0, 255, {35, 84, 3}, DType::kU8)), {.extractor = Extractor::kNatureCnn}, &spec);
  EXPECT_THAT(port.status().message(), AllOf(HasSubstr("too small for CnnPolicy"), HasSubstr("36")));
}

}  // namespace
}  // namespace consac::nn
