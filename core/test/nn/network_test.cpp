// Checks at creation, initial values, and the evaluator.
#include "consac/nn/network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "consac/nn/activations.h"
#include "consac/nn/net_arch.h"
#include "consac/nn/ops.h"

namespace consac::nn {
namespace {

using testing::HasSubstr;

NetworkSpec SmallActorCritic(std::vector<std::int64_t> shared = {}, std::vector<std::int64_t> tower = {64, 64}) {
  ActorCriticOptions options;
  options.arch = {std::move(shared), tower, tower};
  options.observation_size = 5;
  options.action_size = 3;
  return ActorCritic(options);
}

Network MustCreate(const NetworkSpec& spec) {
  Result<Network> network = Network::Create(spec);
  EXPECT_TRUE(network.ok()) << network.status().message();
  return *std::move(network);
}

std::string Fault(const NetworkSpec& spec) {
  return Network::Create(spec).status().message();
}

TEST(NetworkCreate, ListsParametersInArenaOrder) {
  const Network network = MustCreate(SmallActorCritic({7}, {6}));
  std::vector<std::string> names;
  std::int64_t offset = 0;
  for (const Parameter& parameter : network.parameters()) {
    names.push_back(parameter.name);
    EXPECT_EQ(parameter.offset, offset);
    offset += parameter.count;
  }
  EXPECT_THAT(names, testing::ElementsAre("shared/0/w", "shared/0/b", "pi/0/w", "pi/0/b", "pi/head/w", "pi/head/b",
                                          "vf/0/w", "vf/0/b", "vf/head/w", "vf/head/b"));
  EXPECT_EQ(network.parameter_count(), 5 * 7 + 7 + 7 * 6 + 6 + 6 * 3 + 3 + 7 * 6 + 6 + 6 + 1);
  EXPECT_EQ(network.parameters()[0].shape, (std::vector<std::int64_t>{7, 5}));
  EXPECT_EQ(network.output_size(0), 3);
  EXPECT_EQ(network.output_size(1), 1);
}

TEST(NetworkCreate, SaysWhatDoesNotFit) {
  NetworkSpec spec = SmallActorCritic();
  spec.blocks[0].op = "dens";
  EXPECT_THAT(Fault(spec), AllOf(HasSubstr("dens"), HasSubstr("dense"), HasSubstr("pi/0")));
  spec = SmallActorCritic();
  spec.blocks[1].in_size = 63;
  EXPECT_THAT(Fault(spec), AllOf(HasSubstr("pi/1"), HasSubstr("63"), HasSubstr("64")));
  spec = SmallActorCritic();
  spec.blocks[1].inputs = {"pi/7"};
  EXPECT_THAT(Fault(spec), AllOf(HasSubstr("pi/7"), HasSubstr("nothing before it writes")));
  spec = SmallActorCritic();
  spec.blocks[1].output = "pi/0";
  EXPECT_THAT(Fault(spec), HasSubstr("second time"));
  spec = SmallActorCritic();
  spec.blocks[1].name = "pi/0";
  EXPECT_THAT(Fault(spec), HasSubstr("two blocks are named"));
  spec = SmallActorCritic();
  spec.outputs.push_back("q");
  EXPECT_THAT(Fault(spec), HasSubstr("no block writes output"));
  spec = SmallActorCritic();
  spec.outputs.push_back("obs");
  EXPECT_THAT(Fault(spec), HasSubstr("is an input"));
  spec = SmallActorCritic();
  spec.outputs.push_back("pi");
  EXPECT_THAT(Fault(spec), HasSubstr("named twice"));
  spec = SmallActorCritic();
  spec.outputs.clear();
  EXPECT_THAT(Fault(spec), HasSubstr("no output"));
  spec = SmallActorCritic();
  spec.inputs[0].size = 0;
  EXPECT_THAT(Fault(spec), HasSubstr("0 features"));
  spec = SmallActorCritic();
  spec.inputs.push_back(spec.inputs[0]);
  EXPECT_THAT(Fault(spec), HasSubstr("two inputs"));
  spec = SmallActorCritic();
  spec.blocks[2].out_size = -4;
  EXPECT_THAT(Fault(spec), HasSubstr("-4"));
  spec.blocks[2].out_size = std::int64_t{1} << 40;
  EXPECT_THAT(Fault(spec), HasSubstr("widths go from 1"));
}

TEST(NetworkCreate, RefusesMoreParametersThanAnArenaHolds) {
  NetworkSpec spec;
  spec.inputs = {{"obs", 1 << 20}};
  Block block;
  block.name = block.output = "big";
  block.inputs = {"obs"};
  block.in_size = block.out_size = 1 << 20;
  spec.blocks = {block};
  spec.outputs = {"big"};
  EXPECT_THAT(Fault(spec), HasSubstr("parameters; at most"));
}

TEST(Activations, NamesRoundTrip) {
  for (int i = 0; i <= static_cast<int>(Activation::kSoftplus); ++i) {
    const auto activation = static_cast<Activation>(i);
    const Result<Activation> parsed = ParseActivation(NameOf(activation));
    ASSERT_TRUE(parsed.ok());
    EXPECT_EQ(*parsed, activation);
  }
  EXPECT_THAT(ParseActivation("tahn").status().message(),
              AllOf(HasSubstr("tahn"), HasSubstr("tanh"), HasSubstr("softplus")));
}

/// Largest difference between the smaller Gram matrix of a weight and gain^2 I.
double GramError(const std::vector<float>& w, std::int64_t out, std::int64_t in, double gain) {
  double worst = 0.0;
  const bool rows = out <= in;
  for (std::int64_t a = 0; a < (rows ? out : in); ++a) {
    for (std::int64_t b = 0; b <= a; ++b) {
      double sum = 0.0;
      for (std::int64_t k = 0; k < (rows ? in : out); ++k) {
        sum += rows ? static_cast<double>(w[a * in + k]) * w[b * in + k]
                    : static_cast<double>(w[k * in + a]) * w[k * in + b];
      }
      worst = std::max(worst, std::abs(sum - (a == b ? gain * gain : 0.0)));
    }
  }
  return worst;
}

TEST(Initialise, OrthogonalHasGainSquaredAsGram) {
  for (const auto& [out, in] : {std::pair{64, 4}, {64, 64}, {2, 64}, {100, 17}, {1, 1}}) {
    NetworkSpec spec;
    spec.inputs = {{"obs", in}};
    spec.blocks = {{"dense", {"obs"}, "y", "layer", in, out, Activation::kTanh, Init::kOrthogonal, 1.5f, {}, {}}};
    spec.outputs = {"y"};
    const Network network = MustCreate(spec);
    std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count()), 9.0f);
    Rng rng(3);
    network.Initialise(rng, parameters);
    EXPECT_LT(GramError(parameters, out, in, 1.5), 1e-5) << out << "x" << in;
    for (std::int64_t o = 0; o < out; ++o) EXPECT_EQ(parameters[static_cast<std::size_t>(out * in + o)], 0.0f);
  }
}

TEST(Initialise, UniformFormsFillTheirRange) {
  for (const auto& [init, bound] :
       {std::pair{Init::kXavierUniform, std::sqrt(6.0 / 164.0)}, {Init::kUniformFanIn, 0.125}}) {
    NetworkSpec spec;
    spec.inputs = {{"obs", 64}};
    spec.blocks = {{"dense", {"obs"}, "y", "layer", 64, 100, Activation::kTanh, init, 1.0f, {}, {}}};
    spec.outputs = {"y"};
    const Network network = MustCreate(spec);
    std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count()));
    Rng rng(3);
    network.Initialise(rng, parameters);
    double sum = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < 6400; ++i) {
      EXPECT_LE(std::abs(parameters[i]), bound * 1.000001);
      sum += parameters[i];
      squares += static_cast<double>(parameters[i]) * parameters[i];
    }
    EXPECT_NEAR(sum / 6400.0, 0.0, 0.05 * bound);
    EXPECT_NEAR(squares / 6400.0, bound * bound / 3.0, 0.05 * bound * bound);
    EXPECT_EQ(parameters[6400] != 0.0f, init == Init::kUniformFanIn);
  }
}

TEST(Initialise, OneSeedOneResult) {
  const Network network = MustCreate(SmallActorCritic());
  std::vector<float> a(static_cast<std::size_t>(network.parameter_count())), b = a, c = a;
  Rng first(5), again(5), other(6);
  network.Initialise(first, a);
  network.Initialise(again, b);
  network.Initialise(other, c);
  EXPECT_EQ(a, b);
  EXPECT_NE(a, c);
}

/// Forward in float64 through the canonical parameters; tanh towers.
std::vector<double> ReferenceTower(const Network& network, const std::vector<float>& parameters, std::string_view tower,
                                   const float* observation) {
  std::vector<double> x(observation, observation + network.spec().inputs[0].size);
  for (std::size_t b = 0; b < network.spec().blocks.size(); ++b) {
    const Block& block = network.spec().blocks[b];
    if (!block.name.starts_with(tower) && !block.name.starts_with("shared")) continue;
    const float* w = parameters.data() + network.parameters()[2 * b].offset;
    const float* bias = parameters.data() + network.parameters()[2 * b + 1].offset;
    std::vector<double> y;
    for (std::int64_t o = 0; o < block.out_size; ++o) {
      double sum = bias[o];
      for (std::int64_t i = 0; i < block.in_size; ++i) sum += w[o * block.in_size + i] * x[static_cast<std::size_t>(i)];
      y.push_back(block.activation == Activation::kTanh ? std::tanh(sum) : sum);
    }
    x = y;
  }
  return x;
}

TEST(EvaluatorForward, MatchesFloat64AndIsDenselyPacked) {
  const Network network = MustCreate(SmallActorCritic({33}, {64, 20}));
  std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count()));
  Rng rng(11);
  for (float& value : parameters) value = 0.3f * rng.Normal();
  constexpr std::int64_t kRows = 150;  // more than two groups
  std::vector<float> observations(kRows * 5);
  for (float& value : observations) value = rng.Normal();
  Evaluator evaluator(network, kRows);
  evaluator.Load(parameters);
  const float* input = observations.data();
  evaluator.Forward({&input, 1}, kRows);
  for (std::int64_t r = 0; r < kRows; ++r) {
    const std::vector<double> pi = ReferenceTower(network, parameters, "pi", observations.data() + r * 5);
    for (std::size_t i = 0; i < 3; ++i)
      ASSERT_NEAR(evaluator.output(0)[r * 3 + static_cast<std::int64_t>(i)], pi[i], 2e-5);
    ASSERT_NEAR(evaluator.output(1)[r], ReferenceTower(network, parameters, "vf", observations.data() + r * 5)[0],
                2e-5);
  }
}

TEST(EvaluatorForward, BatchOfOneAndActorAloneGiveTheSameBits) {
  const Network network = MustCreate(SmallActorCritic());
  std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count()));
  Rng rng(12);
  network.Initialise(rng, parameters);
  constexpr std::int64_t kRows = 71;
  std::vector<float> observations(kRows * 5);
  for (float& value : observations) value = rng.Normal();
  Evaluator many(network, kRows), one(network, 1);
  many.Load(parameters);
  one.Load(parameters);
  const float* input = observations.data();
  many.Forward({&input, 1}, kRows);
  for (std::int64_t r = 0; r < kRows; ++r) {
    const float* row = observations.data() + r * 5;
    one.ForwardTo(0, {&row, 1}, 1);
    ASSERT_EQ(std::memcmp(one.output(0), many.output(0) + r * 3, 3 * sizeof(float)), 0);
    one.ForwardTo(1, {&row, 1}, 1);
    ASSERT_EQ(std::memcmp(one.output(1), many.output(1) + r, sizeof(float)), 0);
  }
}

TEST(EvaluatorForward, ActorAloneLeavesTheCriticUntouched) {
  const Network network = MustCreate(SmallActorCritic());
  std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count()), 0.1f);
  Evaluator evaluator(network, 1);
  evaluator.Load(parameters);
  const std::vector<float> ones(5, 1.0f), twos(5, 2.0f);
  const float* input = ones.data();
  evaluator.Forward({&input, 1}, 1);
  const float critic = *evaluator.output(1);
  const float actor = *evaluator.output(0);
  input = twos.data();
  evaluator.ForwardTo(0, {&input, 1}, 1);
  EXPECT_EQ(*evaluator.output(1), critic);
  EXPECT_NE(*evaluator.output(0), actor);
}

Network DuellingNetwork() {
  QNetworkOptions options;
  options.layers = {8};
  options.duelling = true;
  options.observation_size = 3;
  options.action_count = 4;
  return MustCreate(QNetwork(options));
}

TEST(Duelling, AddsTheValueToCentredAdvantages) {
  NetworkSpec spec;
  spec.inputs = {{"value", 1}, {"advantage", 3}};
  spec.blocks = {{.op = "duelling", .inputs = {"value", "advantage"}, .output = "q", .name = "q"}};
  spec.outputs = {"q"};
  const Network network = MustCreate(spec);
  EXPECT_EQ(network.parameter_count(), 0);
  EXPECT_EQ(network.spec().blocks[0].in_size, 4);
  EXPECT_EQ(network.output_size(0), 3);
  Evaluator evaluator(network, 2);
  const float values[] = {10, -1}, advantages[] = {1, 2, 6, 0, 0, 3};
  const float* inputs[] = {values, advantages};
  evaluator.Forward(inputs, 2);
  EXPECT_THAT(std::span(evaluator.output(0), 6), testing::ElementsAre(8, 9, 13, -2, -2, 1));
}

TEST(Duelling, SaysWhatItCannotRead) {
  NetworkSpec spec = DuellingNetwork().spec();
  Block& duelling = spec.blocks.back();
  duelling.inputs = {"advantage", "value"};
  EXPECT_THAT(Fault(spec), AllOf(HasSubstr("'q'"), HasSubstr("value, 1 number, not 4")));
  duelling.inputs = {"value"};
  duelling.in_size = 0;
  EXPECT_THAT(Fault(spec), HasSubstr("duelling has 2 inputs, not 1"));
  duelling.inputs = {"value", "advantage"};
  duelling.out_size = 3;
  EXPECT_THAT(Fault(spec), HasSubstr("puts out 4 features, not 3"));
}

TEST(QNetworks, HaveTheTowersOfTheirGeneration) {
  std::vector<std::string> names;
  const Network duelling = DuellingNetwork();
  for (const Parameter& parameter : duelling.parameters()) names.push_back(parameter.name);
  EXPECT_THAT(names, testing::ElementsAre("advantage/0/w", "advantage/0/b", "advantage/head/w", "advantage/head/b",
                                          "value/0/w", "value/0/b", "value/head/w", "value/head/b"));
  QNetworkOptions options;
  options.observation_size = 3;
  options.action_count = 4;
  const Network plain = MustCreate(QNetwork(options));
  EXPECT_EQ(plain.parameter_count(), 3 * 64 + 64 + 64 * 64 + 64 + 64 * 4 + 4);
  EXPECT_EQ(plain.spec().outputs, std::vector<std::string>{"q"});
}

// Two uses of one layer: the second has no parameters of its own, and gives what the first gives for the same input.
TEST(SharedParameters, OneLayerIsUsedTwice) {
  NetworkSpec spec;
  spec.inputs = {{"a", 3}, {"b", 3}};
  Block block{.inputs = {"a"}, .output = "x", .name = "x", .out_size = 2, .init = Init::kUniformFanIn};
  spec.blocks = {block};
  block.inputs = {"b"};
  block.output = block.name = "y";
  block.shares = "x";
  spec.blocks.push_back(block);
  spec.outputs = {"x", "y"};
  const Network network = MustCreate(spec);
  EXPECT_EQ(network.parameter_count(), 8);
  std::vector<float> parameters(8);
  Rng rng(1);
  network.Initialise(rng, parameters);
  Evaluator evaluator(network, 1);
  evaluator.Load(parameters);
  const float row[] = {1, -2, 3};
  const float* inputs[] = {row, row};
  evaluator.Forward(inputs, 1);
  EXPECT_EQ(std::memcmp(evaluator.output(0), evaluator.output(1), 2 * sizeof(float)), 0);
  EXPECT_NE(evaluator.output(0)[0], 0.0f);
  spec.blocks[1].out_size = 3;
  EXPECT_THAT(Fault(spec), AllOf(HasSubstr("'y'"), HasSubstr("cannot share the parameters of 'x'")));
  spec.blocks[1].out_size = 2;
  spec.blocks[1].shares = "y";
  EXPECT_THAT(Fault(spec), HasSubstr("cannot share"));
}

TEST(PackedNetworks, SeveralEvaluatorsRunTheSameParameters) {
  const Network network = MustCreate(SmallActorCritic());
  std::vector<float> parameters(static_cast<std::size_t>(network.parameter_count()));
  Rng rng(12);
  network.Initialise(rng, parameters);
  const auto packed = std::make_shared<PackedNetwork>(network);
  Evaluator a(packed, 1), b(packed, 3), own(network, 1);
  const std::vector<float> ones(5, 1.0f);
  const float* input = ones.data();
  for (int round = 0; round < 2; ++round) {
    packed->Load(parameters);
    own.Load(parameters);
    for (Evaluator* evaluator : {&a, &b, &own}) evaluator->Forward({&input, 1}, 1);
    EXPECT_EQ(std::memcmp(a.output(0), own.output(0), 3 * sizeof(float)), 0);
    EXPECT_EQ(std::memcmp(b.output(0), own.output(0), 3 * sizeof(float)), 0);
    for (float& value : parameters) value += 0.5f;
  }
}

TEST(Attributes, KeepWhatTheyAreGiven) {
  Attributes attributes;
  attributes.SetInteger("stride", 4);
  attributes.SetNumber("epsilon", 1e-5);
  attributes.SetText("padding", "same \"edge\"");
  attributes.SetIntegers("kernel", std::vector<std::int64_t>{8, 8});
  attributes.SetJson("foreign", R"({"a":[1,null]})");
  EXPECT_EQ(attributes.Integer("stride"), 4);
  EXPECT_EQ(attributes.Number("epsilon"), 1e-5);
  EXPECT_EQ(attributes.Number("stride"), 4.0);
  EXPECT_EQ(attributes.Text("padding"), "same \"edge\"");
  EXPECT_EQ(attributes.Integers("kernel"), (std::vector<std::int64_t>{8, 8}));
  EXPECT_FALSE(attributes.Integer("epsilon").has_value());
  EXPECT_FALSE(attributes.Integers("foreign").has_value());
  EXPECT_FALSE(attributes.Text("nothing").has_value());
}

}  // namespace
}  // namespace consac::nn
