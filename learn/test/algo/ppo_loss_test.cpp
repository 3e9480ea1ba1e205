// PPO's loss: the golden vector of Stable Baselines' form, and derivatives against differences in both forms.
#include "algo/ppo_loss.h"

#include <gtest/gtest.h>

#include <cmath>

#include "consac/base/rng.h"

namespace consac::learn {
namespace {

TEST(PpoLoss, GoldenVector) {
  const float returns[] = {1, 2, 0}, old_value[] = {0.5f, 1, 0.5f}, old_nlp[] = {1, 0.5f, 2},
              nlp[] = {0.9f, 0.8f, 1.9f}, value[] = {0.8f, 1.05f, 0.1f};
  double raw[3], mean = 0, variance = 0;
  for (int i = 0; i < 3; ++i) mean += (raw[i] = returns[i] - old_value[i]) / 3;
  for (const double a : raw) variance += (a - mean) * (a - mean) / 3;
  const double expected[] = {0.267261, 1.069045, -1.336306};
  const PpoLossForm form{0.2f, 0.2f, 0.5f, true, true};
  double policy = 0, value_loss = 0, kl = 0, clipped = 0;
  for (int i = 0; i < 3; ++i) {
    const auto advantage = static_cast<float>((raw[i] - mean) / (std::sqrt(variance) + 1e-8));
    EXPECT_NEAR(advantage, expected[i], 1e-6);
    const PpoLossTerms terms = PpoLossOf(
        form, {advantage, returns[i], old_value[i], old_nlp[i], value[i], nlp[i], std::exp(old_nlp[i] - nlp[i])});
    policy += terms.policy / 3;
    value_loss += terms.value / 3;
    kl += terms.kl / 3;
    clipped += terms.clipped / 3;
  }
  EXPECT_NEAR(policy, 0.129836, 1e-6);
  EXPECT_NEAR(value_loss, 0.180417, 1e-6);
  EXPECT_NEAR(kl, 0.018333, 1e-6);
  EXPECT_NEAR(clipped, 0.333333, 1e-6);
  EXPECT_NEAR(policy + 0.5 * value_loss, 0.220045, 1e-6);
}

TEST(PpoLoss, DerivativesMatchDifferences) {
  Rng rng(1, 1);
  for (const bool sb2 : {true, false}) {
    for (const float clip_vf : {-1.0f, 0.2f}) {
      const PpoLossForm form{0.2f, clip_vf, 0.5f, sb2, sb2};
      for (int i = 0; i < 2000; ++i) {
        const float advantage = rng.Normal(), returns = rng.Normal(), old_value = rng.Normal(),
                    old_nlp = 1 + 0.3f * rng.Normal();
        const float value = old_value + 0.3f * rng.Normal(), nlp = old_nlp + 0.3f * rng.Normal();
        const auto total = [&](float v, float n) {
          const PpoLossTerms terms =
              PpoLossOf(form, {advantage, returns, old_value, old_nlp, v, n, std::exp(old_nlp - n)});
          return static_cast<double>(terms.policy) + 0.5 * static_cast<double>(terms.value);
        };
        const PpoLossTerms terms =
            PpoLossOf(form, {advantage, returns, old_value, old_nlp, value, nlp, std::exp(old_nlp - nlp)});
        const float step = 1e-3f;
        // Where a step crosses a kink the difference means nothing.
        const float ratio = std::exp(old_nlp - nlp), change = std::fabs(value - old_value);
        const bool near_kink =
            std::fabs(std::fabs(ratio - 1) - 0.2f) < 5e-3f || std::fabs(change - 0.2f) < 5e-3f ||
            (clip_vf > 0 && change > 0.2f &&
             std::fabs(std::fabs(value - returns) -
                       std::fabs(old_value + std::copysign(0.2f, value - old_value) - returns)) < 1e-2f);
        if (near_kink) continue;
        EXPECT_NEAR(terms.d_neglogp, (total(value, nlp + step) - total(value, nlp - step)) / (2 * step),
                    5e-3 * (1 + std::fabs(terms.d_neglogp)));
        EXPECT_NEAR(terms.d_value, (total(value + step, nlp) - total(value - step, nlp)) / (2 * step),
                    5e-3 * (1 + std::fabs(terms.d_value)));
      }
    }
  }
}

}  // namespace
}  // namespace consac::learn
