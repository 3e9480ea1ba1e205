// Action heads against the golden vectors, and what masks and modes promise. Moments against VecNormalize's.
#include "consac/policy/head.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "consac/policy/normaliser.h"

namespace consac {
namespace {

ActionHead DefaultHead(const Space& action) {
  return *ActionHead::Create(Layout::Of(action));
}

TEST(Head, CategoricalGoldenVector) {
  const ActionHead layout = DefaultHead(*Space::Discrete(3));
  const float logits[] = {1, 2, 0.5f}, raw = 1;
  float log_p = 0, entropy = 0;
  layout.LogProbability(logits, nullptr, nullptr, &raw, 1, &log_p);
  layout.Entropy(logits, nullptr, nullptr, 1, &entropy);
  EXPECT_NEAR(-log_p, 0.464369, 1e-6);
  EXPECT_NEAR(entropy, 0.905959, 1e-6);
}

TEST(Head, DiagonalGaussianGoldenVector) {
  const ActionHead layout = DefaultHead(*Space::Box(-10, 10, {2}));
  const float mean[] = {0, 0.5f}, log_std[] = {0, -0.3f}, raw[] = {0.1f, 0.4f};
  float log_p = 0, entropy = 0;
  layout.LogProbability(mean, log_std, nullptr, raw, 1, &log_p);
  layout.Entropy(mean, log_std, nullptr, 1, &entropy);
  EXPECT_NEAR(-log_p, 1.551988, 1e-6);
  EXPECT_NEAR(entropy, 2.537877, 1e-6);
}

TEST(Head, BernoulliAndMultiDiscreteAreSums) {
  const ActionHead bits = DefaultHead(*Space::MultiBinary(2));
  const float logits[] = {0.3f, -1.2f}, set[] = {1, 0};
  float log_p = 0;
  bits.LogProbability(logits, nullptr, nullptr, set, 1, &log_p);
  EXPECT_NEAR(log_p, std::log(1 / (1 + std::exp(-0.3))) + std::log(1 - 1 / (1 + std::exp(1.2))), 1e-6);
  const ActionHead two = DefaultHead(*Space::MultiDiscrete({2, 3}));
  const float both[] = {0, 0, 1, 2, 0.5f}, raw[] = {1, 1};
  two.LogProbability(both, nullptr, nullptr, raw, 1, &log_p);
  EXPECT_NEAR(log_p, std::log(0.5) - 0.464369, 1e-6);
}

TEST(Head, SamplesFollowTheDistributionAndReportItsLogProbability) {
  const ActionHead layout = DefaultHead(*Space::Discrete(3));
  const float logits[] = {0, std::log(2.0f), std::log(5.0f)};
  std::array<int, 3> counts{};
  Rng rng(1, 1);
  for (int i = 0; i < 80000; ++i) {
    float raw = 0, log_p = 0, expected = 0;
    layout.Select(logits, nullptr, nullptr, 1, ActionMode::kSample, rng, &raw, &log_p);
    layout.LogProbability(logits, nullptr, nullptr, &raw, 1, &expected);
    ASSERT_NEAR(log_p, expected, 1e-6);
    ++counts[static_cast<std::size_t>(raw)];
  }
  EXPECT_NEAR(counts[0], 10000, 400);
  EXPECT_NEAR(counts[1], 20000, 500);
  EXPECT_NEAR(counts[2], 50000, 500);
}

TEST(Head, MaskedActionsAreNeverTakenAndHaveNoEntropy) {
  const ActionHead layout = DefaultHead(*Space::Discrete(4));
  const float logits[] = {5, 1, 1, 9};
  const std::uint8_t mask[] = {0, 1, 1, 0};
  Rng rng(1, 1);
  for (int i = 0; i < 1000; ++i) {
    float raw = 0;
    layout.Select(logits, nullptr, mask, 1, i == 0 ? ActionMode::kDeterministic : ActionMode::kSample, rng, &raw);
    ASSERT_TRUE(raw == 1 || raw == 2);
  }
  float entropy = 0;
  layout.Entropy(logits, nullptr, mask, 1, &entropy);
  EXPECT_NEAR(entropy, std::log(2.0), 1e-6);
}

/// Mean over draws of log p - log q.
double SampledKl(const ActionHead& head, const float* p, const float* p_std, const float* q, const float* q_std,
                 const std::uint8_t* mask) {
  Rng rng(9, 1);
  std::vector<float> raw(static_cast<std::size_t>(head.raw_size()));
  double sum = 0.0;
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i) {
    float log_p = 0, log_q = 0;
    head.Select(p, p_std, mask, 1, ActionMode::kSample, rng, raw.data(), &log_p);
    head.LogProbability(q, q_std, mask, raw.data(), 1, &log_q);
    sum += static_cast<double>(log_p) - log_q;
  }
  return sum / kDraws;
}

TEST(Head, KlIsTheMeanDifferenceOfLogProbabilities) {
  const Space action = *Space::Dict({{"a", *Space::Box(-1, 1, {2})},
                                     {"b", *Space::MultiDiscrete({3, 2})},
                                     {"c", *Space::MultiBinary(2)},
                                     {"d", *Space::Discrete(3)}});
  const auto head = ActionHead::Create(Layout::Of(action));
  ASSERT_TRUE(head.ok());
  ASSERT_EQ(head->size(), 12);
  const float p[] = {0.1f, -0.4f, 1, 2, 0.5f, 0, 1, 0.3f, -1, 0.2f, 0.1f, 1};
  const float q[] = {0.3f, -0.2f, 0, 2, 1.5f, 1, 1, 0.9f, 0, 0.5f, 0.9f, 0};
  const float p_std[] = {0, -0.5f}, q_std[] = {0.3f, -0.2f};
  const std::uint8_t mask[] = {1, 1, 0, 1, 1, 1, 1, 0, 1, 1, 1, 1};
  float kl = 0;
  for (const std::uint8_t* legal : {static_cast<const std::uint8_t*>(nullptr), mask}) {
    head->Kl(p, p_std, q, q_std, legal, 1, &kl);
    EXPECT_NEAR(kl, SampledKl(*head, p, p_std, q, q_std, legal), 0.01);
    EXPECT_GT(kl, 0.1f);
    head->Kl(p, p_std, p, p_std, legal, 1, &kl);
    EXPECT_NEAR(kl, 0.0f, 1e-6);
  }
}

// The named heads of an action and its default ones are one.
TEST(Head, NamedDefaultsGiveTheSameBits) {
  const Layout layout = Layout::Of(*Space::Dict({{"a", *Space::Box(-1, 1, {2})}, {"b", *Space::Discrete(3, 5)}}));
  const auto named = ActionHead::Create(layout, DefaultHeads(layout)), unnamed = ActionHead::Create(layout);
  ASSERT_TRUE(named.ok() && unnamed.ok());
  EXPECT_EQ(named->specs(), unnamed->specs());
  EXPECT_EQ(named->size(), unnamed->size());
  EXPECT_EQ(named->log_std_size(), unnamed->log_std_size());
  EXPECT_EQ(named->raw_size(), unnamed->raw_size());
  const float numbers[] = {0.1f, -0.4f, 1, 2, 0.5f}, log_std[] = {0, -0.5f};
  float raw[3], again[3], log_p = 0, log_q = 0, entropy = 0, entropy_again = 0;
  std::vector<std::byte> action(layout.row_bytes), action_again(layout.row_bytes);
  Rng first(4, 4), second(4, 4);
  named->Select(numbers, log_std, nullptr, 1, ActionMode::kSample, first, raw, &log_p);
  unnamed->Select(numbers, log_std, nullptr, 1, ActionMode::kSample, second, again, &log_q);
  EXPECT_EQ(std::vector<float>(raw, raw + 3), std::vector<float>(again, again + 3));
  EXPECT_EQ(log_p, log_q);
  named->Entropy(numbers, log_std, nullptr, 1, &entropy);
  unnamed->Entropy(numbers, log_std, nullptr, 1, &entropy_again);
  EXPECT_EQ(entropy, entropy_again);
  named->Write(raw, 1, action.data());
  unnamed->Write(raw, 1, action_again.data());
  EXPECT_EQ(action, action_again);
}

// Of a squashed Gaussian: samples lie in the bounds, entropy and divergence are what sampling says, and the golden
// vector is Stable Baselines3's SquashedDiagGaussianDistribution worked by hand: N(0.3; 0.1, e^-0.5) less
// log(1 - tanh(0.3)^2 + 1e-6).
TEST(Head, SquashedGaussian) {
  const Layout layout = Layout::Of(*Space::Box({-2, 0}, {2, 1}, {2}));
  const std::vector<HeadSpec> specs = {{"", "squashed_gaussian"}};
  const auto head = ActionHead::Create(layout, specs);
  ASSERT_TRUE(head.ok()) << head.status().message();
  ASSERT_EQ(head->size(), 4);
  EXPECT_EQ(head->log_std_size(), 0);
  const float p[] = {0.1f, -0.4f, -0.5f, 0.25f}, q[] = {0.4f, 0.1f, -0.25f, 0.5f};
  const float raw[] = {std::tanh(0.3f), std::tanh(-0.4f)};
  float log_p = 0, entropy = 0, kl = 0;
  head->LogProbability(p, nullptr, nullptr, raw, 1, &log_p);
  const auto term = [](double u, double mean, double log_std) {
    const double z = (u - mean) * std::exp(-log_std);
    return -0.5 * z * z - log_std - 0.5 * std::log(2 * 3.14159265358979) -
           std::log(1 - std::tanh(u) * std::tanh(u) + 1e-6);
  };
  EXPECT_NEAR(log_p, term(0.3, 0.1, -0.5) + term(-0.4, -0.4, 0.25), 1e-5);
  head->Entropy(p, nullptr, nullptr, 1, &entropy);
  head->Kl(p, nullptr, q, nullptr, nullptr, 1, &kl);
  EXPECT_NEAR(kl, SampledKl(*head, p, nullptr, q, nullptr, nullptr), 0.01);
  Rng rng(2, 2);
  double sum = 0;
  for (int i = 0; i < 100000; ++i) {
    float drawn[2], action[2];
    head->Select(p, nullptr, nullptr, 1, ActionMode::kSample, rng, drawn, &log_p);
    head->Write(drawn, 1, reinterpret_cast<std::byte*>(action));
    ASSERT_TRUE(action[0] >= -2 && action[0] <= 2 && action[1] >= 0 && action[1] <= 1);
    sum -= log_p;
  }
  EXPECT_NEAR(entropy, sum / 100000, 0.01);
  float mode[2], action[2];
  head->Select(p, nullptr, nullptr, 1, ActionMode::kDeterministic, rng, mode);
  head->Write(mode, 1, reinterpret_cast<std::byte*>(action));
  EXPECT_NEAR(action[0], 2 * std::tanh(0.1), 1e-6);
  EXPECT_NEAR(action[1], 0.5 + 0.5 * std::tanh(-0.4), 1e-6);
}

TEST(Head, DeterministicActionsAreStretchedToTheirBounds) {
  const Layout layout = Layout::Of(*Space::Box({-2, 0}, {2, 1}, {2}));
  const std::vector<HeadSpec> specs = {{"", "deterministic"}};
  const auto head = ActionHead::Create(layout, specs);
  ASSERT_TRUE(head.ok()) << head.status().message();
  const float output[] = {-0.5f, 1.5f};
  float raw[2], action[2];
  Rng rng(1, 1), same(1, 1);
  head->Select(output, nullptr, nullptr, 1, ActionMode::kSample, rng, raw);
  EXPECT_EQ(rng.Uniform(), same.Uniform());
  head->Write(raw, 1, reinterpret_cast<std::byte*>(action));
  EXPECT_EQ(action[0], -1.0f);
  EXPECT_EQ(action[1], 1.0f);
  EXPECT_FALSE(ActionHead::Create(Layout::Of(*Space::Box(-INFINITY, 1, {2})), specs).ok());
}

TEST(Head, WorldActionsAreClippedAndOffset) {
  const ActionHead box = DefaultHead(*Space::Box({-1, -2}, {1, 2}, {2}));
  const float raw[] = {3, -5};
  float action[2];
  box.Write(raw, 1, reinterpret_cast<std::byte*>(action));
  EXPECT_EQ(action[0], 1.0f);
  EXPECT_EQ(action[1], -2.0f);
  const ActionHead discrete = DefaultHead(*Space::Discrete(3, 10));
  const float choice = 2;
  std::int32_t taken = 0;
  discrete.Write(&choice, 1, reinterpret_cast<std::byte*>(&taken));
  EXPECT_EQ(taken, 12);
}

TEST(Head, ImagesAreNoActions) {
  EXPECT_FALSE(ActionHead::Create(Layout::Of(*Space::Box(0, 1, {2, 2}))).ok());
  EXPECT_FALSE(ActionHead::Create(Layout::Of(*Space::Box(0, 255, {2}, DType::kU8))).ok());
  EXPECT_TRUE(ActionHead::Create(Layout::Of(*Space::Box(0, 1, {2}))).ok());
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
