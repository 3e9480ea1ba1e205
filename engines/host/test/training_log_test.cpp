// What a training inside writes down: the keys and tags of a run of the program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "consac/base/hooks.h"
#include "engines/host/test/ticked_engine.h"
#include "tests/files.h"
#include "tests/folder.h"

namespace consac::host {
namespace {

using consac::testing::FilesBelow;
using consac::testing::Put;
using consac::testing::TestFolder;
using consac::testing::TextOf;
using consac::testing::TickedEngine;
using ::testing::HasSubstr;

TrainOptions Logged(const TestFolder& folder) {
  TrainOptions options;
  options.total_steps = 640;
  options.seed = 5;
  options.hyperparameters = {{"n_steps", "64"}};
  options.log_folder = folder.File("logs");
  return options;
}

void TrainOnTheRoad(const TrainOptions& options) {
  TickedEngine engine("road-v0", 2, 1);
  const auto driver = *Train(engine.world(), options);
  for (int tick = 0; tick < 1'000'000 && !driver->finished(); ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.01).ok());
  ASSERT_TRUE(driver->finished());
  for (int tick = 0; tick < 20; ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.01).ok());  // nobody learns any more
}

/// The columns of a CSV file, as text, without empty cells.
std::map<std::string, std::vector<std::string>> Columns(const std::string& path) {
  std::istringstream lines(TextOf(path));
  std::vector<std::string> keys;
  std::map<std::string, std::vector<std::string>> columns;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line + ",");
    std::size_t column = 0;
    const bool first = keys.empty();
    for (std::string field; std::getline(fields, field, ','); ++column) {
      if (first)
        keys.push_back(field);
      else if (column < keys.size() && !field.empty())
        columns[keys[column]].push_back(field);
    }
  }
  return columns;
}

/// The one event file of a folder.
std::string EventsIn(const std::string& folder) {
  for (const auto& [path, text] : FilesBelow(folder)) {
    if (path.find("events.out.tfevents.") != std::string::npos) return text;
  }
  return {};
}

TEST(TrainingLog, HasARowForEachUpdate) {
  for (const WhileLearning meanwhile : {WhileLearning::kWait, WhileLearning::kGoOn}) {
    const TestFolder folder;
    TrainOptions options = Logged(folder);
    options.while_learning = meanwhile;
    TrainOnTheRoad(options);
    auto columns = Columns(folder.File("logs/PPO2_1/progress.csv"));
    const std::vector<std::string> steps = {"128", "256", "384", "512", "640"};
    EXPECT_EQ(columns["total_timesteps"], steps) << "two agents, 64 steps each";
    EXPECT_EQ(columns["n_updates"], (std::vector<std::string>{"1", "2", "3", "4", "5"}));
    EXPECT_EQ(columns["serial_timesteps"], (std::vector<std::string>{"64", "128", "192", "256", "320"}));
    EXPECT_EQ(columns["policy_entropy"].size(), 5u);
    EXPECT_THAT(EventsIn(folder.File("logs/PPO2_1")), HasSubstr("loss/policy_gradient_loss"));
  }
}

TEST(TrainingLog, HasTheRewardsOfWholeEpisodes) {
  const TestFolder folder;
  TickedEngine engine("cartpole-v1", 2, 1);
  TrainOptions options = Logged(folder);
  const auto driver = *Train(engine.world(), options);
  for (int tick = 0; tick < 1'000'000 && !driver->finished(); ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.01).ok());
  auto columns = Columns(folder.File("logs/PPO2_1/progress.csv"));
  ASSERT_EQ(columns["ep_reward_mean"].size(), 5u);
  EXPECT_EQ(columns["ep_reward_mean"].back(), columns["ep_len_mean"].back()) << "a pole is paid 1 a step";
  const Tally tally = engine.world().tally();
  EXPECT_NEAR(std::stod(columns["ep_reward_mean"].back()), tally.mean_episode_reward, 5.0);
  EXPECT_THAT(EventsIn(folder.File("logs/PPO2_1")), HasSubstr("episode_reward"));
}

TEST(TrainingLog, OfAnAlgorithmThatLearnsAtEveryStep) {
  for (const WhileLearning meanwhile : {WhileLearning::kWait, WhileLearning::kGoOn}) {
    const TestFolder folder;
    TrainOptions options = Logged(folder);
    options.algorithm = "dqn";
    options.hyperparameters = {{"learning_starts", "50"}, {"net_arch", "[8]"}};
    options.while_learning = meanwhile;
    TickedEngine engine("cartpole-v1", 1, 1);
    const auto driver = *Train(engine.world(), options);
    for (int tick = 0; tick < 1'000'000 && !driver->finished(); ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.01).ok());
    auto columns = Columns(folder.File("logs/DQN_1/progress.csv"));
    EXPECT_GE(columns["time/total_timesteps"].size(), 2u) << "every fourth episode";
    EXPECT_EQ(columns["rollout/ep_rew_mean"].size(), columns["time/total_timesteps"].size());
    EXPECT_THAT(EventsIn(folder.File("logs/DQN_1")), HasSubstr("rollout/ep_rew_mean"));
  }
}

TEST(TrainingLog, WritesOverNoTrainingBefore) {
  const TestFolder folder;
  TrainOnTheRoad(Logged(folder));
  const std::string first = TextOf(folder.File("logs/PPO2_1/progress.csv"));
  TrainOnTheRoad(Logged(folder));
  EXPECT_EQ(TextOf(folder.File("logs/PPO2_1/progress.csv")), first);
  EXPECT_FALSE(TextOf(folder.File("logs/PPO2_2/progress.csv")).empty());
}

TEST(TrainingLog, IsWrittenWhereItIsAskedForAlone) {
  const TestFolder folder;
  TrainOptions options = Logged(folder);
  options.log_folder.clear();
  TrainOnTheRoad(options);
  EXPECT_TRUE(FilesBelow(folder.path()).empty());
  Put(folder.File("logs"), "a file");
  TickedEngine engine("road-v0", 1, 1);
  const auto refused = Train(engine.world(), Logged(folder));
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.status().message(), HasSubstr(folder.File("logs/PPO2_1")));
}

#if !defined(_WIN32)
TEST(TrainingLog, ThatCannotBeWrittenIsOneWarningAndTheTrainingGoesOn) {
  const TestFolder folder;
  static int warnings;
  warnings = 0;
  Hooks hooks;
  hooks.log = [](void*, LogLevel, std::string_view line) {
    if (line.find("the training goes on, but this log has a gap") != std::string_view::npos) ++warnings;
  };
  SetHooks(hooks);
  TickedEngine engine("road-v0", 2, 1);
  const auto driver = *Train(engine.world(), Logged(folder));
  {
    const consac::testing::FileSizeLimit limit(100);
    for (int tick = 0; tick < 1'000'000 && !driver->finished(); ++tick) EXPECT_TRUE(engine.Tick(*driver, 0.01).ok());
  }
  SetHooks({});
  EXPECT_TRUE(driver->finished());
  EXPECT_EQ(warnings, 1);
}
#endif

}  // namespace
}  // namespace consac::host
