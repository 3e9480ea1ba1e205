// Where a run's event files are.
#include "report/tensorboard_folder.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "run/test/report/files.h"

namespace consac::run {
namespace {

TEST(TensorboardFolder, FoldersAreNumberedAsInStableBaselines) {
  const TestFolder folder;
  EXPECT_EQ(*TensorboardFolder(folder.path(), "ppo2", learn::OpenMode::kTruncate), folder.File("PPO2_1"));
  EXPECT_EQ(*TensorboardFolder(folder.path(), "ppo2", learn::OpenMode::kTruncate), folder.File("PPO2_2"));
  EXPECT_EQ(*TensorboardFolder(folder.path(), "ppo2", learn::OpenMode::kAppend), folder.File("PPO2_2"));
  EXPECT_EQ(*TensorboardFolder(folder.path(), "ppo", learn::OpenMode::kAppend), folder.File("PPO_1"));
  std::filesystem::create_directories(folder.File("PPO_11"));
  EXPECT_EQ(*TensorboardFolder(folder.path(), "ppo", learn::OpenMode::kTruncate), folder.File("PPO_12"));
}

TEST(TensorboardFolder, AFolderThatCannotBeMadeIsNamed) {
  const TestFolder folder;
  Put(folder.File("tensorboard"), "a file");
  const auto made = TensorboardFolder(folder.File("tensorboard"), "ppo", learn::OpenMode::kTruncate);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.status().message().find(folder.File("tensorboard/PPO_1")), std::string::npos);
}

TEST(TensorboardFolder, AFileOfAResumeComesAfterTheOthers) {
  const TestFolder folder;
  const auto first = std::move(*OpenEvents(folder.path(), 1700000000.0));
  const auto second = std::move(*OpenEvents(folder.path(), 1700000000.0));
  EXPECT_LT(first->path(), second->path());
}

}  // namespace
}  // namespace consac::run
