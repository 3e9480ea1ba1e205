// SAC as a whole: its updates are the equations' in float64, and it learns trivial tasks. What holds of every algorithm
// is every_learner_test.cpp's.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "algo/entropy_coefficient.h"
#include "grad/squashed_samples.h"
#include "learn/test/algo/continuous_reference.h"
#include "learn/test/algo/off_policy_harness.h"

namespace consac::learn {
namespace {

ActionHead SquashedHead(std::int64_t size) {
  const Layout actions = Layout::Of(*Space::Box(-1, 1, {size}));
  const HeadSpec head{"", "squashed_gaussian"};
  return *ActionHead::Create(actions, {&head, 1});
}

// The golden vector of the squashed Gaussian, its noise put in by hand.
TEST(SquashedSamples, AreTheGoldenVector) {
  Rng rng(5, 5);
  Rng copy = rng;
  const double noise[] = {static_cast<double>(copy.Normal()), static_cast<double>(copy.Normal())};
  const double wanted[] = {0.7, -1.2}, log_std[] = {-0.5, 0.1}, mean[] = {0.3, -0.2};
  float head[4];
  double correction = 0.0;
  for (std::size_t i = 0; i < 2; ++i) {
    head[i] = static_cast<float>(mean[i] + std::exp(log_std[i]) * (wanted[i] - noise[i]));
    head[2 + i] = static_cast<float>(log_std[i]);
    correction += 0.5 * (noise[i] * noise[i] - wanted[i] * wanted[i]);
  }
  SquashedSamples samples(SquashedHead(2), 1);
  samples.Draw(head, 1, rng);
  EXPECT_NEAR(samples.actions()[0], 0.619733, 2e-6);
  EXPECT_NEAR(samples.actions()[1], -0.909773, 2e-6);
  EXPECT_NEAR(static_cast<double>(samples.log_probabilities()[0]) + correction, -0.159821, 5e-6);
  EXPECT_NEAR(samples.NormalEntropy(0), 2.837877066409345 - 0.4, 1e-6);
}

TEST(SquashedSamples, GradientsMatchDifferencesAndClippedDeviationsHaveNone) {
  const ActionHead actions = SquashedHead(2);
  const float weights[] = {0.7f, -1.3f};
  const std::vector<float> at = {0.4f, -0.3f, -0.7f, 2.5f};
  const auto loss = [&](const std::vector<float>& head, SquashedSamples& samples) {
    Rng rng(8, 8);
    samples.Draw(head.data(), 1, rng);
    return static_cast<double>(weights[0] * samples.actions()[0] + weights[1] * samples.actions()[1] +
                               0.6f * samples.log_probabilities()[0]);
  };
  SquashedSamples samples(actions, 1), moved(actions, 1);
  loss(at, samples);
  float gradient[4];
  samples.Backward(0, weights, 0.6f, gradient, nullptr);
  for (std::size_t i = 0; i < 4; ++i) {
    std::vector<float> above = at, below = at;
    above[i] += 1e-2f;
    below[i] -= 1e-2f;
    EXPECT_NEAR(gradient[i], (loss(above, moved) - loss(below, moved)) / 2e-2, 2e-3) << i;
  }
  EXPECT_EQ(gradient[3], 0.0f) << "its log deviation is above 2";
}

// d/d(means, phi, log sigmas) of a loss of two rows' actions and log-probabilities, the matrix's own numbers held fast.
TEST(SquashedSamples, OfTheStateGradientsMatchDifferences) {
  for (const StateNoise& noise : {StateNoise{.features = 3, .clip_mean = 0.5f},
                                  StateNoise{.features = 3, .full_std = false, .use_expln = true}}) {
    const HeadSpec spec{"", "squashed_sde_gaussian", noise};
    const ActionHead head = *ActionHead::Create(Layout::Of(*Space::Box(-1, 1, {2})), {&spec, 1});
    const float weights[] = {0.7f, -1.3f, 0.4f, 0.9f}, log_p_weights[] = {0.6f, -0.3f};
    const std::vector<float> at = {0.3f, -0.8f, 0.7f, -1.1f, 0.4f, -0.2f, 0.1f, 0.5f, 0.3f, -0.9f};  // [2, 2 + 3]
    std::vector<float> log_std = {-0.5f, 0.3f, -1.0f, 0.8f, 0.1f, -0.2f};
    log_std.resize(static_cast<std::size_t>(head.log_std_size()));
    const auto loss = [&](const std::vector<float>& said, const std::vector<float>& own, StateMatrices& matrices,
                          SquashedSamples& samples) {
      Rng rng(8, 8), unused(1, 1);
      matrices.Draw(own.data(), rng);
      samples.Draw(said.data(), 2, unused);
      double sum = 0.0;
      for (std::size_t i = 0; i < 4; ++i) sum += static_cast<double>(weights[i] * samples.actions()[i]);
      for (std::size_t r = 0; r < 2; ++r) sum += static_cast<double>(log_p_weights[r] * samples.log_probabilities()[r]);
      return sum;
    };
    StateMatrices matrices(head);
    SquashedSamples samples(head, 2, &matrices);
    loss(at, log_std, matrices, samples);
    std::vector<float> d_head(at.size()), d_log_std(log_std.size());
    for (std::int64_t r = 0; r < 2; ++r)
      samples.Backward(r, weights + 2 * r, log_p_weights[r], d_head.data() + 5 * r, d_log_std.data());
    for (std::size_t i = 0; i < at.size(); ++i) {
      std::vector<float> said = at;
      double sides[2];
      for (const int side : {0, 1}) {
        said[i] = at[i] + (side == 0 ? -5e-3f : 5e-3f);
        sides[side] = loss(said, log_std, matrices, samples);
      }
      EXPECT_NEAR(d_head[i], (sides[1] - sides[0]) / 1e-2, 3e-3 * (1 + std::fabs(d_head[i]))) << "head " << i;
    }
    for (std::size_t i = 0; i < log_std.size(); ++i) {
      std::vector<float> own = log_std;
      double sides[2];
      for (const int side : {0, 1}) {
        own[i] = log_std[i] + (side == 0 ? -5e-3f : 5e-3f);
        sides[side] = loss(at, own, matrices, samples);
      }
      EXPECT_NEAR(d_log_std[i], (sides[1] - sides[0]) / 1e-2, 3e-3 * (1 + std::fabs(d_log_std[i]))) << "sigma " << i;
    }
    if (noise.clip_mean > 0.0f) {
      EXPECT_EQ(d_head[1], 0.0f) << "its mean is beyond the clip";
    }
  }
}

/// One step of SAC in float64 beside the learner's.
class ReferenceSac {
 public:
  ReferenceSac(Learner& learner, bool tensorflow, bool value_network, std::size_t n_critics, bool sde)
      : value_network_(value_network),
        n_critics_(n_critics),
        sde_(sde),
        actor_(*nn::Network::Create(learner.Snapshot().network), StateOf(learner, "actor/parameters"), tensorflow),
        critics_(CriticsNetwork(value_network, n_critics), StateOf(learner, "critics/parameters"), tensorflow),
        log_coefficient_(CoefficientNetwork(), {0.0f, 0.0f}, tensorflow),
        rng_(3, StreamId("sac_samples")) {}

  void Step(const KnownTransition& t) {
    matrix_.clear();
    while (sde_ && matrix_.size() < 2 * kFeatures) matrix_.push_back(static_cast<double>(rng_.Normal()));
    const std::vector<Numbers> now = Noise();
    const double coefficient = std::exp(log_coefficient_.now[0]);
    double surplus = 0.0;
    const Numbers head = Head(t.observation);
    for (const Numbers& noise : now) surplus += (Draw(head, noise).log_p - 2.0) / kRows;
    coefficient_loss = -log_coefficient_.now[0] * surplus;
    log_coefficient_.Step({-surplus, 0.0});
    Numbers targets, value_targets;
    if (!value_network_) {
      const Numbers next_head = Head(t.next_observation);
      for (const Numbers& noise : Noise()) {
        const Sample next = Draw(next_head, noise);
        const auto q = critics_.RunTarget({t.next_observation, next.action});
        targets.push_back(t.reward + Follows(t) * (LeastOf(q, n_critics_) - coefficient * next.log_p));
      }
    } else {
      for (const Numbers& noise : now) {
        const Sample sample = Draw(head, noise);
        const auto q = critics_.Run({t.observation, sample.action});
        targets.push_back(t.reward + Follows(t) * critics_.RunTarget({t.next_observation, t.action})[n_critics_][0]);
        value_targets.push_back(LeastOf(q, n_critics_) - coefficient * sample.log_p);
      }
      StepActor(t, now, coefficient);
    }
    const auto loss = [&] {
      const auto q = critics_.Run({t.observation, t.action});
      double sum = 0.0;
      for (std::size_t r = 0; r < kReferenceRows; ++r) {
        for (std::size_t k = 0; k < n_critics_; ++k)
          sum += 0.5 * (q[k][0] - targets[r]) * (q[k][0] - targets[r]) / kRows;
        if (value_network_)
          sum += 0.5 * (q[n_critics_][0] - value_targets[r]) * (q[n_critics_][0] - value_targets[r]) / kRows;
      }
      return sum;
    };
    critic_loss = loss();
    critics_.Step(critics_.Gradient(loss));
    if (!value_network_) StepActor(t, now, coefficient);
    critics_.Follow();
  }

  void Expect(Learner& learner, int step) {
    const std::string at = " after step " + std::to_string(step);
    ExpectNear(StateOf(learner, "actor/parameters"), actor_.now, 2e-5, "actor" + at);
    ExpectNear(StateOf(learner, "critics/parameters"), critics_.now, 2e-5, "critics" + at);
    ExpectNear(StateOf(learner, "critics/target"), critics_.target, 2e-5, "target" + at);
    ASSERT_NEAR(StateOf(learner, "ent_coef/log_ent_coef")[0], log_coefficient_.now[0], 2e-5) << at;
  }

  double actor_loss = 0.0, critic_loss = 0.0, coefficient_loss = 0.0;

 private:
  using Numbers = std::vector<double>;
  struct Sample {
    Numbers action;
    double log_p;
  };
  static constexpr double kRows = static_cast<double>(kReferenceRows), kClipMean = 0.4;
  static constexpr std::size_t kFeatures = 4;  // of the actor's last hidden layer

  static nn::Network CriticsNetwork(bool value_network, std::size_t n_critics) {
    nn::CriticsOptions options{.tower = KnownTower({4, 3}), .action_size = 2};
    options.state_value = value_network;
    options.count = static_cast<std::int64_t>(n_critics);
    return *nn::Network::Create(*nn::Critics(KnownWorld().behaviour.observation_layout, options, {}));
  }
  /// Only its optimiser is used.
  static nn::Network CoefficientNetwork() {
    nn::ActorOptions options{.tower = KnownTower({})};
    return *nn::Network::Create(*nn::Actor(Layout::Of(*Space::Box(-1, 1, {1})), options, {}));
  }
  static double Follows(const KnownTransition& t) { return t.terminated ? 0.0 : kReferenceGamma; }

  std::vector<Numbers> Noise() {
    std::vector<Numbers> rows;
    if (sde_) return std::vector<Numbers>(kReferenceRows, matrix_);
    for (std::size_t r = 0; r < kReferenceRows; ++r) {
      const double first = static_cast<double>(rng_.Normal());
      rows.push_back({first, static_cast<double>(rng_.Normal())});
    }
    return rows;
  }
  /// What the actor says of an observation: means and log deviations, or means and features.
  Numbers Head(const Numbers& observation) const { return actor_.Run({observation})[0]; }
  Sample Draw(const Numbers& head, const Numbers& noise) const {
    Sample sample{{}, 0.0};
    for (std::size_t i = 0; sde_ && i < 2; ++i) {
      double drawn = 0.0, variance = 1e-6;
      for (std::size_t l = 0; l < kFeatures; ++l) {
        const double sigma = std::exp(actor_.now[actor_.now.size() - 2 * kFeatures + 2 * l + i]), phi = head[2 + l];
        drawn += phi * sigma * noise[2 * l + i];
        variance += phi * phi * sigma * sigma;
      }
      sample.action.push_back(std::tanh(std::clamp(head[i], -kClipMean, kClipMean) + drawn));
      sample.log_p -= 0.5 * drawn * drawn / variance + 0.5 * std::log(2.0 * std::acos(-1.0) * variance) +
                      std::log(1.0 - sample.action[i] * sample.action[i] + 1e-6);
    }
    for (std::size_t i = 0; !sde_ && i < 2; ++i) {
      const double log_std = std::clamp(head[2 + i], -20.0, 2.0);
      sample.action.push_back(std::tanh(head[i] + std::exp(log_std) * noise[i]));
      sample.log_p -= 0.5 * noise[i] * noise[i] + log_std + 0.5 * std::log(2.0 * std::acos(-1.0)) +
                      std::log(1.0 - sample.action[i] * sample.action[i] + 1e-6);
    }
    return sample;
  }
  void StepActor(const KnownTransition& t, const std::vector<Numbers>& noises, double coefficient) {
    const auto loss = [&] {
      double sum = 0.0;
      const Numbers head = Head(t.observation);  // every row's, since all are of one transition
      for (const Numbers& noise : noises) {
        const Sample sample = Draw(head, noise);
        const auto q = critics_.Run({t.observation, sample.action});
        sum += (coefficient * sample.log_p - (value_network_ ? q[0][0] : LeastOf(q, n_critics_))) / kRows;
      }
      return sum;
    };
    actor_loss = loss();
    actor_.Step(actor_.Gradient(loss));
  }

  bool value_network_;
  std::size_t n_critics_;
  bool sde_;
  Numbers matrix_;  // the normal numbers of this step's, [features, 2]
  ReferenceLearned actor_, critics_, log_coefficient_;
  Rng rng_;
};

void ExpectTheReferenceSac(bool tensorflow, bool value_network, std::size_t n_critics = 2, bool sde = false) {
  Settings settings = KnownSettings(tensorflow);
  settings.push_back({"learning_rate", "0.01"});
  settings.push_back({"value_network", value_network ? "true" : "false"});
  settings.push_back({"n_critics", CountText(n_critics)});
  if (sde) {
    for (const auto& setting : Settings{{"use_sde", "true"}, {"log_std_init", "-0.7"}, {"clip_mean", "0.4"}})
      settings.push_back(setting);
  }
  const std::unique_ptr<Learner> learner = MakeKnown("sac", settings);
  ReferenceSac reference(*learner, tensorflow, value_network, n_critics, sde);
  int step = 0;
  std::int64_t reports = 0;
  DriveKnown(
      *learner, 12,
      [&](const KnownTransition&) {
        if (learner->reports() == reports || step == 0) return;
        reports = learner->reports();
        EXPECT_NEAR(MetricOf(*learner, "train/actor_loss"), reference.actor_loss, 1e-4);
        EXPECT_NEAR(MetricOf(*learner, "train/ent_coef_loss"), reference.coefficient_loss, 1e-4);
        if (!value_network) {
          EXPECT_NEAR(MetricOf(*learner, "train/critic_loss"), reference.critic_loss, 1e-4);
        }
      },
      [&](const KnownTransition& t) {
        reference.Step(t);
        reference.Expect(*learner, step++);
      });
  EXPECT_EQ(reports, 1) << "every fourth episode";
}

TEST(Sac, UpdatesAreTheEquationsInFloat64) {
  ExpectTheReferenceSac(false, false);
  ExpectTheReferenceSac(true, true);
  for (const std::size_t n_critics : {std::size_t{1}, std::size_t{4}}) ExpectTheReferenceSac(false, false, n_critics);
  ExpectTheReferenceSac(true, true, 3);
  ExpectTheReferenceSac(false, false, 2, true);
  ExpectTheReferenceSac(true, true, 1, true);
}

// Stable Baselines3's learning test and its settings: two numbers, 400 steps, 0.9 of the reward.
TEST(Sac, LearnsTheIdentity) {
  const Settings base = {
      {"learning_rate", "1e-3"}, {"gamma", "0.4"}, {"net_arch", "[64, 64]"}, {"buffer_size", "5000"}};
  const auto with = [&](std::initializer_list<std::pair<const char*, const char*>> more) {
    Settings settings = base;
    settings.insert(settings.end(), more.begin(), more.end());
    return settings;
  };
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 1, {"sac", base, 800}), 0.9);
  EXPECT_GE(TrainedReward(*Space::Box(-2, 3, {1}), 4, {"sac", with({{"gradient_steps", "-1"}}), 2000}), 0.8);
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 1, {"sac", with({{"value_network", "true"}}), 1500}), 0.9);
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 2,
                          {"sac", with({{"norm_obs", "true"}, {"norm_reward", "true"}, {"ent_coef", "0.05"}}), 2000}),
            0.9);
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 2, {"sac", with({{"use_sde", "true"}}), 2000}), 0.9);
}

// Stable Baselines3: uniform before learning_starts unless use_sde_at_warmup; a matrix lasts as sde_sample_freq says.
TEST(Sac, ExploresByTheState) {
  const auto actions = [](const Settings& more) {
    Settings settings = KnownSettings(false);
    for (const auto& setting : more) settings.push_back(setting);
    const std::unique_ptr<Learner> learner = MakeKnown("sac", settings);
    BatchBuffer own(KnownWorld().behaviour);
    const float seen[] = {0.5f, -1.0f};
    std::vector<float> first_numbers;
    std::memcpy(own.batch().next_observations, seen, sizeof(seen));
    learner->Begin(own.batch());
    for (int i = 0; i < 6; ++i) {
      own.Advance();
      learner->Act(own.batch());
      float action[2];
      std::memcpy(action, own.batch().actions, sizeof(action));
      first_numbers.push_back(action[0]);
      own.batch().rewards[0] = 0.0f;
      own.batch().terminated[0] = own.batch().truncated[0] = 0;
      std::memcpy(own.batch().next_observations, seen, sizeof(seen));
      learner->Record(own.batch());
    }
    return first_numbers;
  };
  const Settings lasting = {{"use_sde", "true"}, {"train_freq", "100"}, {"log_std_init", "0"}};
  const auto same = [](const std::vector<float>& drawn, std::size_t from, std::size_t to) {
    return std::all_of(drawn.begin() + static_cast<std::ptrdiff_t>(from),
                       drawn.begin() + static_cast<std::ptrdiff_t>(to),
                       [&](float number) { return number == drawn[from]; });
  };
  EXPECT_TRUE(same(actions(lasting), 0, 6)) << "one state, one action";
  Settings often = lasting;
  often.push_back({"sde_sample_freq", "3"});
  const std::vector<float> twice = actions(often);
  EXPECT_TRUE(same(twice, 0, 3) && same(twice, 3, 6) && twice[0] != twice[3]);
  Settings each_round = lasting;
  each_round.push_back({"train_freq", "2"});
  const std::vector<float> rounds = actions(each_round);
  EXPECT_TRUE(same(rounds, 0, 2) && same(rounds, 2, 4) && rounds[1] != rounds[2]) << "drawn anew as collecting begins";
  Settings warming = lasting;
  warming.push_back({"learning_starts", "50"});
  EXPECT_FALSE(same(actions(warming), 0, 6)) << "uniform";
  warming.push_back({"use_sde_at_warmup", "true"});
  EXPECT_TRUE(same(actions(warming), 0, 6));
  Settings within = lasting;
  within.push_back({"learning_starts", "3"});
  Settings wider = within;
  wider.push_back({"log_std_init", "1"});
  const std::vector<float> narrow_actions = actions(within), wide_actions = actions(wider);
  EXPECT_TRUE(same(narrow_actions, 3, 6));
  EXPECT_NE(narrow_actions[3], wide_actions[3]) << "a warm-up that ends within a round is followed by noise";
}

TEST(Sac, ReportsUnderTheKeysThatWereAskedFor) {
  ExpectReportsEveryFourthEpisode(
      {"sac", {{"log_keys", "sb2"}, {"net_arch", "[8]"}, {"batch_size", "8"}, {"value_network", "true"}}, 10000},
      {"episodes", "mean 100 episode reward", "current_lr", "policy_loss", "qf1_loss", "qf2_loss", "value_loss",
       "entropy", "ent_coef_loss", "ent_coef"});
  ExpectReportsEveryFourthEpisode(
      {"sac", {{"log_keys", "sb3"}, {"net_arch", "[8]"}, {"batch_size", "8"}, {"value_network", "false"}}, 10000},
      {"time/episodes", "train/learning_rate", "train/n_updates", "train/actor_loss", "train/critic_loss",
       "train/ent_coef", "train/ent_coef_loss"});
  ExpectReportsEveryFourthEpisode(
      {"sac", {{"log_keys", "sb3"}, {"net_arch", "[8]"}, {"batch_size", "8"}, {"use_sde", "true"}}, 10000},
      {"time/episodes", "train/learning_rate", "train/n_updates", "train/actor_loss", "train/critic_loss",
       "train/ent_coef", "train/std", "train/ent_coef_loss"});
  ExpectReportsEveryFourthEpisode(
      {"sac", {{"log_keys", "sb2"}, {"net_arch", "[8]"}, {"batch_size", "8"}, {"n_critics", "1"}}, 10000},
      {"episodes", "mean 100 episode reward", "current_lr", "policy_loss", "qf1_loss", "entropy", "ent_coef_loss",
       "ent_coef"});
  ExpectReportsEveryFourthEpisode(
      {"sac", {{"log_keys", "sb2"}, {"net_arch", "[8]"}, {"batch_size", "8"}, {"n_critics", "3"}}, 10000},
      {"episodes", "mean 100 episode reward", "current_lr", "policy_loss", "qf1_loss", "qf2_loss", "entropy",
       "ent_coef_loss", "ent_coef", "qf3_loss"});
}

TEST(Sac, ItsEntropyIsWrittenAsInStableBaselines) {
  EXPECT_TRUE(EntropyCoefficientOptions::Parse("auto")->learned);
  EXPECT_DOUBLE_EQ(EntropyCoefficientOptions::Parse("auto")->initial, 1.0);
  EXPECT_DOUBLE_EQ(EntropyCoefficientOptions::Parse("auto_0.1")->initial, 0.1);
  EXPECT_FALSE(EntropyCoefficientOptions::Parse("0.2")->learned);
  EXPECT_FALSE(EntropyCoefficientOptions::Parse("0")->learned);
  for (const char* text : {"auto_0", "auto_", "auto0.1", "-1", "automatic", ""})
    EXPECT_NE(EntropyCoefficientOptions::Parse(text).status().message().find("expected auto"), std::string::npos)
        << text;
  EXPECT_DOUBLE_EQ(TargetEntropy::Parse("auto")->Of(3), -3.0);
  EXPECT_DOUBLE_EQ(TargetEntropy::Parse("-1.5")->Of(3), -1.5);
  EXPECT_NE(TargetEntropy::Parse("auto_1").status().message().find("expected auto or a number"), std::string::npos);
}

// A learned coefficient falls while the entropy is above its target and rises below it.
TEST(Sac, TheCoefficientFollowsTheTargetEntropy) {
  EntropyCoefficient coefficient({.learned = true, .initial = 0.5}, {.epsilon = 1e-8f}, {});
  EXPECT_NEAR(coefficient.coefficient(), 0.5, 1e-6);
  coefficient.Step(-1.0, 0.01f);  // log pi below minus the target: more entropy than wanted
  EXPECT_NEAR(coefficient.coefficient(), 0.5 * std::exp(-0.01), 1e-5);
  coefficient.Step(5.0, 0.01f);
  EXPECT_GT(coefficient.coefficient(), 0.5 * std::exp(-0.01));
  EntropyCoefficient constant({.learned = false, .initial = 0.2}, {}, {});
  constant.Step(5.0, 0.01f);
  EXPECT_FLOAT_EQ(constant.coefficient(), 0.2f);
}

// Stable Baselines3, SAC.__init__, and Stable Baselines 2.10.2's.
TEST(Tables, SacHasBothGenerationsNamesAndDefaults) {
  ExpectDefaults("sac",
                 {{"gamma", "0.99"},
                  {"learning_rate", "3e-4"},
                  {"buffer_size", "1000000"},
                  {"learning_starts", "100"},
                  {"batch_size", "256"},
                  {"tau", "0.005"},
                  {"train_freq", "1"},
                  {"gradient_steps", "1"},
                  {"n_steps", "1"},
                  {"ent_coef", "auto"},
                  {"target_entropy", "auto"},
                  {"target_update_interval", "1"},
                  {"action_noise", "none"},
                  {"net_arch", "[256, 256]"},
                  {"value_network", "false"},
                  {"n_critics", "2"},
                  {"use_sde", "false"},
                  {"sde_sample_freq", "-1"},
                  {"use_sde_at_warmup", "false"},
                  {"log_std_init", "-3"},
                  {"full_std", "true"},
                  {"use_expln", "false"},
                  {"clip_mean", "2"}},
                 {{"gamma", "0.99"},
                  {"learning_rate", "3e-4"},
                  {"buffer_size", "50000"},
                  {"learning_starts", "100"},
                  {"batch_size", "64"},
                  {"tau", "0.005"},
                  {"train_freq", "1"},
                  {"gradient_steps", "1"},
                  {"ent_coef", "auto"},
                  {"random_exploration", "0"},
                  {"layers", "[64, 64]"},
                  {"value_network", "true"},
                  {"optimizer", "tensorflow"},
                  {"init", "xavier"}});
}

TEST(Sac, WhatItCannotLearnIsOneLine) {
  const Space seen = *Space::Box(-1, 1, {2});
  const auto of = [&](const Space& actions) { return BehaviourSpec::Of("arm", seen, actions, 1); };
  const BehaviourSpec good = of(*Space::Box(-1, 1, {2}));
  const auto expect = [](const BehaviourSpec& behaviour, const Settings& settings, const char* part) {
    const std::string error = ErrorOf("sac", behaviour, settings, 1 << 30);
    EXPECT_NE(error.find(part), std::string::npos) << error;
  };
  EXPECT_EQ(ErrorOf("sac", good, {{"buffer_size", "1000"}}, 1 << 30), "");
  expect(of(*Space::Discrete(3)), {}, "Discrete(3)");
  expect(of(*Space::Discrete(3)), {}, "choose dqn, ppo or a2c");
  expect(of(*Space::Box(-INFINITY, INFINITY, {2})), {}, "'arm'");
  expect(good, {{"buffer_size", "1000"}, {"net_arch", "[8, dict(pi=[4], qf=[4])]"}}, "share none");
  expect(good, {{"buffer_size", "1000"}, {"ent_coef", "much"}}, "ent_coef = 'much'");
  expect(good, {{"buffer_size", "100"}, {"net_arch", "[6000, 6000]"}}, "net_arch makes");
  expect(good, {{"buffer_size", "1000000000"}}, "lower buffer_size");
  HyperparameterSet values((*FindAlgorithm("sac"))->hyperparameters);
  for (const char* critics : {"0", "11", "1.5"})
    EXPECT_NE(values.Set("n_critics", critics).message().find("a whole number from 1 to 10"), std::string::npos);
}

// What sac, td3 and ddpg have alike: algo/continuous_options.h.
TEST(ContinuousActions, OthersAreRefusedInTheNameOfTheAlgorithm) {
  const BehaviourSpec discrete = BehaviourSpec::Of("arm", *Space::Box(-1, 1, {2}), *Space::Discrete(3), 1);
  for (const std::string name : {"sac", "td3", "ddpg"}) {
    const std::string error = ErrorOf(name.c_str(), discrete, {}, 1 << 30);
    EXPECT_TRUE(error.starts_with(name + " learns numbers between finite bounds")) << error;
  }
}

}  // namespace
}  // namespace consac::learn
