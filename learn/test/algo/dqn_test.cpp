// DQN as a whole: its updates are the equations' in float64, it learns trivial tasks, and when its hyperparameters say.
// What holds of every algorithm is every_learner_test.cpp's.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "collect/epsilon_greedy.h"
#include "collect/learned_network.h"
#include "collect/parameter_noise.h"
#include "consac/nn/net_arch.h"
#include "learn/test/algo/off_policy_harness.h"
#include "learn/test/algo/training_harness.h"
#include "learn/test/grad/reference_network.h"

namespace consac::learn {
namespace {

/// DQN in plain float64: gradients by central differences, clip and Adam by their formulas.
class ReferenceDqn {
 public:
  ReferenceDqn(nn::Network network, const std::vector<float>& parameters, bool tensorflow, bool double_q)
      : network_(std::move(network)),
        parameters_(parameters.begin(), parameters.end()),
        target_(parameters_),
        m_(parameters_.size()),
        v_(parameters_.size()),
        tensorflow_(tensorflow),
        double_q_(double_q) {}

  struct Transition {
    std::vector<double> observation, next_observation;
    std::size_t action = 0;
    double reward = 0.0;
    bool terminated = false;
    std::vector<std::uint8_t> next_mask;
  };

  void Step(const Transition& t) {
    const std::vector<double> judges = Q(target_, t.next_observation),
                              chooses = double_q_ ? Q(parameters_, t.next_observation) : judges;
    std::size_t best = 0;
    while (t.next_mask[best] == 0) ++best;
    for (std::size_t i = best; i < chooses.size(); ++i) {
      if (t.next_mask[i] != 0 && chooses[i] > chooses[best]) best = i;
    }
    const double y = t.reward + (t.terminated ? 0.0 : kGamma * judges[best]);
    std::vector<double> gradient(parameters_.size());
    for (std::size_t i = 0; i < gradient.size(); ++i) {
      const double kept = std::exchange(parameters_[i], parameters_[i] + kDifference);
      const double above = Loss(t, y);
      parameters_[i] = kept - kDifference;
      gradient[i] = (above - Loss(t, y)) / (2.0 * kDifference);
      parameters_[i] = kept;
    }
    Clip(gradient);
    ++steps_;
    const double first = 1.0 - std::pow(0.9, steps_), second = 1.0 - std::pow(0.999, steps_);
    for (std::size_t i = 0; i < gradient.size(); ++i) {
      m_[i] = 0.9 * m_[i] + 0.1 * gradient[i];
      v_[i] = 0.999 * v_[i] + 0.001 * gradient[i] * gradient[i];
      parameters_[i] -= tensorflow_ ? kRate * std::sqrt(second) / first * m_[i] / (std::sqrt(v_[i]) + kEpsilon)
                                    : kRate / first * m_[i] / (std::sqrt(v_[i] / second) + kEpsilon);
    }
  }
  const std::vector<double>& parameters() const { return parameters_; }

  static constexpr double kGamma = 0.9, kRate = 0.01, kEpsilon = 0.1, kClip = 0.5;

 private:
  static constexpr double kDifference = 1e-6;
  std::vector<double> Q(const std::vector<double>& parameters, const std::vector<double>& observation) const {
    return ReferenceForward(network_, parameters, {observation})[0];
  }
  double Loss(const Transition& t, double y) const {
    const double size = std::fabs(Q(parameters_, t.observation)[t.action] - y);
    return size <= 1.0 ? 0.5 * size * size : size - 0.5;
  }
  // 2.10.2 clips each tensor's gradient, Stable Baselines3 the whole's.
  void Clip(std::vector<double>& gradient) const {
    std::vector<std::pair<std::size_t, std::size_t>> parts = {{0, gradient.size()}};
    if (tensorflow_) {
      parts.clear();
      for (const nn::Parameter& parameter : network_.parameters())
        parts.emplace_back(static_cast<std::size_t>(parameter.offset),
                           static_cast<std::size_t>(parameter.offset + parameter.count));
    }
    for (const auto& [begin, end] : parts) {
      double squares = 0.0;
      for (std::size_t i = begin; i < end; ++i) squares += gradient[i] * gradient[i];
      const double norm = std::sqrt(squares);
      const double factor = tensorflow_ ? kClip / std::max(norm, kClip) : std::min(1.0, kClip / (norm + 1e-6));
      for (std::size_t i = begin; i < end; ++i) gradient[i] *= factor;
    }
  }

  nn::Network network_;
  std::vector<double> parameters_, target_, m_, v_;
  bool tensorflow_, double_q_;
  int steps_ = 0;
};

/// Learns from the latest transition alone, so that what is drawn is known, beside the reference.
void ExpectTheReference(bool tensorflow, bool double_q, bool dueling, bool masks) {
  LearnerOptions options;
  options.behaviour = BehaviourSpec::Of("default", *Space::Box(-2, 2, {2}), *Space::Discrete(3, 1), 1);
  options.behaviour.masks_actions = masks;
  options.seed = 3;
  options.total_steps = 1000;
  const Algorithm* algorithm = *FindAlgorithm("dqn");
  HyperparameterSet values(algorithm->hyperparameters);
  const Settings settings = {{"buffer_size", "1"},
                             {"learning_starts", "0"},
                             {"train_freq", "1"},
                             {"batch_size", "70"},  // two blocks
                             {"gamma", "0.9"},
                             {"learning_rate", "0.01"},
                             {"adam_epsilon", "0.1"},
                             {"max_grad_norm", "0.5"},
                             {"layers", "[5, 4]"},
                             {"activation_fn", "tanh"},
                             {"optimizer", tensorflow ? "tensorflow" : "pytorch"},
                             {"grad_clip", tensorflow ? "variable" : "global"},
                             {"double_q", double_q ? "true" : "false"},
                             {"dueling", dueling ? "true" : "false"}};
  for (const auto& [name, text] : settings) ASSERT_TRUE(values.Set(name, text).ok()) << name;
  auto created = algorithm->create(options, values);
  ASSERT_TRUE(created.ok()) << created.status().message();
  Learner& learner = **created;
  ReferenceDqn reference(*nn::Network::Create(learner.Snapshot().network), learner.Snapshot().parameters, tensorflow,
                         double_q);
  BatchBuffer own(options.behaviour);
  Rng rng(9, 9);
  const auto see = [&](std::byte* where) {
    const float seen[] = {rng.Normal(), rng.Normal()};
    std::memcpy(where, seen, sizeof(seen));
    return std::vector<double>{static_cast<double>(seen[0]), static_cast<double>(seen[1])};
  };
  std::vector<double> now = see(own.batch().next_observations);
  learner.Begin(own.batch());
  for (int step = 0; step < 40; ++step) {
    own.Advance();
    Batch& batch = own.batch();
    learner.Act(batch);
    ReferenceDqn::Transition t;
    std::int32_t action = 0;
    std::memcpy(&action, batch.actions, sizeof(action));
    ASSERT_TRUE(action >= 1 && action <= 3);
    if (masks) {
      EXPECT_EQ(batch.action_masks[action - 1], 1) << "only what is legal is done";
    }
    t.action = static_cast<std::size_t>(action - 1);
    t.observation = now;
    t.next_mask = {1, 1, 1};
    batch.rewards[0] = 2.0f * rng.Normal();
    t.reward = static_cast<double>(batch.rewards[0]);
    batch.terminated[0] = step % 5 == 0 ? 1 : 0;
    batch.truncated[0] = step % 7 == 0 ? 1 : 0;
    t.terminated = batch.terminated[0] != 0;
    now = see(batch.next_observations);
    t.next_observation = batch.truncated[0] != 0 ? see(batch.final_observations) : now;
    if (masks) {
      std::uint8_t mask[] = {static_cast<std::uint8_t>(rng.Below(2)), 1, static_cast<std::uint8_t>(rng.Below(2))};
      std::memcpy(batch.next_action_masks, mask, sizeof(mask));
      if ((batch.terminated[0] | batch.truncated[0]) == 0) t.next_mask.assign(mask, mask + 3);
    }
    learner.Record(batch);
    ASSERT_TRUE(learner.LearningDue());
    while (learner.Learn({})) {
    }
    reference.Step(t);
    const std::vector<float> learned = learner.Snapshot().parameters;
    for (std::size_t i = 0; i < learned.size(); ++i)
      ASSERT_NEAR(static_cast<double>(learned[i]), reference.parameters()[i], 2e-5) << "step " << step << ", " << i;
  }
}

TEST(Dqn, UpdatesAreTheEquationsInFloat64) {
  for (const bool tensorflow : {false, true}) {
    for (const bool double_q : {false, true})
      ExpectTheReference(tensorflow, double_q, !double_q, double_q == tensorflow);
  }
}

// Stable Baselines 2's learning test and its settings: 90 of 100.
TEST(Dqn, LearnsTheIdentityOfTenStates) {
  EXPECT_GE(TrainedReward(*Space::Discrete(10), 1,
                          {"dqn",
                           {{"batch_size", "16"},
                            {"gamma", "0.1"},
                            {"exploration_fraction", "0.001"},
                            {"learning_rate", "5e-4"},
                            {"buffer_size", "50000"},
                            {"learning_starts", "1000"},
                            {"train_freq", "1"},
                            {"target_update_interval", "500"},
                            {"double_q", "true"}},
                           40000}),
            0.9);
}

// Stable Baselines3's, of four states, and what it has besides.
TEST(Dqn, LearnsTheIdentityOfFourStates) {
  const Settings base = {
      {"gamma", "0.4"}, {"learning_rate", "2e-3"}, {"learning_starts", "0"}, {"buffer_size", "5000"}};
  const auto with = [&](std::initializer_list<std::pair<const char*, const char*>> more) {
    Settings settings = base;
    settings.insert(settings.end(), more.begin(), more.end());
    return settings;
  };
  EXPECT_GE(TrainedReward(*Space::Discrete(4), 1, {"dqn", base, 1200}), 0.9);
  EXPECT_GE(TrainedReward(*Space::Discrete(4), 4, {"dqn", with({{"gradient_steps", "-1"}}), 4000}), 0.9);
  EXPECT_GE(TrainedReward(*Space::Discrete(4), 1, {"dqn", with({{"prioritized_replay", "true"}}), 2400}), 0.9);
  EXPECT_GE(TrainedReward(*Space::Discrete(4), 2, {"dqn", with({{"n_steps", "3"}, {"train_freq", "1"}}), 4000}), 0.9);
  EXPECT_GE(TrainedReward(*Space::Discrete(4), 1, {"dqn", with({{"param_noise", "true"}, {"train_freq", "1"}}), 4000}),
            0.9);
  EXPECT_GE(TrainedReward(*Space::Discrete(4), 2,
                          {"dqn", with({{"norm_obs", "true"}, {"norm_reward", "true"}, {"train_freq", "1"}}), 4000}),
            0.9);
}

/// Updates after each of the first `steps` steps of `copies` worlds.
std::vector<std::int64_t> UpdatesOver(int steps, std::int32_t copies, const Settings& settings) {
  IdentityEnv env(*Space::Discrete(3), copies);
  const std::unique_ptr<Learner> learner = Make(env, {"dqn", settings, 1000});
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  std::vector<std::int64_t> updates;
  for (int i = 0; i < steps; ++i) {
    Step(env, *learner, first.batch().slots);
    updates.push_back(learner->updates());
  }
  return updates;
}

TEST(Dqn, LearnsWhenItsHyperparametersSay) {
  using Counts = std::vector<std::int64_t>;
  EXPECT_EQ(UpdatesOver(6, 1, {{"train_freq", "2"}, {"learning_starts", "2"}}), (Counts{0, 0, 0, 1, 1, 2}));
  EXPECT_EQ(UpdatesOver(4, 3, {{"train_freq", "2"}, {"learning_starts", "0"}, {"gradient_steps", "-1"}}),
            (Counts{0, 6, 6, 12}));
  EXPECT_EQ(UpdatesOver(3, 2, {{"train_freq", "1"}, {"learning_starts", "0"}, {"gradient_steps", "3"}}),
            (Counts{3, 6, 9}));
  const Counts by_episode = UpdatesOver(
      401, 1, {{"train_freq", "2"}, {"train_freq_unit", "episode"}, {"learning_starts", "0"}, {"gradient_steps", "5"}});
  EXPECT_EQ(by_episode[198], 0);
  EXPECT_EQ(by_episode[199], 5) << "episodes have a hundred steps";
  EXPECT_EQ(by_episode[400], 10);
}

TEST(Dqn, ReportsEveryFourthEpisodeOrEveryHundredthUnderTheKeysThatWereAskedFor) {
  for (const char* keys : {"sb2", "sb3"}) {
    IdentityEnv env(*Space::Discrete(3), 2);
    const bool sb2 = std::string(keys) == "sb2";
    const std::unique_ptr<Learner> learner = Make(env, {"dqn", {{"log_keys", keys}}, 10000});
    BatchBuffer first(env.spec().behaviours[0]);
    Begin(env, *learner, first);
    std::int64_t steps = 0, reports = 0;
    while (reports < 2) {
      Step(env, *learner, first.batch().slots);
      ++steps;
      if (learner->reports() == reports) continue;
      reports = learner->reports();
      EXPECT_EQ(steps, reports * 100 * (sb2 ? 50 : 2));
    }
    std::vector<std::string> found;
    for (const Metric& metric : learner->metrics()) found.emplace_back(metric.table_key);
    const std::vector<std::string> of2 = {"steps", "episodes", "mean 100 episode reward", "% time spent exploring"},
                                   of3 = {"rollout/exploration_rate", "time/episodes", "train/learning_rate",
                                          "train/loss", "train/n_updates"};
    for (const std::string& key : sb2 ? of2 : of3)
      EXPECT_NE(std::find(found.begin(), found.end(), key), found.end()) << key;
  }
}

// Stable Baselines, LinearSchedule: from 1 to 0.1 over a half of the training.
TEST(Dqn, EpsilonFallsInALineAndStays) {
  const ExplorationSchedule schedule{1.0, 0.1, 0.5};
  EXPECT_DOUBLE_EQ(schedule.At(0.0), 1.0);
  EXPECT_DOUBLE_EQ(schedule.At(0.25), 0.55);
  EXPECT_DOUBLE_EQ(schedule.At(0.5), 0.1);
  EXPECT_DOUBLE_EQ(schedule.At(0.9), 0.1);
  EXPECT_DOUBLE_EQ((ExplorationSchedule{1.0, 0.1, 0.0}).At(0.0), 0.1) << "no part of the training";
}

TEST(Dqn, ExploresAmongWhatIsLegalAlone) {
  EpsilonGreedy explorer(4, 1);
  const float values[] = {4, 3, 2, 1};
  const std::uint8_t mask[] = {0, 1, 0, 1}, nothing[] = {0, 0, 0, 0};
  float raw = -1.0f;
  int drawn[4] = {};
  for (int i = 0; i < 4000; ++i) {
    explorer.Choose(values, mask, 1, 0.5, &raw);
    ++drawn[static_cast<int>(raw)];
  }
  EXPECT_EQ(drawn[0] + drawn[2], 0);
  EXPECT_NEAR(drawn[3] / 4000.0, 0.25, 0.03);
  explorer.Choose(values, nothing, 1, 0.0, &raw);
  EXPECT_EQ(raw, 0.0f);
  explorer.Choose(values, nullptr, 1, 0.0, &raw);
  EXPECT_EQ(raw, 0.0f);
}

// Source: Stable Baselines 2.10.2, deepq/build_graph.py.
TEST(ParameterNoise, ItsStrengthFollowsEpsilon) {
  nn::QNetworkOptions options;
  options.layers = {8};
  options.observation_size = 3;
  options.action_count = 4;
  nn::Network network = *nn::Network::Create(nn::QNetwork(options));
  LearnedNetwork q(network, Rng(1, StreamId("network_initialisation")), {});
  ParameterNoise noise(network, 1, 1);
  const float features[] = {0.5f, -0.2f, 0.9f};
  noise.Perturb(q.parameters());
  const std::vector<float> undisturbed(q.Output(features, 1), q.Output(features, 1) + 4);
  const std::vector<float> disturbed(noise.Values(features, 1), noise.Values(features, 1) + 4);
  EXPECT_NE(undisturbed, disturbed);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(undisturbed[i], disturbed[i], 0.2);
  EXPECT_DOUBLE_EQ(noise.deviation(), 0.01);
  noise.Adapt(q.parameters(), features, undisturbed.data(), 1, 1.0);
  EXPECT_DOUBLE_EQ(noise.deviation(), 0.0101);
  for (int i = 0; i < 3000; ++i) noise.Adapt(q.parameters(), features, undisturbed.data(), 1, 0.02);
  EXPECT_GT(noise.deviation(), 0.02) << "where noise does less than epsilon would it grows";
  const double before = noise.deviation();
  for (int i = 0; i < 50; ++i) noise.Adapt(q.parameters(), features, undisturbed.data(), 1, 0.0);
  EXPECT_LT(noise.deviation(), before) << "and nothing is less than none";
}

// Stable Baselines3, DQN.__init__, and Stable Baselines 2.10.2's.
TEST(Tables, DqnHasBothGenerationsNamesAndDefaults) {
  HyperparameterSet values((*FindAlgorithm("dqn"))->hyperparameters);
  EXPECT_DOUBLE_EQ(values.Real("learning_rate"), 1e-4);
  EXPECT_EQ(values.Integer("buffer_size"), 1000000);
  EXPECT_EQ(values.Integer("learning_starts"), 100);
  EXPECT_EQ(values.Integer("train_freq"), 4);
  EXPECT_EQ(values.Integer("target_update_interval"), 10000);
  EXPECT_DOUBLE_EQ(values.Real("exploration_final_eps"), 0.05);
  EXPECT_FALSE(values.Boolean("double_q"));
  EXPECT_EQ(values.Text("grad_clip"), "global");
  EXPECT_TRUE(values.Absent("prioritized_replay_beta_iters"));
  EXPECT_EQ(LogStyleOf(**FindAlgorithm("dqn"), values), LogStyle::kStableBaselines3);
  values.UseDefaultsOf(Generation::kStableBaselines2);
  EXPECT_DOUBLE_EQ(values.Real("learning_rate"), 5e-4);
  EXPECT_EQ(values.Integer("buffer_size"), 50000);
  EXPECT_EQ(values.Integer("learning_starts"), 1000);
  EXPECT_EQ(values.Integer("train_freq"), 1);
  EXPECT_EQ(values.Integer("target_network_update_freq"), 500);
  EXPECT_DOUBLE_EQ(values.Real("exploration_final_eps"), 0.02);
  EXPECT_TRUE(values.Boolean("double_q"));
  EXPECT_EQ(values.Text("layers"), "auto");
  EXPECT_TRUE(values.Boolean("dueling"));
  EXPECT_EQ(LogStyleOf(**FindAlgorithm("dqn"), values), LogStyle::kStableBaselines2);
}

TEST(Dqn, WhatItCannotLearnIsOneLine) {
  const BehaviourSpec box = BehaviourSpec::Of("arm", *Space::Box(-1, 1, {2}), *Space::Box(-1, 1, {2}), 1);
  EXPECT_NE(ErrorOf("dqn", box, {}, 1 << 30).find("'arm'"), std::string::npos);
  const BehaviourSpec image =
      BehaviourSpec::Of("default", *Space::Box(0, 255, {84, 84, 4}, DType::kU8), *Space::Discrete(4), 1);
  EXPECT_NE(ErrorOf("dqn", image, {{"buffer_size", "1000000"}}, 1 << 30).find("lower buffer_size"), std::string::npos);
  EXPECT_NE(ErrorOf("dqn", image, {{"buffer_size", "100"}, {"batch_size", "100000"}}, 1 << 30).find("lower batch_size"),
            std::string::npos);
  EXPECT_NE(ErrorOf("dqn", image, {{"buffer_size", "100"}, {"policy", "MlpPolicy"}, {"net_arch", "[10000]"}}, 1 << 30)
                .find("net_arch"),
            std::string::npos);
  EXPECT_NE(
      ErrorOf("dqn", image, {{"buffer_size", "100"}, {"net_arch", "[dict(pi=[4], vf=[4])]"}}, 1 << 30).find("widths"),
      std::string::npos);
}

}  // namespace
}  // namespace consac::learn
