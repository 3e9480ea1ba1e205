// DDPG as a whole: its updates are the equations' in float64, it learns trivial tasks; and the adaptive noise in its
// parameters. What holds of every algorithm is every_learner_test.cpp's.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <tuple>

#include "collect/learned_network.h"
#include "collect/parameter_noise.h"
#include "learn/test/algo/continuous_reference.h"
#include "learn/test/algo/off_policy_harness.h"

namespace consac::learn {
namespace {

constexpr double kActorRate = 0.005, kClipNorm = 0.3, kL2 = 0.02, kRewardScale = 0.5;

constexpr double kReturnRange = 4.0;

/// One step of DDPG in float64 beside the learner's; `first` is Stable Baselines 2.10.2's form, also with `pop_art`.
class ReferenceDdpg {
 public:
  ReferenceDdpg(Learner& learner, bool first, bool pop_art, std::size_t n_critics)
      : first_(first),
        pop_art_(pop_art),
        n_critics_(n_critics),
        critic_network_(*nn::Network::Create(*nn::Critics(KnownWorld().behaviour.observation_layout,
                                                          {.tower = KnownTower({4, 3}),
                                                           .action_size = 2,
                                                           .count = static_cast<std::int64_t>(n_critics),
                                                           .action_layer = first ? 1 : 0},
                                                          {}))),
        actor_network_(*nn::Network::Create(learner.Snapshot().network)),
        actor_(actor_network_, StateOf(learner, "actor/parameters"), first),
        critic_(critic_network_, StateOf(learner, "critic/parameters"), first) {}

  void Step(const KnownTransition& t) {
    const double after =
        LeastOf(critic_.RunTarget({t.next_observation, actor_.RunTarget({t.next_observation})[0]}), n_critics_);
    const double value = (first_ ? kRewardScale : 1.0) * t.reward +
                         (t.terminated ? 0.0 : kReferenceGamma) * (mean_ + deviation_ * after);
    if (pop_art_) Follow(value);
    const double y = Within((value - mean_) / deviation_);
    const auto loss = [&] {
      const auto q = critic_.Run({t.observation, t.action});
      double errors = 0.0, squares = 0.0;
      for (std::size_t k = 0; k < n_critics_; ++k) errors += (q[k][0] - y) * (q[k][0] - y);
      for (const nn::Parameter& tensor : critic_network_.parameters()) {
        if (tensor.shape.size() < 2 || tensor.name.ends_with("/head/w")) continue;
        for (std::int64_t i = tensor.offset; i < tensor.offset + tensor.count; ++i)
          squares += critic_.now[static_cast<std::size_t>(i)] * critic_.now[static_cast<std::size_t>(i)];
      }
      return errors + (first_ ? 0.5 * kL2 * squares : 0.0);
    };
    const auto cost = [&] {
      return -mean_ - deviation_ * Within(critic_.Run({t.observation, actor_.Run({t.observation})[0]})[0][0]);
    };
    if (first_) actor_.Step(Clipped(actor_network_, actor_.Gradient(cost)), kActorRate);
    critic_.Step(Clipped(critic_network_, critic_.Gradient(loss)));
    if (!first_) actor_.Step(actor_.Gradient(cost));
    actor_.Follow();
    critic_.Follow();
  }
  void Expect(Learner& learner, int step) {
    const std::string at = " after step " + std::to_string(step);
    const double tolerance = pop_art_ ? 1e-4 : 2e-5;  // whose outputs are ten times as large
    ExpectNear(StateOf(learner, "actor/parameters"), actor_.now, tolerance, "actor" + at);
    ExpectNear(StateOf(learner, "actor/target"), actor_.target, tolerance, "actor's target" + at);
    ExpectNear(StateOf(learner, "critic/parameters"), critic_.now, tolerance, "critic" + at);
    ExpectNear(StateOf(learner, "critic/target"), critic_.target, tolerance, "critic's target" + at);
  }

 private:
  using Numbers = std::vector<double>;
  double Within(double output) const { return pop_art_ ? std::clamp(output, -kReturnRange, kReturnRange) : output; }
  /// The moments take in a minibatch of that target, and the critic goes on to mean what it meant.
  void Follow(double target) {
    const double old_mean = mean_, old_deviation = deviation_;
    constexpr double kRows = static_cast<double>(kReferenceRows);
    sum_ += kRows * target;
    squares_ += kRows * target * target;
    count_ += kRows;
    mean_ = sum_ / count_;
    deviation_ = std::sqrt(std::max(squares_ / count_ - mean_ * mean_, 0.01));
    for (const nn::Parameter& tensor : critic_network_.parameters()) {
      if (tensor.name.find("/head/") == std::string::npos) continue;
      for (std::int64_t i = tensor.offset; i < tensor.offset + tensor.count; ++i) {
        for (Numbers* of : {&critic_.now, &critic_.target}) {
          double& number = (*of)[static_cast<std::size_t>(i)];
          number = (number * old_deviation + (tensor.name.ends_with("/head/b") ? old_mean - mean_ : 0.0)) / deviation_;
        }
      }
    }
  }
  Numbers Clipped(const nn::Network& network, Numbers gradient) const {
    for (const nn::Parameter& tensor : network.parameters()) {
      const auto begin = static_cast<std::size_t>(tensor.offset), end = begin + static_cast<std::size_t>(tensor.count);
      double squares = 0.0;
      for (std::size_t i = begin; i < end; ++i) squares += gradient[i] * gradient[i];
      for (std::size_t i = begin; first_ && i < end; ++i)
        gradient[i] *= kClipNorm / std::max(std::sqrt(squares), kClipNorm);
    }
    return gradient;
  }

  bool first_, pop_art_;
  std::size_t n_critics_;
  double sum_ = 0.0, squares_ = 0.01, count_ = 0.01, mean_ = 0.0, deviation_ = 1.0;
  nn::Network critic_network_, actor_network_;
  ReferenceLearned actor_, critic_;
};

TEST(Ddpg, UpdatesAreTheEquationsInFloat64) {
  for (const auto& [first, pop_art, n_critics] :
       {std::tuple(false, false, std::size_t{1}), std::tuple(true, false, std::size_t{1}),
        std::tuple(true, true, std::size_t{1}), std::tuple(false, false, std::size_t{3}),
        std::tuple(true, true, std::size_t{2})}) {
    SCOPED_TRACE(n_critics);
    Settings settings = KnownSettings(first);
    settings.push_back({"n_critics", CountText(n_critics)});
    settings.push_back({"learning_rate", "0.01"});
    if (first) {
      for (const auto& setting : Settings{{"actor_lr", "0.005"},
                                          {"clip_norm", "0.3"},
                                          {"critic_l2_reg", "0.02"},
                                          {"reward_scale", "0.5"},
                                          {"actor_step", "before_critic"},
                                          {"action_layer", "1"}})
        settings.push_back(setting);
    }
    for (const char* name : {"normalize_returns", "enable_popart"})
      settings.push_back({name, pop_art ? "true" : "false"});
    if (pop_art) settings.push_back({"return_range", "4"});
    const std::unique_ptr<Learner> learner = MakeKnown("ddpg", settings);
    ReferenceDdpg reference(*learner, first, pop_art, n_critics);
    int step = 0;
    DriveKnown(
        *learner, 20, [](const KnownTransition&) {},
        [&](const KnownTransition& t) {
          reference.Step(t);
          reference.Expect(*learner, step++);
        });
  }
}

TEST(Ddpg, LearnsTheIdentity) {
  const Settings base = {{"learning_rate", "1e-3"}, {"gamma", "0.4"},           {"net_arch", "[64, 64]"},
                         {"buffer_size", "5000"},   {"action_noise", "normal"}, {"batch_size", "128"}};
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 1, {"ddpg", base, 1000}), 0.9);
  Settings noisy = base;
  for (const auto& setting : Settings{{"action_noise", "none"}, {"param_noise", "true"}, {"gradient_steps", "2"}})
    noisy.push_back(setting);
  EXPECT_GE(TrainedReward(*Space::Box(-2, 3, {1}), 2, {"ddpg", noisy, 3000}), 0.8);
}

TEST(Ddpg, ReportsUnderTheKeysThatWereAskedFor) {
  Settings small = {{"net_arch", "[8]"}, {"batch_size", "8"}, {"param_noise", "true"}};
  ExpectReportsEveryFourthEpisode({"ddpg", small, 10000}, {"time/episodes", "train/learning_rate", "train/n_updates",
                                                           "train/actor_loss", "train/critic_loss"});
  small.push_back({"log_keys", "sb2"});
  ExpectReportsEveryFourthEpisode(
      {"ddpg", small, 10000}, {"rollout/episodes", "rollout/return_history", "train/loss_actor", "train/loss_critic",
                               "train/param_noise_distance", "param_noise_stddev"});
}

TEST(Ddpg, NoiseInItsParametersTakesMemoryToo) {
  const BehaviourSpec good = BehaviourSpec::Of("arm", *Space::Box(-1, 1, {2}), *Space::Box(-1, 1, {2}), 1);
  const Settings large = {{"buffer_size", "100"}, {"net_arch", "[2000, 2000]"}};
  Settings noisy = large;
  noisy.push_back({"param_noise", "true"});
  std::int64_t bytes = 1 << 20;
  while (!ErrorOf("ddpg", good, large, bytes).empty()) bytes += bytes / 64;
  EXPECT_NE(ErrorOf("ddpg", good, noisy, bytes).find("net_arch makes"), std::string::npos)
      << "noise has networks of its own";
}

TEST(Ddpg, StartsFromAModelOfAnotherAlgorithmWhoseActorIsAlike) {
  IdentityEnv env(*Space::Box(-1, 1, {2}), 2);
  const Settings settings = {{"net_arch", "[8]"}};
  const std::unique_ptr<Learner> learner = Make(env, {"ddpg", settings, 1000, 1}),
                                 td3 = Make(env, {"td3", settings, 1000, 2});
  ASSERT_TRUE(td3->StartFrom(learner->Snapshot()).ok());
  EXPECT_EQ(td3->Snapshot().parameters, learner->Snapshot().parameters);
}

// Stable Baselines3, DDPG.__init__, and Stable Baselines 2.10.2's.
TEST(Tables, DdpgHasBothGenerationsNamesAndDefaults) {
  ExpectDefaults("ddpg",
                 {{"gamma", "0.99"},
                  {"learning_rate", "1e-3"},
                  {"actor_lr", "none"},
                  {"buffer_size", "1000000"},
                  {"learning_starts", "100"},
                  {"batch_size", "256"},
                  {"tau", "0.005"},
                  {"train_freq", "1"},
                  {"gradient_steps", "1"},
                  {"n_steps", "1"},
                  {"action_noise", "none"},
                  {"net_arch", "[400, 300]"},
                  {"param_noise", "false"},
                  {"norm_obs", "false"},
                  {"clip_obs", "10"},
                  {"actor_step", "after_critic"},
                  {"action_layer", "0"}},
                 {{"gamma", "0.99"},
                  {"critic_lr", "1e-3"},
                  {"actor_lr", "1e-4"},
                  {"buffer_size", "50000"},
                  {"batch_size", "128"},
                  {"tau", "0.001"},
                  {"nb_rollout_steps", "100"},
                  {"nb_train_steps", "50"},
                  {"layers", "[64, 64]"},
                  {"critic_l2_reg", "0"},
                  {"clip_norm", "none"},
                  {"reward_scale", "1"},
                  {"normalize_observations", "false"},
                  {"normalize_returns", "false"},
                  {"enable_popart", "false"},
                  {"return_range", "none"},
                  {"observation_range", "5"},
                  {"random_exploration", "0"},
                  {"param_noise_adaption_interval", "50"},
                  {"actor_step", "before_critic"},
                  {"action_layer", "1"}});
}

// Source: Stable Baselines 2.10.2, ddpg/noise.py: AdaptiveParamNoiseSpec.
TEST(ParameterNoise, ItsStrengthFollowsTheDistanceOfActions) {
  nn::ActorOptions options{.tower = KnownTower({8}), .outputs = 2, .output = nn::Activation::kTanh};
  const nn::Network network = *nn::Network::Create(*nn::Actor(Layout::Of(*Space::Box(-1, 1, {3})), options, {}));
  LearnedNetwork actor(network, Rng(4, 4), {.run_rows = 4, .adam = {}});
  ParameterNoise noise(network, 1, 4, 0.1), twin(network, 1, 4, 0.1);
  EXPECT_DOUBLE_EQ(noise.deviation(), 0.1);
  Rng rng(4, 4);
  std::vector<float> features(12);
  for (float& feature : features) feature = rng.Normal();
  const float* outputs = actor.Output(features.data(), 4);
  const double distance = noise.Distance(actor.parameters(), features.data(), outputs, 4);
  // The twin's generator stands where the other's stood: what it acts by is what was tried there.
  twin.Perturb(actor.parameters());
  const float* disturbed = twin.Values(features.data(), 4);
  double squares = 0.0;
  for (std::size_t i = 0; i < 8; ++i)
    squares += static_cast<double>(outputs[i] - disturbed[i]) * static_cast<double>(outputs[i] - disturbed[i]);
  EXPECT_NEAR(distance, std::sqrt(squares / 8.0), 1e-9);
  EXPECT_GT(distance, 0.005);
  noise.AdaptTo(0.3, 0.2, 1.01);
  EXPECT_DOUBLE_EQ(noise.deviation(), 0.1 / 1.01) << "further than wanted";
  noise.AdaptTo(0.1, 0.2, 1.01);
  EXPECT_DOUBLE_EQ(noise.deviation(), 0.1) << "nearer";
  for (int k = 0; k < 400; ++k) noise.AdaptTo(0.1, 0.2, 10.0);
  EXPECT_DOUBLE_EQ(noise.deviation(), ParameterNoise::kStrongest) << "and never so strong that nothing is a number";
}

TEST(Ddpg, NoiseThatGrowsWithoutBoundIsRefused) {
  const BehaviourSpec arm = BehaviourSpec::Of("arm", *Space::Box(-1, 1, {2}), *Space::Box(-1, 1, {2}), 1);
  for (const char* algorithm : {"ddpg", "td3", "sac"}) {
    Settings wild = {{"action_noise", "ornstein_uhlenbeck"}, {"noise_theta", "15"}, {"noise_dt", "0.2"}};
    wild.emplace_back("buffer_size", "100");
    EXPECT_NE(ErrorOf(algorithm, arm, wild, 1 << 30).find("noise_theta 15 times noise_dt 0.2 is 3"), std::string::npos);
    wild[1].second = "9";
    EXPECT_EQ(ErrorOf(algorithm, arm, wild, 1 << 30), "");
    wild[1].second = "15";
    wild[0].second = "normal";
    EXPECT_EQ(ErrorOf(algorithm, arm, wild, 1 << 30), "") << "which has none";
  }
}

TEST(ParameterNoise, ANegativeDeviationIsRefused) {
  const nn::Network network =
      *nn::Network::Create(*nn::Actor(Layout::Of(*Space::Box(-1, 1, {3})), {.tower = KnownTower({8})}, {}));
  ParameterNoise noise(network, 1, 4), other(network, 1, 4);
  StateWriter writer;
  writer("noise", noise);
  const double deviation = -0.01;
  std::memcpy(writer.fields()["noise/deviation"].bytes.data(), &deviation, sizeof(deviation));
  StateReader reader(writer.fields());
  reader("noise", other);
  EXPECT_EQ(reader.status().code(), StatusCode::kDataLoss);
}

// Of a checkpoint of an earlier program, which set it no bound.
TEST(ParameterNoise, AStrongerDeviationThanThereIsIsReadAsTheStrongest) {
  const nn::Network network =
      *nn::Network::Create(*nn::Actor(Layout::Of(*Space::Box(-1, 1, {3})), {.tower = KnownTower({8})}, {}));
  for (const double deviation : {1e9, std::numeric_limits<double>::infinity()}) {
    ParameterNoise noise(network, 1, 4), other(network, 1, 4);
    StateWriter writer;
    writer("noise", noise);
    std::memcpy(writer.fields()["noise/deviation"].bytes.data(), &deviation, sizeof(deviation));
    StateReader reader(writer.fields());
    reader("noise", other);
    EXPECT_TRUE(reader.status().ok());
    EXPECT_EQ(other.deviation(), ParameterNoise::kStrongest);
  }
}

}  // namespace
}  // namespace consac::learn
