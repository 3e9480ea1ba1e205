// Gradients of log-probability and entropy against central differences, for every head, with masks; the values
// against core's own distributions.
#include "grad/head_gradient.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "consac/policy/head.h"

namespace consac::learn {
namespace {

struct Case {
  const char* name;
  Space space;
  std::vector<std::uint8_t> mask;    // one row, or empty
  std::vector<HeadSpec> heads = {};  // empty: the defaults
};

std::vector<Case> Cases() {
  return {{"discrete", *Space::Discrete(5), {}},
          {"discrete masked", *Space::Discrete(4), {1, 0, 1, 1}},
          {"multi discrete", *Space::MultiDiscrete({3, 2, 4}), {}},
          {"multi discrete masked", *Space::MultiDiscrete({3, 2}), {1, 1, 0, 1, 1}},
          {"bits", *Space::MultiBinary(3), {}},
          {"bits masked", *Space::MultiBinary(2), {1, 1, 0, 1}},
          {"box", *Space::Box(-1, 1, {3}), {}},
          {"dict",
           *Space::Dict({{"a", *Space::Box(-1, 1, {2})}, {"b", *Space::Discrete(3)}, {"c", *Space::MultiBinary(1)}}),
           {}},
          {"box by the state", *Space::Box(-1, 1, {3}), {}, {{"", "sde_gaussian", {.features = 4}}}},
          {"box by the state with one deviation a feature",
           *Space::Box(-1, 1, {3}),
           {},
           {{"", "sde_gaussian", {.features = 4, .full_std = false, .use_expln = true, .clip_mean = 1.0f}}}},
          {"squashed box by the state", *Space::Box(-1, 1, {3}), {}, {{"", "squashed_sde_gaussian", {.features = 4}}}},
          {"dict by the state",
           *Space::Dict({{"a", *Space::Box(-1, 1, {2})}, {"b", *Space::Discrete(3)}, {"c", *Space::Box(-1, 1, {1})}}),
           {},
           {{"a", "sde_gaussian", {.features = 4}},
            {"b", "categorical"},
            {"c", "squashed_sde_gaussian", {.features = 4, .full_std = false}}}}};
}

/// Of what is squashed there is none in closed form: what learns takes -log p of what was drawn.
bool EntropyIsASample(const ActionHead& actions) {
  return std::any_of(actions.parts().begin(), actions.parts().end(),
                     [](const ActionHead::Part& part) { return part.distribution->name == "squashed_sde_gaussian"; });
}

TEST(HeadGradient, MatchesCentralDifferencesAndCoresDistributions) {
  for (const Case& entry : Cases()) {
    const Layout layout = Layout::Of(entry.space);
    const ActionHead actions = *ActionHead::Create(layout, entry.heads);
    const std::int64_t rows = 7, head_size = actions.size(), raw_size = actions.raw_size();
    Rng rng(1, 1);
    std::vector<float> head(static_cast<std::size_t>(rows * head_size)),
        log_std(static_cast<std::size_t>(actions.log_std_size()));
    for (float& value : head) value = rng.Normal();
    for (float& value : log_std) value = 0.3f * rng.Normal();
    std::vector<std::uint8_t> masks;
    for (std::int64_t r = 0; r < rows && !entry.mask.empty(); ++r)
      masks.insert(masks.end(), entry.mask.begin(), entry.mask.end());
    const std::uint8_t* mask = masks.empty() ? nullptr : masks.data();
    std::vector<float> raw(static_cast<std::size_t>(rows * raw_size)), d_neglogp(rows), d_entropy(rows);
    actions.Select(head.data(), log_std.data(), mask, rows, ActionMode::kSample, rng, raw.data());
    for (float& value : d_neglogp) value = rng.Normal();
    for (float& value : d_entropy) value = rng.Normal();

    HeadGradient gradient = *HeadGradient::Create(actions, layout.mask_bytes);
    // sum of d_neglogp nlp + d_entropy H over the rows, in float64
    const auto loss = [&] {
      gradient.Forward(rows, head.data(), log_std.data(), mask, raw.data());
      double sum = 0;
      for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r)
        sum += static_cast<double>(d_neglogp[r]) * gradient.neglogp()[r] +
               static_cast<double>(d_entropy[r]) * gradient.entropy()[r];
      return sum;
    };
    loss();
    std::vector<float> d_head(head.size()), d_log_std(log_std.size());
    gradient.Backward(d_neglogp, d_entropy, d_head.data(), d_log_std.data());

    std::vector<float> log_p(rows), entropy(rows);
    actions.LogProbability(head.data(), log_std.data(), mask, raw.data(), rows, log_p.data());
    actions.Entropy(head.data(), log_std.data(), mask, rows, entropy.data());
    for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r) {
      EXPECT_NEAR(gradient.neglogp()[r], -log_p[r], 2e-5) << entry.name;
      if (!EntropyIsASample(actions)) {
        EXPECT_NEAR(gradient.entropy()[r], entropy[r], 2e-5) << entry.name;
      }
    }
    const auto difference = [&](float& value) {
      const float kept = value, step = 1e-2f;
      value = kept + step;
      const double up = loss();
      value = kept - step;
      const double down = loss();
      value = kept;
      return (up - down) / (2.0 * step);
    };
    for (std::size_t i = 0; i < head.size(); ++i) {
      const bool feature = static_cast<std::int64_t>(i) % head_size >= actions.features_offset();
      const double expected = feature ? 0.0 : difference(head[i]);  // the last hidden layer learns by means alone
      EXPECT_NEAR(d_head[i], expected, 2e-3 * (1 + std::fabs(d_head[i]))) << entry.name << " " << i;
    }
    for (std::size_t i = 0; i < log_std.size(); ++i)
      EXPECT_NEAR(d_log_std[i], difference(log_std[i]), 5e-3 * (1 + std::fabs(d_log_std[i]))) << entry.name;
  }
}

// An engine may send a mask that forbids everything; its logits are then nobody's, and nothing can be learned of them.
TEST(HeadGradient, WhereNothingIsLegalThereIsNoGradient) {
  const Layout layout = Layout::Of(*Space::MultiDiscrete({3, 2}));
  const float head[5] = {0.5f, -0.25f, 0.125f, 1.0f, -1.0f}, raw[2] = {1, 0};
  const std::uint8_t mask[5] = {0, 0, 0, 1, 1};
  const float d_neglogp[1] = {2.0f}, d_entropy[1] = {-0.5f};
  float d_head[5];
  HeadGradient gradient = *HeadGradient::Create(*ActionHead::Create(layout), layout.mask_bytes);
  gradient.Forward(1, head, nullptr, mask, raw);
  gradient.Backward(d_neglogp, d_entropy, d_head, nullptr);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(d_head[i], 0.0f) << i;
  EXPECT_NE(d_head[3], 0.0f);
  EXPECT_LT(std::fabs(d_head[3]), 4.0f);
}

// The model's head says how it is learned by, not the action space: values of choices are of a Discrete one too.
TEST(HeadGradient, IsFoundByTheNameOfTheHead) {
  const Layout layout = Layout::Of(*Space::Dict({{"a", *Space::Discrete(3)}, {"b", *Space::Discrete(2)}}));
  const std::vector<HeadSpec> likely = {{"a", "categorical"}, {"b", "categorical"}};
  EXPECT_TRUE(HeadGradient::Create(*ActionHead::Create(layout, likely), layout.mask_bytes).ok());
  const std::vector<HeadSpec> valued = {{"a", "categorical"}, {"b", "q_values"}};
  const auto none = HeadGradient::Create(*ActionHead::Create(layout, valued), layout.mask_bytes);
  EXPECT_EQ(none.status().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(none.status().message(),
              ::testing::AllOf(::testing::HasSubstr("'b'"), ::testing::HasSubstr("'q_values'")));
}

}  // namespace
}  // namespace consac::learn
