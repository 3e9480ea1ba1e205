// The pieces that algorithms are composed of, each alone. What they do together is the algorithms' tests'.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "algo/parameter_rows.h"
#include "algo/progress.h"
#include "collect/shuffled_passes.h"
#include "collect/step_memory.h"
#include "collect/sums.h"
#include "collect/unvalued_steps.h"
#include "collect/vec_normalise.h"
#include "consac/env/buffer.h"
#include "optim/gradient_step.h"

namespace consac::learn {
namespace {

TEST(GradientStep, ClipsSkipsWhatIsNotFiniteAndEndsAfterAnUpdateOfNothingElse) {
  RmsPropOptions options;
  options.form = OptimiserForm::kPyTorch;
  GradientStep step(Optimiser(RmsProp(2, options)), 1.0);
  std::vector<float> parameters = {1.0f, 1.0f};
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> bad = {nan, 0.0f}, good = {3.0f, 4.0f};
  step.Begin();
  EXPECT_FALSE(step.Apply(parameters, bad, 0.1f));
  EXPECT_EQ(parameters, (std::vector<float>{1.0f, 1.0f}));
  EXPECT_TRUE(step.Apply(parameters, good, 0.1f));
  // g = (0.6, 0.8) after the clip; PyTorch's root of (1 - 0.99) g^2 makes every direction 10 steps long.
  EXPECT_NEAR(parameters[0], 0.0f, 1e-3f);
  EXPECT_NEAR(parameters[1], 0.0f, 1e-3f);
  step.Finish(1, 2);
  EXPECT_TRUE(step.health().ok());
  step.Begin();
  EXPECT_FALSE(step.Apply(parameters, bad, 0.1f));
  step.Finish(2, 1);
  EXPECT_EQ(step.health().code(), StatusCode::kNonFinite);
  EXPECT_NE(step.health().message().find("update 2"), std::string::npos) << step.health().message();
}

// Stable Baselines, VecNormalize: the return is forgotten after the step that ends an episode, not before.
TEST(VecNormalise, ScalesRewardsByTheDeviationOfTheReturn) {
  const BehaviourSpec behaviour = BehaviourSpec::Of("default", *Space::Box(-1, 1, {1}), *Space::Discrete(2), 1);
  VecNormaliseOptions options;
  options.norm_reward = true;
  options.clip_reward = 1000.0;
  options.gamma = 0.5;
  VecNormalise normalise(behaviour, options);
  RunningMoments returns(1);
  BatchBuffer buffer(behaviour);
  Batch& batch = buffer.batch();
  float discounted = 0.0f;
  for (const bool ends : {false, true, false}) {
    batch.rewards[0] = 2.0f;
    batch.terminated[0] = ends ? 1 : 0;
    batch.truncated[0] = 0;
    discounted = discounted * 0.5f + 2.0f;
    returns.Update(&discounted, 1);
    float scaled = 0.0f;
    normalise.Rewards(batch, &scaled);
    EXPECT_FLOAT_EQ(scaled, static_cast<float>(2.0 / std::sqrt(returns.variance[0] + 1e-8)));
    if (ends) discounted = 0.0f;
  }
}

TEST(VecNormalise, WithoutItNumbersPassAsTheyAre) {
  const BehaviourSpec behaviour = BehaviourSpec::Of("default", *Space::Box(-9, 9, {1}), *Space::Discrete(2), 1);
  VecNormalise normalise(behaviour, {});
  const float seen = 7.5f;
  float feature = 0.0f;
  normalise.Observe(reinterpret_cast<const std::byte*>(&seen), 1);
  normalise.Encode(reinterpret_cast<const std::byte*>(&seen), 1, &feature);
  EXPECT_EQ(feature, 7.5f);
  EXPECT_FALSE(normalise.frozen().active());
}

TEST(Progress, IsAShareOfTheTrainingWhateverItsLength) {
  EXPECT_EQ(ElapsedShare(0, 200), 0.0);
  EXPECT_EQ(ElapsedShare(50, 200), 0.25);
  EXPECT_EQ(ElapsedShare(300, 200), 1.5);
  EXPECT_EQ(RemainingShare(50, 200), 0.75);
  EXPECT_EQ(RemainingShare(300, 200), 0.0) << "a run that went on for longer";
  EXPECT_EQ(RemainingShare(0, 0), 1.0) << "no steps are planned";
}

TEST(StepMemory, RowsOfAPartAreFiledUnderTheirSlots) {
  StepMemory memory(3, 2, 1);
  const std::vector<std::int32_t> all{0, 1, 2}, part{0, 2};
  const StepRows whole = memory.Stage(all);
  std::iota(whole.features, whole.features + 6, 0.0f);
  memory.Keep(all);
  const StepRows some = memory.Stage(part);
  for (int i = 0; i < 2; ++i) {
    some.features[2 * i] = some.features[2 * i + 1] = some.raw[i] = some.values[i] = some.neglogp[i] = 10.0f + i;
  }
  memory.Keep(part);
  EXPECT_EQ(memory.Row(0).features[1], 10.0f);
  EXPECT_EQ(memory.Row(1).features[0], 2.0f) << "a slot that did not act keeps what it was doing";
  EXPECT_EQ(*memory.Row(2).values, 11.0f);
  EXPECT_EQ(*memory.Row(2).raw, 11.0f);
}

// A step is recorded after its value is found, before, or never, where its world was lost.
TEST(UnvaluedSteps, AValueGoesWhereItsStepIsByThen) {
  using Given = std::vector<std::pair<std::size_t, float>>;
  UnvaluedSteps steps(3, 2, 4);
  const auto give = [&steps] {
    std::vector<float> values;
    for (std::int64_t i = 0; i < steps.size(); ++i) values.push_back(steps.features()[2 * i + 1]);
    std::pair<Given, Given> given;
    steps.Give(
        values.data(), [&](std::size_t row, float value) { given.first.emplace_back(row, value); },
        [&](std::int32_t slot, float value) { given.second.emplace_back(slot, value); });
    return given;
  };
  const std::int32_t all[] = {0, 1, 2}, second[] = {1};
  const float seen[] = {0, 10, 0, 11, 0, 12}, seen_by_second[] = {0, 20};
  steps.Begin(all, seen);
  EXPECT_TRUE(steps.Record(0, 70));
  EXPECT_TRUE(steps.HasRoomFor(1));
  steps.Begin(second, seen_by_second);  // what it saw before is never recorded
  EXPECT_FALSE(steps.HasRoomFor(1));
  EXPECT_TRUE(steps.Record(1, 71));
  EXPECT_EQ(give(), (std::pair<Given, Given>{{{70, 10.0f}, {71, 20.0f}}, {{2, 12.0f}}}));
  EXPECT_FALSE(steps.Record(2, 72)) << "it has its value";
  EXPECT_EQ(steps.size(), 0);
  steps.Begin(second, seen_by_second);
  steps.Clear();
  EXPECT_FALSE(steps.Record(1, 73));
  EXPECT_EQ(give(), (std::pair<Given, Given>{}));
}

TEST(ShuffledPasses, EveryRowOnceAPassAndTheRestIsTheLastMinibatch) {
  ShuffledPasses passes(10, 1);
  std::vector<std::int32_t> rows(10);
  std::iota(rows.begin(), rows.end(), 0);
  passes.Begin(rows);
  std::vector<int> seen(10);
  std::vector<std::size_t> sizes;
  while (passes.finished() < 2) {
    const auto minibatch = passes.Next(4);
    sizes.push_back(minibatch.size());
    for (const std::int32_t row : minibatch) ++seen[static_cast<std::size_t>(row)];
  }
  EXPECT_EQ(seen, std::vector<int>(10, 2));
  EXPECT_EQ(sizes, (std::vector<std::size_t>{4, 4, 2, 4, 4, 2}));
  EXPECT_EQ(passes.begun(), 2);
}

constexpr const char* kTwoSums[] = {"first", "second"};

TEST(LossLog, MeansOfMinibatchesOfPassesAndOfTheUpdate) {
  LossLog<kTwoSums> log(100);
  log.BeginUpdate();
  log.BeginPass();
  log.block(0) = {{64.0, 128.0}};
  log.block(1) = {{36.0, 72.0}};
  log.AddMinibatch(100, 100);
  EXPECT_DOUBLE_EQ(log.last()[1], 2.0);
  log.BeginPass();
  log.block(0) = {{30.0, 0.0}};
  log.AddMinibatch(10, 10);
  EXPECT_DOUBLE_EQ(log.UpdateMeans()[0], 2.0);
  EXPECT_DOUBLE_EQ(log.PassMean(0), 3.0);
  EXPECT_EQ(log.minibatches(), 2);
}

enum class ToyKind : std::uint8_t { kPlain, kPlainer };
struct ToyInner {
  double rate = 0;
};
struct ToyOptions {
  std::int64_t count = 0;
  ToyInner inner;
  ToyKind kind = ToyKind::kPlain;
};
constexpr ParameterRow<ToyOptions> kToyOwn[] = {
    {"number", "count", Into<ToyOptions, &ToyOptions::count>, "4", "none", 1, 9, "", "how many",
     ParameterSource::kBoth},
    {"rate", "rate", Into<ToyOptions, &ToyOptions::inner, &ToyInner::rate>, "1", "2", 0, 9, "none", "how fast",
     ParameterSource::kSb3},
    {"kind", "kind", Into<ToyOptions, &ToyOptions::kind>, "plain", "plainer", 0, 0, "plain|plainer", "which",
     ParameterSource::kConsac},
};
constexpr auto kToyRows = std::tie(kToyOwn);

TEST(ParameterRows, OneRowIsATableOfEachGenerationAndAMember) {
  const auto of2 = TableOf(kToyRows, Generation::kStableBaselines2, {"two", "three"}),
             of3 = TableOf(kToyRows, Generation::kStableBaselines3, {"two", "three"});
  EXPECT_STREQ(of2[0].name, "number");
  EXPECT_STREQ(of2[0].alias, "count");
  EXPECT_STREQ(of3[0].name, "count");
  EXPECT_STREQ(of2[0].source, "two");
  EXPECT_STREQ(of3[0].source, "three");
  EXPECT_STREQ(of2[0].choices, "") << "must be there where its own default is";
  EXPECT_STREQ(of3[0].choices, "none");
  EXPECT_STREQ(of2[0].sb3_default, "4") << "the other generation's none cannot be had here";
  EXPECT_EQ(of2[2].type, ParameterType::kChoice);

  HyperparameterSet values(of2);
  ToyOptions options;
  ASSERT_TRUE(values.Set("count", "7").ok());
  ASSERT_TRUE(ReadRows(kToyRows, values, &options).ok());
  EXPECT_EQ(options.count, 7);
  EXPECT_EQ(options.inner.rate, 1.0);
  EXPECT_EQ(options.kind, ToyKind::kPlain);
  values.UseDefaultsOf(Generation::kStableBaselines3);
  ASSERT_TRUE(ReadRows(kToyRows, values, &options).ok());
  EXPECT_EQ(options.count, 4);
  EXPECT_EQ(options.inner.rate, 2.0);
  EXPECT_EQ(options.kind, ToyKind::kPlainer);
}

}  // namespace
}  // namespace consac::learn
