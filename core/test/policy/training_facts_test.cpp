#include "consac/policy/training_facts.h"

#include <gtest/gtest.h>

namespace consac {
namespace {

TEST(TrainingFacts, AreWhatTheTextSaysAndNothingElse) {
  const TrainingFacts facts = FactsOf(R"({"hyperparameters": {}, "steps": 20000, "algorithm": "sac"})");
  EXPECT_EQ(facts.algorithm, "sac");
  EXPECT_EQ(facts.steps, 20000);
  for (const char* text : {"", "{", "[]", "7", R"({"steps": "many", "algorithm": 3})", R"({"steps": 1.5})"}) {
    const TrainingFacts none = FactsOf(text);
    EXPECT_EQ(none.algorithm, "") << text;
    EXPECT_EQ(none.steps, 0) << text;
  }
}

TEST(TrainingFacts, AnAlgorithmIsAddedAndTheRestStays) {
  const TrainingFacts facts = FactsOf(WithAlgorithm(R"({"steps": 5, "algorithm": "old"})", "dq\"n"));
  EXPECT_EQ(facts.algorithm, "dq\"n");
  EXPECT_EQ(facts.steps, 5);
  EXPECT_EQ(FactsOf(WithAlgorithm("no JSON", "ppo2")).algorithm, "ppo2");
}

}  // namespace
}  // namespace consac
