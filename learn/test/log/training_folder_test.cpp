// Folders of trainings, one after another.
#include "consac/learn/log/training_folder.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/files.h"
#include "tests/folder.h"

namespace consac::learn {
namespace {

using testing::TestFolder;

TEST(TrainingFolder, IsNewEachTimeAndNamedAsInStableBaselines) {
  const TestFolder folder;
  const std::string below = folder.File("logs/of mine");
  EXPECT_EQ(*MakeTrainingFolder(below, "ppo2"), below + "/PPO2_1");
  EXPECT_EQ(*MakeTrainingFolder(below, "ppo2"), below + "/PPO2_2");
  EXPECT_EQ(*MakeTrainingFolder(below, "sac"), below + "/SAC_1");
  EXPECT_TRUE(std::filesystem::is_directory(below + "/PPO2_2"));
}

TEST(TrainingFolder, ThatCannotBeMadeIsNamed) {
  const TestFolder folder;
  testing::Put(folder.File("logs"), "a file");
  const Result<std::string> made = MakeTrainingFolder(folder.File("logs"), "ppo");
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.status().message().find(folder.File("logs") + "/PPO_1"), std::string::npos) << made.status().message();
}

}  // namespace
}  // namespace consac::learn
