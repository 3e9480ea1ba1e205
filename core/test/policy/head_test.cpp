// Action heads against the golden vectors, and what masks and modes promise. Moments against VecNormalize's.
#include "consac/policy/head.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "consac/policy/normaliser.h"

namespace consac {
namespace {

TEST(Head, CategoricalGoldenVector) {
  const Layout layout = Layout::Of(*Space::Discrete(3));
  const float logits[] = {1, 2, 0.5f}, raw = 1;
  float log_p = 0, entropy = 0;
  LogProbability(layout, logits, nullptr, nullptr, &raw, 1, &log_p);
  Entropy(layout, logits, nullptr, nullptr, 1, &entropy);
  EXPECT_NEAR(-log_p, 0.464369, 1e-6);
  EXPECT_NEAR(entropy, 0.905959, 1e-6);
}

TEST(Head, DiagonalGaussianGoldenVector) {
  const Layout layout = Layout::Of(*Space::Box(-10, 10, {2}));
  const float mean[] = {0, 0.5f}, log_std[] = {0, -0.3f}, raw[] = {0.1f, 0.4f};
  float log_p = 0, entropy = 0;
  LogProbability(layout, mean, log_std, nullptr, raw, 1, &log_p);
  Entropy(layout, mean, log_std, nullptr, 1, &entropy);
  EXPECT_NEAR(-log_p, 1.551988, 1e-6);
  EXPECT_NEAR(entropy, 2.537877, 1e-6);
}

TEST(Head, BernoulliAndMultiDiscreteAreSums) {
  const Layout bits = Layout::Of(*Space::MultiBinary(2));
  const float logits[] = {0.3f, -1.2f}, set[] = {1, 0};
  float log_p = 0;
  LogProbability(bits, logits, nullptr, nullptr, set, 1, &log_p);
  EXPECT_NEAR(log_p, std::log(1 / (1 + std::exp(-0.3))) + std::log(1 - 1 / (1 + std::exp(1.2))), 1e-6);
  const Layout two = Layout::Of(*Space::MultiDiscrete({2, 3}));
  const float both[] = {0, 0, 1, 2, 0.5f}, raw[] = {1, 1};
  LogProbability(two, both, nullptr, nullptr, raw, 1, &log_p);
  EXPECT_NEAR(log_p, std::log(0.5) - 0.464369, 1e-6);
}

TEST(Head, SamplesFollowTheDistributionAndReportItsLogProbability) {
  const Layout layout = Layout::Of(*Space::Discrete(3));
  const float logits[] = {0, std::log(2.0f), std::log(5.0f)};
  std::array<int, 3> counts{};
  Rng rng(1, 1);
  for (int i = 0; i < 80000; ++i) {
    float raw = 0, log_p = 0, expected = 0;
    SelectActions(layout, logits, nullptr, nullptr, 1, ActionMode::kSample, rng, &raw, &log_p);
    LogProbability(layout, logits, nullptr, nullptr, &raw, 1, &expected);
    ASSERT_NEAR(log_p, expected, 1e-6);
    ++counts[static_cast<std::size_t>(raw)];
  }
  EXPECT_NEAR(counts[0], 10000, 400);
  EXPECT_NEAR(counts[1], 20000, 500);
  EXPECT_NEAR(counts[2], 50000, 500);
}

TEST(Head, MaskedActionsAreNeverTakenAndHaveNoEntropy) {
  const Layout layout = Layout::Of(*Space::Discrete(4));
  const float logits[] = {5, 1, 1, 9};
  const std::uint8_t mask[] = {0, 1, 1, 0};
  Rng rng(1, 1);
  for (int i = 0; i < 1000; ++i) {
    float raw = 0;
    SelectActions(layout, logits, nullptr, mask, 1, i == 0 ? ActionMode::kDeterministic : ActionMode::kSample, rng,
                  &raw);
    ASSERT_TRUE(raw == 1 || raw == 2);
  }
  float entropy = 0;
  Entropy(layout, logits, nullptr, mask, 1, &entropy);
  EXPECT_NEAR(entropy, std::log(2.0), 1e-6);
}

TEST(Head, WorldActionsAreClippedAndOffset) {
  const Layout box = Layout::Of(*Space::Box({-1, -2}, {1, 2}, {2}));
  const float raw[] = {3, -5};
  float action[2];
  WriteActions(box, raw, 1, reinterpret_cast<std::byte*>(action));
  EXPECT_EQ(action[0], 1.0f);
  EXPECT_EQ(action[1], -2.0f);
  const Layout discrete = Layout::Of(*Space::Discrete(3, 10));
  const float choice = 2;
  std::int32_t taken = 0;
  WriteActions(discrete, &choice, 1, reinterpret_cast<std::byte*>(&taken));
  EXPECT_EQ(taken, 12);
}

TEST(Head, ImagesAreNoActions) {
  EXPECT_FALSE(CheckHead(Layout::Of(*Space::Box(0, 1, {2, 2}))).ok());
  EXPECT_FALSE(CheckHead(Layout::Of(*Space::Box(0, 255, {2}, DType::kU8))).ok());
  EXPECT_TRUE(CheckHead(Layout::Of(*Space::Box(0, 1, {2}))).ok());
}

TEST(RunningMoments, VecNormalizeGoldenVector) {
  RunningMoments moments(1);
  const float first[] = {1, 3}, second[] = {2, 6};
  moments.Update(first, 2);
  EXPECT_NEAR(moments.mean[0], 1.99990000500, 1e-10);
  EXPECT_NEAR(moments.variance[0], 1.0001999800, 1e-9);
  moments.Update(second, 2);
  EXPECT_NEAR(moments.mean[0], 2.99992500187, 1e-10);
  EXPECT_NEAR(moments.variance[0], 3.50016249031, 1e-9);
  EXPECT_NEAR(moments.count, 4.0001, 1e-12);
}

TEST(ObservationNormaliser, ScalesAndClips) {
  RunningMoments moments(2);
  moments.mean = {1, 2};
  moments.variance = {4, 0};
  const ObservationNormaliser normaliser = ObservationNormaliser::Of(moments, 1e-8, 10);
  float row[] = {5, 3};
  normaliser.Apply(row, 1);
  EXPECT_NEAR(row[0], 2.0, 1e-6);
  EXPECT_EQ(row[1], 10.0f);
}

}  // namespace
}  // namespace consac
