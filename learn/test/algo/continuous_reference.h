#pragma once
// What algorithms of continuous actions are checked against: networks in float64 with central differences and Adam by
// its formulas, and a drive in which every minibatch is one known transition.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>

#include "consac/nn/action_networks.h"
#include "learn/test/algo/training_harness.h"
#include "learn/test/grad/reference_network.h"

namespace consac::learn {

inline constexpr double kReferenceGamma = 0.9, kReferenceRate = 0.01, kReferenceEpsilon = 0.1, kReferenceTau = 0.25;
inline constexpr std::size_t kReferenceRows = 66;  // two blocks

/// A network that learns, in float64.
class ReferenceLearned {
 public:
  ReferenceLearned(nn::Network network, const std::vector<float>& parameters, bool tensorflow)
      : network_(std::move(network)), tensorflow_(tensorflow) {
    EXPECT_GE(static_cast<std::int64_t>(parameters.size()), network_.parameter_count()) << "others may stand behind";
    now.assign(parameters.begin(), parameters.end());
    target = now;
    m_.resize(now.size());
    v_.resize(now.size());
  }

  using Numbers = std::vector<double>;
  std::vector<Numbers> Run(const std::vector<Numbers>& inputs) const { return ReferenceForward(network_, now, inputs); }
  std::vector<Numbers> RunTarget(const std::vector<Numbers>& inputs) const {
    return ReferenceForward(network_, target, inputs);
  }
  /// d loss / d parameters by central differences; `loss` runs this network.
  Numbers Gradient(const std::function<double()>& loss) {
    constexpr double kDifference = 1e-5;
    Numbers gradient(now.size());
    for (std::size_t i = 0; i < now.size(); ++i) {
      const double kept = now[i];
      now[i] = kept + kDifference;
      const double above = loss();
      now[i] = kept - kDifference;
      gradient[i] = (above - loss()) / (2.0 * kDifference);
      now[i] = kept;
    }
    return gradient;
  }
  void Step(const Numbers& gradient, double rate = kReferenceRate) {
    ++steps_;
    const double first = 1.0 - std::pow(0.9, steps_), second = 1.0 - std::pow(0.999, steps_);
    for (std::size_t i = 0; i < gradient.size(); ++i) {
      m_[i] = 0.9 * m_[i] + 0.1 * gradient[i];
      v_[i] = 0.999 * v_[i] + 0.001 * gradient[i] * gradient[i];
      now[i] -= tensorflow_ ? rate * std::sqrt(second) / first * m_[i] / (std::sqrt(v_[i]) + kReferenceEpsilon)
                            : rate / first * m_[i] / (std::sqrt(v_[i] / second) + kReferenceEpsilon);
    }
  }
  void Follow(double tau = kReferenceTau) {
    for (std::size_t i = 0; i < now.size(); ++i) target[i] = tau * now[i] + (1.0 - tau) * target[i];
  }

  Numbers now, target;

 private:
  nn::Network network_;
  bool tensorflow_;
  Numbers m_, v_;
  int steps_ = 0;
};

/// A part of a learner's state.
inline std::vector<float> StateOf(Learner& learner, const std::string& path) {
  StateWriter writer;
  writer("learner", learner);
  const auto field = writer.fields().find("learner/" + path);
  EXPECT_NE(field, writer.fields().end()) << path;
  if (field == writer.fields().end()) return {};
  std::vector<float> values(field->second.bytes.size() / sizeof(float));
  std::memcpy(values.data(), field->second.bytes.data(), field->second.bytes.size());
  return values;
}

inline void ExpectNear(const std::vector<float>& got, const std::vector<double>& expected, double tolerance,
                       const std::string& what) {
  ASSERT_EQ(got.size(), expected.size()) << what;
  for (std::size_t i = 0; i < got.size(); ++i)
    ASSERT_NEAR(static_cast<double>(got[i]), expected[i], tolerance) << what << " " << i;
}

struct KnownTransition {
  std::vector<double> observation, next_observation, action;  // the action from -1 to 1
  double reward = 0.0;
  bool terminated = false;
};

/// Two numbers seen, two done, whose bounds are -3 and 1.
inline LearnerOptions KnownWorld() {
  LearnerOptions options;
  options.behaviour = BehaviourSpec::Of("default", *Space::Box(-2, 2, {2}), *Space::Box(-3, 1, {2}), 1);
  options.seed = 3;
  options.total_steps = 1000;
  return options;
}

/// Settings with which the reference's constants hold and each minibatch is the latest transition alone.
inline Settings KnownSettings(bool tensorflow) {
  return {{"buffer_size", "1"},
          {"learning_starts", "0"},
          {"train_freq", "1"},
          {"gradient_steps", "1"},
          {"batch_size", "66"},
          {"gamma", "0.9"},
          {"tau", "0.25"},
          {"adam_epsilon", "0.1"},
          {"net_arch", "dict(pi=[5, 4], qf=[4, 3])"},
          {"activation_fn", "tanh"},
          {"optimizer", tensorflow ? "tensorflow" : "pytorch"}};
}

inline nn::TowerOptions KnownTower(std::vector<std::int64_t> layers) {
  nn::TowerOptions tower;
  tower.layers = std::move(layers);
  tower.activation = nn::Activation::kTanh;
  return tower;
}

inline std::unique_ptr<Learner> MakeKnown(const char* name, const Settings& settings) {
  const Algorithm* algorithm = *FindAlgorithm(name);
  HyperparameterSet values(algorithm->hyperparameters);
  for (const auto& [key, text] : settings) EXPECT_TRUE(values.Set(key, text).ok()) << key;
  auto created = algorithm->create(KnownWorld(), values);
  EXPECT_TRUE(created.ok()) << created.status().message();
  return created.ok() ? std::move(*created) : nullptr;
}

/// Takes `steps` steps; `after`(transition) is called when what is due after each has been learned, `recorded` before.
inline void DriveKnown(Learner& learner, int steps, const std::function<void(const KnownTransition&)>& recorded,
                       const std::function<void(const KnownTransition&)>& after) {
  BatchBuffer own(KnownWorld().behaviour);
  Rng rng(9, 9);
  const auto see = [&](std::byte* where) {
    const float seen[] = {rng.Normal(), rng.Normal()};
    std::memcpy(where, seen, sizeof(seen));
    return std::vector<double>{static_cast<double>(seen[0]), static_cast<double>(seen[1])};
  };
  std::vector<double> now = see(own.batch().next_observations);
  learner.Begin(own.batch());
  for (int step = 0; step < steps; ++step) {
    own.Advance();
    Batch& batch = own.batch();
    learner.Act(batch);
    KnownTransition t;
    float action[2] = {};
    std::memcpy(action, batch.actions, sizeof(action));
    for (const float number : action) {
      ASSERT_TRUE(number >= -3.0f && number <= 1.0f);
      t.action.push_back((static_cast<double>(number) + 1.0) / 2.0);
    }
    t.observation = now;
    batch.rewards[0] = 2.0f * rng.Normal();
    t.reward = static_cast<double>(batch.rewards[0]);
    batch.terminated[0] = step % 5 == 0 ? 1 : 0;
    batch.truncated[0] = step % 7 == 0 ? 1 : 0;
    t.terminated = batch.terminated[0] != 0;
    now = see(batch.next_observations);
    t.next_observation = batch.truncated[0] != 0 ? see(batch.final_observations) : now;
    learner.Record(batch);
    recorded(t);
    ASSERT_TRUE(learner.LearningDue());
    while (learner.Learn({})) {
    }
    after(t);
    if (testing::Test::HasFatalFailure()) return;
  }
}

/// A small number as settings have it.
inline const char* CountText(std::size_t count) {
  static constexpr const char* kTexts[] = {"0", "1", "2", "3", "4"};
  return kTexts[count];
}

/// min_k Q_k of the first `critics` outputs of a row.
inline double LeastOf(const std::vector<std::vector<double>>& q, std::size_t critics) {
  double least = q[0][0];
  for (std::size_t k = 1; k < critics; ++k) least = std::min(least, q[k][0]);
  return least;
}

/// The metric of that name; NaN where there is none.
inline double MetricOf(const Learner& learner, std::string_view name) {
  for (const Metric& metric : learner.metrics()) {
    if (metric.table_key == name) return metric.value;
  }
  return std::nan("");
}

}  // namespace consac::learn
