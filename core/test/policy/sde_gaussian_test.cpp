// State-dependent exploration (gSDE): likelihood, entropy and divergence are Stable Baselines3's formulas in float64,
// draws are mean + phi W, and a model that acts keeps a matrix for each agent.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "consac/nn/net_arch.h"
#include "consac/policy/policy.h"

namespace consac {
namespace {

constexpr std::int64_t kFeatures = 3, kElements = 2;
constexpr double kPi = 3.14159265358979323846;

struct SdeForm {
  bool squashed, full_std, use_expln;
  float clip_mean;
};
const SdeForm kForms[] = {
    {false, true, false, 0.0f}, {false, false, true, 0.0f}, {true, true, true, 0.5f}, {true, false, false, 2.0f}};

StateNoise NoiseOf(const SdeForm& form) {
  return {.features = kFeatures,
          .full_std = form.full_std,
          .use_expln = form.use_expln,
          .clip_mean = form.clip_mean,
          .sample_freq = -1};
}
ActionHead SdeHead(const SdeForm& form) {
  const std::vector<HeadSpec> specs = {{"", form.squashed ? "squashed_sde_gaussian" : "sde_gaussian", NoiseOf(form)}};
  return *ActionHead::Create(Layout::Of(*Space::Box({-2, 0}, {2, 1}, {kElements})), specs);
}
std::vector<float> LogStdsOf(const SdeForm& form) {
  return form.full_std ? std::vector<float>{-0.5f, 0.3f, -1.0f, 0.8f, 0.1f, -0.2f}
                       : std::vector<float>{-0.5f, 0.7f, -1.0f};
}

// means, then phi
const std::vector<float> kRow = {0.3f, -0.9f, 0.7f, -1.1f, 0.4f};

double Mean(const SdeForm& form, std::size_t i) {
  const double mean = static_cast<double>(kRow[i]), clip = static_cast<double>(form.clip_mean);
  return clip > 0.0 ? std::clamp(mean, -clip, clip) : mean;
}
double Variance(const SdeForm& form, const std::vector<float>& log_std, std::size_t i) {
  double variance = 1e-6;
  for (std::size_t l = 0; l < kFeatures; ++l) {
    const double own = static_cast<double>(log_std[form.full_std ? l * kElements + i : l]);
    const double sigma = form.use_expln && own > 0.0 ? std::log1p(own + 1e-6) + 1.0 : std::exp(own);
    const double phi = static_cast<double>(kRow[kElements + l]);
    variance += phi * phi * sigma * sigma;
  }
  return variance;
}

TEST(SdeGaussian, LikelihoodAndEntropyAreTheFormulasInFloat64) {
  for (const SdeForm& form : kForms) {
    const ActionHead head = SdeHead(form);
    const std::vector<float> log_std = LogStdsOf(form);
    ASSERT_EQ(head.size(), kElements + kFeatures);
    ASSERT_EQ(head.features_offset(), kElements);
    ASSERT_EQ(head.log_std_size(), static_cast<std::int64_t>(log_std.size()));
    ASSERT_EQ(head.exploration_size(), kFeatures * kElements);
    const double before[] = {0.6, -0.4};
    float raw[kElements];
    double expected = 0.0, entropy = 0.0;
    for (std::size_t i = 0; i < kElements; ++i) {
      raw[i] = static_cast<float>(form.squashed ? std::tanh(before[i]) : before[i]);
      const double variance = Variance(form, log_std, i), difference = before[i] - Mean(form, i);
      expected -= 0.5 * (difference * difference / variance + std::log(2.0 * kPi * variance));
      if (form.squashed) expected -= std::log(1.0 - std::tanh(before[i]) * std::tanh(before[i]) + 1e-6);
      entropy += 0.5 * std::log(2.0 * kPi * std::exp(1.0) * variance);
    }
    float log_p = 0.0f, said = 0.0f;
    head.LogProbability(kRow.data(), log_std.data(), nullptr, raw, 1, &log_p);
    EXPECT_NEAR(log_p, expected, 1e-5);
    head.Entropy(kRow.data(), log_std.data(), nullptr, 1, &said);
    if (!form.squashed) {
      EXPECT_NEAR(said, entropy, 1e-5);
    }
  }
}

// Over all matrices a draw has that mean and variance; without one it is drawn by itself, and has them too.
TEST(SdeGaussian, DrawsHaveTheVarianceOfTheStateWithAMatrixAndWithout) {
  constexpr int kDraws = 40000;
  for (const SdeForm& form : kForms) {
    const ActionHead head = SdeHead(form);
    const std::vector<float> log_std = LogStdsOf(form);
    std::vector<float> matrix(static_cast<std::size_t>(head.exploration_size()));
    for (const bool with_matrix : {true, false}) {
      Rng rng(4, 4);
      double sum[kElements] = {}, squares[kElements] = {}, minus_log_p = 0.0;
      for (int d = 0; d < kDraws; ++d) {
        float raw[kElements], log_p = 0.0f;
        SlotNoise noise;
        if (with_matrix) {
          head.DrawExploration(log_std.data(), rng, matrix.data());
          noise.matrices = matrix.data();
        }
        head.Select(kRow.data(), log_std.data(), nullptr, 1, ActionMode::kSample, rng, raw, &log_p, noise);
        minus_log_p -= static_cast<double>(log_p) / kDraws;
        for (std::size_t i = 0; i < kElements; ++i) {
          const double u =
              static_cast<double>(form.squashed ? std::atanh(std::clamp(raw[i], -0.9999999f, 0.9999999f)) : raw[i]);
          sum[i] += u / kDraws;
          squares[i] += u * u / kDraws;
        }
      }
      for (std::size_t i = 0; i < kElements; ++i) {
        EXPECT_NEAR(sum[i], Mean(form, i), 0.05);
        EXPECT_NEAR(squares[i] - sum[i] * sum[i], Variance(form, log_std, i), 0.05 * Variance(form, log_std, i));
      }
      float entropy = 0.0f;
      head.Entropy(kRow.data(), log_std.data(), nullptr, 1, &entropy);
      EXPECT_NEAR(entropy, minus_log_p, 0.1);
    }
  }
}

TEST(SdeGaussian, AMatrixIsALinearFunctionOfTheFeatures) {
  const SdeForm form = kForms[0];
  const ActionHead head = SdeHead(form);
  const float matrices[] = {9, 9, 9, 9, 9, 9, 1, 2, 3, 4, 5, 6};  // of slots 0 and 1, [features, elements]
  const std::int32_t slot = 1;
  Rng rng(1, 1), same(1, 1);
  float raw[kElements];
  head.Select(kRow.data(), LogStdsOf(form).data(), nullptr, 1, ActionMode::kSample, rng, raw, nullptr,
              {matrices, &slot});
  EXPECT_FLOAT_EQ(raw[0], 0.3f + 0.7f * 1 - 1.1f * 3 + 0.4f * 5);
  EXPECT_FLOAT_EQ(raw[1], -0.9f + 0.7f * 2 - 1.1f * 4 + 0.4f * 6);
  EXPECT_EQ(rng.Uniform(), same.Uniform()) << "nothing else is drawn";
  head.Select(kRow.data(), nullptr, nullptr, 1, ActionMode::kDeterministic, rng, raw, nullptr, {matrices, &slot});
  EXPECT_EQ(raw[0], 0.3f);
}

TEST(SdeGaussian, KlIsThatOfTheNormalNumbers) {
  const SdeForm form = kForms[0];
  const ActionHead head = SdeHead(form);
  const std::vector<float> log_std = LogStdsOf(form), other_log_std = {0.1f, -0.3f, 0.2f, 0.1f, -0.4f, 0.3f};
  std::vector<float> other = kRow;
  other[0] = 1.0f;
  double expected = 0.0;
  for (std::size_t i = 0; i < kElements; ++i) {
    const double own = Variance(form, log_std, i), theirs = Variance(form, other_log_std, i);
    const double difference = static_cast<double>(kRow[i] - other[i]);
    expected += 0.5 * (std::log(theirs / own) + (own + difference * difference) / theirs - 1.0);
  }
  float kl = 0.0f;
  head.Kl(kRow.data(), log_std.data(), other.data(), other_log_std.data(), nullptr, 1, &kl);
  EXPECT_NEAR(kl, expected, 1e-5);
}

TEST(SdeGaussian, HeadsThatCannotBeAreOneLine) {
  const Layout two = Layout::Of(*Space::Dict({{"a", *Space::Box(-1, 1, {2})}, {"b", *Space::Box(-1, 1, {1})}}));
  const auto error = [&](StateNoise a, StateNoise b) {
    const std::vector<HeadSpec> specs = {{"a", "sde_gaussian", a}, {"b", "sde_gaussian", b}};
    return ActionHead::Create(two, specs).status().message();
  };
  EXPECT_EQ(error({.features = 4}, {.features = 4}), "");
  EXPECT_NE(error({.features = 0}, {.features = 0}).find("explores by 0 features"), std::string::npos);
  EXPECT_NE(error({.features = 4}, {.features = 5}).find("other features"), std::string::npos);
  EXPECT_NE(error({.features = 1 << 20}, {}).find("at most 1048576 numbers"), std::string::npos);
  EXPECT_NE(error({.features = INT64_MAX}, {}).find("at most 1048576 numbers"), std::string::npos);
  EXPECT_NE(error({.features = 4, .clip_mean = -1.0f}, {}).find("within -1"), std::string::npos);
}

PolicyData SdePolicy(std::int64_t sample_freq) {
  PolicyData data;
  data.observation_space = *Space::Box(-1, 1, {2});
  data.action_space = *Space::Box(-1, 1, {1});
  nn::ActorCriticOptions options;
  options.arch = {{}, {4}, {4}};
  options.observation_size = 2;
  options.action_size = 1;
  options.with_features = true;
  data.network = nn::ActorCritic(options);
  data.heads = {{"", "squashed_sde_gaussian", {.features = 4, .clip_mean = 2.0f, .sample_freq = sample_freq}}};
  const auto network = nn::Network::Create(data.network);
  data.parameters.resize(static_cast<std::size_t>(network->parameter_count()));
  Rng rng(3, 1);
  network->Initialise(rng, data.parameters);
  data.log_std.assign(4, -0.5f);
  return data;
}

/// What `slots` do in one and the same state.
std::vector<float> Draw(Policy& policy, std::vector<std::int32_t> slots, std::vector<std::uint8_t> begins, Rng& rng,
                        ActionMode mode = ActionMode::kSample) {
  std::vector<float> seen, done(slots.size());
  for (std::size_t i = 0; i < slots.size(); ++i) seen.insert(seen.end(), {0.5f, -0.25f});
  policy.Act({reinterpret_cast<const std::byte*>(seen.data()), nullptr, static_cast<std::int64_t>(slots.size()),
              slots.data(), begins.empty() ? nullptr : begins.data()},
             mode, rng, reinterpret_cast<std::byte*>(done.data()));
  return done;
}

TEST(SdePolicy, NoiseIsAnAgentsOwnAndLastsAsLongAsItsEpisode) {
  auto policy = Policy::Create(SdePolicy(-1), 8);
  ASSERT_TRUE(policy.ok()) << policy.status().message();
  Rng rng(5, 5);
  const std::vector<float> first = Draw(*policy, {0, 3}, {1, 1}, rng);
  EXPECT_NE(first[0], first[1]);
  EXPECT_EQ(Draw(*policy, {3, 0}, {}, rng), (std::vector<float>{first[1], first[0]})) << "the same state again";
  const std::vector<float> third = Draw(*policy, {0, 3}, {1, 0}, rng);
  EXPECT_NE(third[0], first[0]) << "another episode";
  EXPECT_EQ(third[1], first[1]);
  const std::vector<float> mode = Draw(*policy, {0, 3}, {}, rng, ActionMode::kDeterministic);
  EXPECT_EQ(mode[0], mode[1]);
  ASSERT_TRUE(policy->MakeRoom(16).ok());
  EXPECT_EQ(Draw(*policy, {0, 3}, {}, rng), third) << "room for more changes no agent's";
}

TEST(SdePolicy, NoiseLastsAsManyActionsAsTheModelSays) {
  auto policy = Policy::Create(SdePolicy(2), 8);
  Rng rng(5, 5);
  std::vector<float> drawn;
  for (int i = 0; i < 6; ++i) drawn.push_back(Draw(*policy, {0}, {}, rng)[0]);
  for (const std::size_t pair : {0u, 2u, 4u}) EXPECT_EQ(drawn[pair], drawn[pair + 1]);
  EXPECT_NE(drawn[1], drawn[2]);
  EXPECT_NE(drawn[3], drawn[4]);
}

TEST(SdePolicy, WhatWasSavedGoesOnWithTheSameNoise) {
  auto policy = Policy::Create(SdePolicy(5), 8), other = Policy::Create(SdePolicy(5), 8);
  Rng rng(5, 5);
  for (int i = 0; i < 3; ++i) Draw(*policy, {1, 2}, {}, rng);
  StateWriter writer;
  writer("policy", *policy);
  StateReader reader(writer.fields());
  reader("policy", *other);
  ASSERT_TRUE(reader.status().ok()) << reader.status().message();
  Rng copy = rng;
  for (int i = 0; i < 7; ++i) EXPECT_EQ(Draw(*policy, {2, 1}, {}, rng), Draw(*other, {2, 1}, {}, copy));
}

TEST(SdePolicy, AFileHoldsAllOfIt) {
  auto policy = Policy::Create(SdePolicy(7), 8);
  const ModelFile file = policy->ToFile();
  auto loaded = Policy::FromFile(file, 8);
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->data().heads, policy->data().heads);
  EXPECT_EQ(loaded->data().heads[0].noise.sample_freq, 7);
  Rng rng(5, 5), same(5, 5);
  EXPECT_EQ(Draw(*policy, {0, 1}, {}, rng), Draw(*loaded, {0, 1}, {}, same));
  const auto with = [&](const char* from, const char* to) {
    ModelFile changed = file;
    const std::size_t at = changed.spec_json.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    changed.spec_json.replace(at, std::strlen(from), to);
    return Policy::FromFile(changed, 8).status();
  };
  for (const auto& [from, to] :
       {std::pair("\"features\":4", "\"features\":\"4\""), std::pair("\"features\":4", "\"features\":1099511627776"),
        std::pair("\"features\":4", "\"features\":5"), std::pair("\"full_std\":true", "\"full_std\":1"),
        std::pair("\"clip_mean\":2.0", "\"clip_mean\":-2.0")})
    EXPECT_FALSE(with(from, to).ok()) << to;
}

}  // namespace
}  // namespace consac
