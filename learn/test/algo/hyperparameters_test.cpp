// Hyperparameter tables: defaults are legal, values are checked, unknown names find their nearest.
#include "consac/learn/algo/hyperparameters.h"

#include <gtest/gtest.h>

#include <set>

#include "consac/learn/algo/learner.h"

namespace consac::learn {
namespace {

TEST(Tables, EveryDefaultIsLegalAndEveryNameIsOnce) {
  for (const Algorithm& algorithm : Algorithms()) {
    std::set<std::string> names;
    HyperparameterSet values(algorithm.hyperparameters);
    for (const Hyperparameter& row : algorithm.hyperparameters) {
      EXPECT_TRUE(names.insert(row.name).second) << row.name;
      EXPECT_TRUE(row.alias[0] == '\0' || names.insert(row.alias).second) << row.alias;
      EXPECT_TRUE(values.Set(row.name, row.default_value).ok()) << row.name;
      EXPECT_FALSE(std::string(row.meaning).empty());
      EXPECT_FALSE(std::string(row.source).empty());
    }
  }
}

// Stable Baselines 2.10.2, PPO2.__init__.
TEST(Tables, Ppo2HasStableBaselinesNamesAndDefaults) {
  const HyperparameterSet values((*FindAlgorithm("ppo2"))->hyperparameters);
  const std::pair<const char*, double> defaults[] = {
      {"gamma", 0.99},        {"n_steps", 128}, {"ent_coef", 0.01},  {"learning_rate", 2.5e-4}, {"vf_coef", 0.5},
      {"max_grad_norm", 0.5}, {"lam", 0.95},    {"nminibatches", 4}, {"noptepochs", 4},         {"cliprange", 0.2}};
  for (const auto& [name, value] : defaults) EXPECT_DOUBLE_EQ(values.Real(name), value) << name;
  EXPECT_TRUE(values.Absent("cliprange_vf"));
  EXPECT_DOUBLE_EQ(values.Real("gae_lambda"), 0.95);
  EXPECT_DOUBLE_EQ(values.Real("clip_range"), 0.2);
  EXPECT_EQ(values.Integer("n_epochs"), 4);
}

TEST(Tables, PpoHasStableBaselines3NamesAndDefaults) {
  const HyperparameterSet values((*FindAlgorithm("ppo"))->hyperparameters);
  const std::pair<const char*, double> defaults[] = {
      {"learning_rate", 3e-4}, {"n_steps", 2048},   {"batch_size", 64}, {"n_epochs", 10}, {"gamma", 0.99},
      {"gae_lambda", 0.95},    {"clip_range", 0.2}, {"ent_coef", 0.0},  {"vf_coef", 0.5}, {"max_grad_norm", 0.5}};
  for (const auto& [name, value] : defaults) EXPECT_DOUBLE_EQ(values.Real(name), value) << name;
  EXPECT_TRUE(values.Absent("clip_range_vf") && values.Absent("target_kl"));
  EXPECT_TRUE(values.Boolean("normalize_advantage"));
}

TEST(Values, FormsThatPeopleWrite) {
  HyperparameterSet values((*FindAlgorithm("ppo2"))->hyperparameters);
  EXPECT_TRUE(values.Set("learning_rate", "lin_2.5e-4").ok());
  EXPECT_TRUE(values.AsSchedule("learning_rate").linear);
  EXPECT_DOUBLE_EQ(values.AsSchedule("learning_rate").At(0.5), 1.25e-4);
  EXPECT_TRUE(values.Set("n_steps", "1_024").ok());
  EXPECT_EQ(values.Integer("n_steps"), 1024);
  EXPECT_TRUE(values.Set("n_steps", "1e3").ok());
  EXPECT_TRUE(values.Set("norm_obs", "True").ok());
  EXPECT_TRUE(values.Boolean("norm_obs"));
  EXPECT_TRUE(values.Set("max_grad_norm", "none").ok());
  EXPECT_TRUE(values.Absent("max_grad_norm"));
  EXPECT_TRUE(values.Changed("n_steps"));
  EXPECT_FALSE(values.Changed("gamma"));
}

TEST(Values, BadOnesAreQuotedWithWhatWasExpected) {
  HyperparameterSet values((*FindAlgorithm("ppo2"))->hyperparameters);
  const std::pair<const char*, const char*> cases[] = {
      {"gamma", "1.5"},   {"gamma", "nan"},      {"gamma", "none"},    {"n_steps", "0"},
      {"n_steps", "2.5"}, {"norm_obs", "maybe"}, {"act_fun", "thanh"}, {"learning_rate", "lin_x"}};
  for (const auto& [name, text] : cases) {
    const Status status = values.Set(name, text);
    EXPECT_FALSE(status.ok()) << name << text;
    EXPECT_NE(status.message().find(text), std::string::npos) << status.message();
    EXPECT_NE(status.message().find("expected"), std::string::npos) << status.message();
  }
  for (const char* text : {"yes", "on", "1", "no", "off", "0", "TRUE", "t"})
    EXPECT_NE(values.Set("norm_obs", text).message().find("expected true or false"), std::string::npos) << text;
  EXPECT_NE(values.Set("learnin_rate", "1").message().find("'learning_rate'"), std::string::npos);
  EXPECT_NE(FindAlgorithm("pop2").status().message().find("'ppo2'"), std::string::npos);
}

}  // namespace
}  // namespace consac::learn
