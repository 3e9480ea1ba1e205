// TD3 as a whole: its updates are the equations' in float64, it learns trivial tasks; and the noise that explores. What
// holds of every algorithm is every_learner_test.cpp's.
#include <algorithm>
#include <cmath>
#include <string>

#include "collect/continuous_exploration.h"
#include "learn/test/algo/continuous_reference.h"
#include "learn/test/algo/off_policy_harness.h"

namespace consac::learn {
namespace {

/// One step of TD3 in float64 beside the learner's.
class ReferenceTd3 {
 public:
  ReferenceTd3(Learner& learner, bool tensorflow, std::size_t n_critics)
      : n_critics_(n_critics),
        actor_(*nn::Network::Create(learner.Snapshot().network), StateOf(learner, "actor/parameters"), tensorflow),
        critics_(
            *nn::Network::Create(*nn::Critics(
                KnownWorld().behaviour.observation_layout,
                {.tower = KnownTower({4, 3}), .action_size = 2, .count = static_cast<std::int64_t>(n_critics)}, {})),
            StateOf(learner, "critics/parameters"), tensorflow),
        rng_(3, StreamId("target_policy_noise")) {}

  void Step(const KnownTransition& t) {
    Numbers targets;
    for (std::size_t r = 0; r < kReferenceRows; ++r) {
      Numbers next = actor_.RunTarget({t.next_observation})[0];
      for (double& number : next)
        number = std::clamp(number + std::clamp(0.3 * static_cast<double>(rng_.Normal()), -0.4, 0.4), -1.0, 1.0);
      const auto q = critics_.RunTarget({t.next_observation, next});
      targets.push_back(t.reward + (t.terminated ? 0.0 : kReferenceGamma) * LeastOf(q, n_critics_));
    }
    const auto loss = [&] {
      const auto q = critics_.Run({t.observation, t.action});
      double sum = 0.0;
      for (const double target : targets) {
        for (std::size_t k = 0; k < n_critics_; ++k) sum += (q[k][0] - target) * (q[k][0] - target) / kReferenceRows;
      }
      return sum;
    };
    critic_loss = loss();
    critics_.Step(critics_.Gradient(loss));
    if (++updates_ % 3 != 0) return;
    const auto cost = [&] { return -critics_.Run({t.observation, actor_.Run({t.observation})[0]})[0][0]; };
    actor_loss = cost();
    actor_.Step(actor_.Gradient(cost));
    actor_.Follow();
    critics_.Follow();
  }
  void Expect(Learner& learner) {
    const std::string at = " after update " + std::to_string(updates_);
    ExpectNear(StateOf(learner, "actor/parameters"), actor_.now, 2e-5, "actor" + at);
    ExpectNear(StateOf(learner, "actor/target"), actor_.target, 2e-5, "actor's target" + at);
    ExpectNear(StateOf(learner, "critics/parameters"), critics_.now, 2e-5, "critics" + at);
    ExpectNear(StateOf(learner, "critics/target"), critics_.target, 2e-5, "critics' target" + at);
  }

  double actor_loss = 0.0, critic_loss = 0.0;

 private:
  using Numbers = std::vector<double>;
  std::size_t n_critics_;
  ReferenceLearned actor_, critics_;
  Rng rng_;
  int updates_ = 0;
};

TEST(Td3, UpdatesAreTheEquationsInFloat64) {
  for (const auto& [tensorflow, n_critics] : {std::pair(false, std::size_t{2}), std::pair(true, std::size_t{2}),
                                              std::pair(false, std::size_t{1}), std::pair(false, std::size_t{3})}) {
    SCOPED_TRACE(n_critics);
    Settings settings = KnownSettings(tensorflow);
    settings.push_back({"n_critics", CountText(n_critics)});
    for (const auto& setting : Settings{{"learning_rate", "0.01"},
                                        {"policy_delay", "3"},
                                        {"target_policy_noise", "0.3"},
                                        {"target_noise_clip", "0.4"}})
      settings.push_back(setting);
    const std::unique_ptr<Learner> learner = MakeKnown("td3", settings);
    ReferenceTd3 reference(*learner, tensorflow, n_critics);
    std::int64_t reports = 0;
    DriveKnown(
        *learner, 30,
        [&](const KnownTransition&) {
          if (learner->reports() == reports) return;
          reports = learner->reports();
          EXPECT_NEAR(MetricOf(*learner, "train/actor_loss"), reference.actor_loss, 1e-4);
          EXPECT_NEAR(MetricOf(*learner, "train/critic_loss"), reference.critic_loss, 1e-4);
        },
        [&](const KnownTransition& t) {
          reference.Step(t);
          reference.Expect(*learner);
        });
    EXPECT_GE(reports, 2);
  }
}

TEST(Td3, LearnsTheIdentity) {
  const Settings base = {{"learning_rate", "1e-3"}, {"gamma", "0.4"},     {"net_arch", "[64, 64]"},
                         {"buffer_size", "5000"},   {"noise_std", "0.1"}, {"action_noise", "normal"},
                         {"batch_size", "128"}};
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 1, {"td3", base, 1000}), 0.9);
  Settings many = base;
  many.push_back({"gradient_steps", "-1"});
  many.push_back({"action_noise", "ornstein_uhlenbeck"});
  EXPECT_GE(TrainedReward(*Space::Box(-2, 3, {1}), 4, {"td3", many, 3000}), 0.8);
}

TEST(Td3, ReportsUnderTheKeysThatWereAskedFor) {
  ExpectReportsEveryFourthEpisode({"td3", {{"log_keys", "sb2"}, {"net_arch", "[8]"}, {"batch_size", "8"}}, 10000},
                                  {"episodes", "mean 100 episode reward", "current_lr", "qf1_loss", "qf2_loss", ""});
  ExpectReportsEveryFourthEpisode(
      {"td3", {{"log_keys", "sb3"}, {"net_arch", "[8]"}, {"batch_size", "8"}}, 10000},
      {"time/episodes", "train/learning_rate", "train/n_updates", "train/critic_loss", "train/actor_loss"});
  ExpectReportsEveryFourthEpisode(
      {"td3", {{"log_keys", "sb2"}, {"net_arch", "[8]"}, {"batch_size", "8"}, {"n_critics", "3"}}, 10000},
      {"episodes", "mean 100 episode reward", "current_lr", "qf1_loss", "qf2_loss", "qf3_loss", ""});
}

// Stable Baselines3, TD3.__init__, and Stable Baselines 2.10.2's.
TEST(Tables, Td3HasBothGenerationsNamesAndDefaults) {
  ExpectDefaults("td3",
                 {{"gamma", "0.99"},
                  {"learning_rate", "1e-3"},
                  {"buffer_size", "1000000"},
                  {"learning_starts", "100"},
                  {"batch_size", "256"},
                  {"tau", "0.005"},
                  {"train_freq", "1"},
                  {"gradient_steps", "1"},
                  {"policy_delay", "2"},
                  {"target_policy_noise", "0.2"},
                  {"target_noise_clip", "0.5"},
                  {"n_critics", "2"},
                  {"net_arch", "[400, 300]"}},
                 {{"learning_rate", "3e-4"},
                  {"buffer_size", "50000"},
                  {"batch_size", "128"},
                  {"tau", "0.005"},
                  {"train_freq", "100"},
                  {"gradient_steps", "100"},
                  {"policy_delay", "2"},
                  {"random_exploration", "0"},
                  {"layers", "[64, 64]"},
                  {"action_noise", "none"}});
}

// The golden vector: deviation 0.2, theta 0.15, dt 0.01 from 0 with the normal numbers 1, -0.5, 2.
TEST(ContinuousExploration, OrnsteinUhlenbeckNoiseIsTheGoldenVector) {
  ActionNoiseOptions noise;
  noise.kind = ActionNoiseKind::kOrnsteinUhlenbeck;
  noise.sigma = 0.2;
  double now = 0.0;
  for (const auto& [normal, expected] : {std::pair(1.0, 0.02), std::pair(-0.5, 0.00997), std::pair(2.0, 0.04995505)}) {
    now = noise.Next(now, normal);
    EXPECT_NEAR(now, expected, 1e-8);
  }
  noise.kind = ActionNoiseKind::kNormal;
  noise.mean = 0.5;
  EXPECT_DOUBLE_EQ(noise.Next(7.0, -1.0), 0.3) << "normal noise remembers nothing";
}

TEST(ContinuousExploration, IsWithinTheBoundsPerSlotAndBeginsAnewWithTheEpisode) {
  ContinuousExplorationOptions options;
  options.noise = {.kind = ActionNoiseKind::kOrnsteinUhlenbeck, .mean = 5.0, .sigma = 0.0, .theta = 1.0, .dt = 0.1};
  ContinuousExploration exploration(options, 2, 1, 1);
  const std::int32_t both[] = {0, 1};
  float raw[] = {0.0f, 0.0f};
  exploration.Explore(both, false, raw);
  EXPECT_FLOAT_EQ(raw[0], 0.5f);
  EXPECT_FLOAT_EQ(raw[1], 0.5f);
  exploration.Begin(1);
  raw[0] = raw[1] = 0.0f;
  exploration.Explore(both, false, raw);
  EXPECT_FLOAT_EQ(raw[0], 0.95f) << "drawn on towards 5";
  EXPECT_FLOAT_EQ(raw[1], 0.5f) << "begun anew";
  raw[0] = 0.9f;
  exploration.Explore({both, 1}, false, raw);
  EXPECT_FLOAT_EQ(raw[0], 1.0f);

  options.noise.kind = ActionNoiseKind::kNone;
  options.random_exploration = 0.25;
  ContinuousExploration some(options, 2, 1, 1);
  int random = 0;
  double sum = 0.0;
  for (int i = 0; i < 4000; ++i) {
    raw[0] = 2.0f;  // what no random action is
    some.Explore({both, 1}, false, raw);
    if (raw[0] == 2.0f) continue;
    ++random;
    sum += static_cast<double>(raw[0]);
    ASSERT_LE(std::fabs(raw[0]), 1.0f);
  }
  EXPECT_NEAR(random / 4000.0, 0.25, 0.03);
  EXPECT_NEAR(sum / random, 0.0, 0.1);
}

}  // namespace
}  // namespace consac::learn
