// Model files of earlier days act as they did. What they are to answer was worked out in float64, by the Python reader.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "consac/policy/policy.h"

namespace consac {
namespace {

constexpr std::int64_t kQuestions = 6;

/// Row r, feature i: eighths from -5/8 to 5/8.
std::vector<float> Questions(std::int64_t features) {
  std::vector<float> questions;
  for (std::int64_t r = 0; r < kQuestions; ++r) {
    for (std::int64_t i = 0; i < features; ++i)
      questions.push_back(static_cast<float>((7 * r + 3 * i) % 11 - 5) / 8.0f);
  }
  return questions;
}

struct OlderModel {
  const char* file;
  std::int64_t features;
  std::vector<double> head;     // [kQuestions, head]
  std::vector<double> actions;  // [kQuestions] the mode
};

TEST(OlderModels, ActAsTheyDid) {
  const OlderModel models[] = {{"cartpole-v1.consac",
                                4,
                                {-0.013357304, 0.003548549, 0.016630068, -0.006636623, -0.01920035, 0.007600974,
                                 -0.004531934, -0.006646042, 0.0195862, -0.003523994, -0.018399544, 0.009885805},
                                {1, 0, 1, 0, 0, 1}},
                               {"pendulum-v1.consac",
                                3,
                                {0.003959188, -0.010084168, -0.004125215, 0.000129863, -0.008361806, -0.00113268},
                                {0.003959188, -0.010084168, -0.004125215, 0.000129863, -0.008361806, -0.00113268}}};
  for (const OlderModel& model : models) {
    Result<Policy> policy =
        Policy::Load(std::string(CONSAC_SOURCE_DIR) + "/fuzz/seeds/model/" + model.file, kQuestions);
    ASSERT_TRUE(policy.ok()) << policy.status().message();
    const std::vector<float> questions = Questions(model.features);
    const Layout& done = policy->action_layout();
    std::vector<std::byte> actions(kQuestions * done.row_bytes);
    Rng rng;
    policy->Act(reinterpret_cast<const std::byte*>(questions.data()), nullptr, kQuestions, ActionMode::kDeterministic,
                rng, actions.data());
    ASSERT_EQ(policy->head().size(), model.head.size());
    for (std::size_t i = 0; i < model.head.size(); ++i)
      EXPECT_NEAR(policy->head()[i], model.head[i], 1e-6) << model.file << " " << i;
    for (std::size_t r = 0; r < kQuestions; ++r)
      EXPECT_NEAR(ReadElement(done.leaves[0], actions.data() + r * done.row_bytes, 0), model.actions[r], 1e-6);
  }
}

}  // namespace
}  // namespace consac
