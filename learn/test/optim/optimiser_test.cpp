// Optimisers against golden vectors (Stable Baselines' TensorFlow forms) and against the formulas in float64.
#include "consac/learn/optim/optimiser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace consac::learn {
namespace {

constexpr float kGradients[] = {0.5f, -0.2f};

TEST(RmsProp, TensorFlowFormMatchesTheGoldenVector) {
  RmsProp optimiser(1, {OptimiserForm::kTensorFlow, 0.99f, 0.0f, 1e-5f});
  std::vector<float> theta = {1.0f};
  optimiser.Step(theta, std::span(kGradients, 1), 0.1f, 1.0f);
  EXPECT_NEAR(theta[0], 0.94981169, 1e-6);
  optimiser.Step(theta, std::span(kGradients + 1, 1), 0.1f, 1.0f);
  EXPECT_NEAR(theta[0], 0.96998404, 1e-6);
}

TEST(Adam, TensorFlowFormMatchesTheGoldenVector) {
  Adam optimiser(1, {OptimiserForm::kTensorFlow, 0.9f, 0.999f, 1e-5f});
  std::vector<float> theta = {1.0f};
  optimiser.Step(theta, std::span(kGradients, 1), 0.1f, 1.0f);
  EXPECT_NEAR(theta[0], 0.90006321, 1e-6);
  optimiser.Step(theta, std::span(kGradients + 1, 1), 0.1f, 1.0f);
  EXPECT_NEAR(theta[0], 0.86552291, 1e-6);
}

TEST(Adam, PyTorchFormMatchesTheFormulaInFloat64) {
  constexpr int kSize = 37;
  const AdamOptions options{OptimiserForm::kPyTorch, 0.9f, 0.999f, 1e-5f};
  Adam optimiser(kSize, options);
  std::vector<float> theta(kSize, 0.3f), gradient(kSize);
  std::vector<double> expected(kSize, 0.3f), m(kSize), v(kSize);
  for (int t = 1; t <= 20; ++t) {
    for (int i = 0; i < kSize; ++i) gradient[i] = std::sin(static_cast<float>(i + 3 * t));
    optimiser.Step(theta, gradient, 0.01f, 0.5f);
    for (int i = 0; i < kSize; ++i) {
      const double g = 0.5 * gradient[i];
      m[i] = 0.9 * m[i] + 0.1 * g;
      v[i] = 0.999 * v[i] + 0.001 * g * g;
      expected[i] -= 0.01 * (m[i] / (1 - std::pow(0.9, t))) / (std::sqrt(v[i] / (1 - std::pow(0.999, t))) + 1e-5);
    }
  }
  for (int i = 0; i < kSize; ++i) EXPECT_NEAR(theta[i], expected[i], 2e-5) << i;
}

TEST(RmsProp, PyTorchFormWithMomentumMatchesTheFormulaInFloat64) {
  RmsProp optimiser(1, {OptimiserForm::kPyTorch, 0.99f, 0.9f, 1e-5f});
  std::vector<float> theta = {1.0f};
  double expected = 1.0, square = 0.0, momentum = 0.0;
  for (int t = 1; t <= 10; ++t) {
    const float gradient = std::cos(static_cast<float>(t));
    optimiser.Step(theta, std::span(&gradient, 1), 0.01f, 1.0f);
    square = 0.99 * square + 0.01 * gradient * gradient;
    momentum = 0.9 * momentum + gradient / (std::sqrt(square) + 1e-5);
    expected -= 0.01 * momentum;
  }
  EXPECT_NEAR(theta[0], expected, 1e-5);
}

TEST(Clip, FormsDifferOnlyByEpsilon) {
  const std::vector<float> gradient = {3.0f, 4.0f};
  EXPECT_DOUBLE_EQ(GlobalNorm(gradient), 5.0);
  EXPECT_FLOAT_EQ(ClipFactor(5.0, 0.5, OptimiserForm::kTensorFlow), 0.1f);
  EXPECT_NEAR(ClipFactor(5.0, 0.5, OptimiserForm::kPyTorch), 0.1f, 1e-7);
  EXPECT_FLOAT_EQ(ClipFactor(0.2, 0.5, OptimiserForm::kTensorFlow), 1.0f);
  EXPECT_FLOAT_EQ(ClipFactor(0.2, 0.5, OptimiserForm::kPyTorch), 1.0f);
  EXPECT_FLOAT_EQ(ClipFactor(5.0, 0.0, OptimiserForm::kPyTorch), 1.0f);
}

TEST(Adam, StateRestoresToTheSameNextStep) {
  Adam first(3, {});
  std::vector<float> a = {1, 2, 3}, gradient = {0.1f, -0.2f, 0.3f};
  first.Step(a, gradient, 0.01f, 1.0f);
  StateWriter writer;
  first.Visit(writer);
  Adam second(3, {});
  StateReader reader(writer.fields());
  second.Visit(reader);
  ASSERT_TRUE(reader.status().ok());
  std::vector<float> b = a;
  first.Step(a, gradient, 0.01f, 1.0f);
  second.Step(b, gradient, 0.01f, 1.0f);
  EXPECT_EQ(a, b);
}

// Weights behind a unit that is off get no gradient: their moments fade by a tenth a step, below what a processor
// handles quickly within 900, and once had DQN with 256 units spend half its time there.
TEST(Adam, MomentsFadeToZeroAndNotToDenormals) {
  for (const bool second_form : {false, true}) {
    Optimiser optimiser = second_form ? Optimiser(RmsProp(64, {})) : Optimiser(Adam(64, {}));
    std::vector<float> weights(64, 0.5f), gradient(64, 1e-3f);
    optimiser.Step(weights, gradient, 1e-3f, 1.0f);
    std::fill(gradient.begin(), gradient.end(), 0.0f);
    for (int i = 0; i < 20000; ++i) optimiser.Step(weights, gradient, 1e-3f, 1.0f);
    StateWriter writer;
    optimiser.Visit(writer);
    for (const auto& [name, field] : writer.fields()) {
      if (field.bytes.size() != 64 * sizeof(float)) continue;
      std::vector<float> moments(64);
      std::memcpy(moments.data(), field.bytes.data(), field.bytes.size());
      for (const float moment : moments) EXPECT_NE(std::fpclassify(moment), FP_SUBNORMAL) << name;
    }
  }
  volatile float tiny = 1e-38f;
  tiny = tiny * 0.25f;
  EXPECT_NE(tiny, 0.0f) << "who calls it keeps denormals";
}

}  // namespace
}  // namespace consac::learn
