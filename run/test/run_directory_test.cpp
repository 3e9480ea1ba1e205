#include "consac/run/run_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#if !defined(_WIN32)
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <cstring>
#include <fstream>

#include "tests/support.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

StateMap State(float value) {
  StateMap state;
  const auto bytes = std::as_bytes(std::span(&value, 1));
  state["value"] = {DType::kF32, std::vector<std::byte>(bytes.begin(), bytes.end())};
  return state;
}

float ValueOf(const RunDirectory& directory) {
  const Result<StateMap> state = directory.LoadCheckpoint();
  EXPECT_TRUE(state.ok()) << state.status().message();
  float value = 0.0f;
  if (state.ok()) std::memcpy(&value, state->at("value").bytes.data(), sizeof(value));
  return value;
}

std::unique_ptr<RunDirectory> Open(const std::string& root, ExistingRun existing) {
  Result<std::unique_ptr<RunDirectory>> directory = RunDirectory::Open(root, "run", existing);
  EXPECT_TRUE(directory.ok()) << directory.status().message();
  return directory.ok() ? std::move(*directory) : nullptr;
}

TEST(RunDirectory, NamesThatAreNoFolderAreRefused) {
  testing::ScratchFolder scratch("names");
  for (const char* name :
       {"", ".", "..", "../x", "a/b", "/etc", "a\nb", ".hidden", "caf\xc3\xa9", "road.", "con", "NUL.txt", "com1"}) {
    const auto directory = RunDirectory::Open(scratch.path(), name, ExistingRun::kRefuse);
    ASSERT_FALSE(directory.ok()) << name;
    EXPECT_EQ(directory.status().code(), StatusCode::kInvalidArgument) << name;
  }
  EXPECT_TRUE(fs::is_empty(scratch.path()));
  EXPECT_FALSE(RunDirectory::Open("", "road", ExistingRun::kRefuse).ok()) << "not the root of the disk";
}

TEST(RunDirectory, OneWriterAtATime) {
  testing::ScratchFolder scratch("lock");
  const auto first = Open(scratch.path(), ExistingRun::kRefuse);
  for (const ExistingRun existing : {ExistingRun::kRefuse, ExistingRun::kOverwrite}) {
    const auto second = RunDirectory::Open(scratch.path(), "run", existing);
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(second.status().code(), StatusCode::kFailedPrecondition);
    EXPECT_THAT(second.status().message(), HasSubstr("another process"));
  }
}

#if !defined(_WIN32)  // tests/windows/test_program.py starts two programs there
TEST(RunDirectory, AnotherProcessIsKeptOutUntilThisOneIsGone) {
  testing::ScratchFolder scratch("process");
  const auto code_of_child = [&] {
    const pid_t child = fork();
    if (child == 0) {
      const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kRefuse);
      _exit(directory.ok() ? 0 : static_cast<int>(directory.status().code()));
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WEXITSTATUS(status);
  };
  auto mine = Open(scratch.path(), ExistingRun::kRefuse);
  EXPECT_EQ(code_of_child(), static_cast<int>(StatusCode::kFailedPrecondition));
  mine.reset();
  EXPECT_EQ(code_of_child(), 0);
}
#endif

TEST(RunDirectory, AFolderThatCannotBeMadeSaysSo) {
  testing::ScratchFolder scratch("file");
  std::ofstream(scratch.path() + "/runs") << "a file";
  const auto directory = RunDirectory::Open(scratch.path() + "/runs", "run", ExistingRun::kRefuse);
  ASSERT_FALSE(directory.ok());
  EXPECT_THAT(directory.status().message(), HasSubstr(scratch.path() + "/runs"));
}

TEST(RunDirectory, TheNewestWholeCheckpointIsLoaded) {
  testing::ScratchFolder scratch("newest");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  EXPECT_EQ(directory->LoadCheckpoint().status().code(), StatusCode::kNotFound);
  ASSERT_TRUE(directory->SaveCheckpoint(100, State(1.0f), "{}", 3).ok());
  ASSERT_TRUE(directory->SaveCheckpoint(20000000000, State(2.0f), "{}", 3).ok());
  EXPECT_EQ(ValueOf(*directory), 2.0f);
  fs::resize_file(directory->File("checkpoints/step_020000000000.consac"), 50);
  EXPECT_EQ(ValueOf(*directory), 1.0f);
}

TEST(RunDirectory, HoweverItsFolderIsSpelledCheckpointsStay) {
  testing::ScratchFolder scratch("spelled");
  for (const char* spelling : {"/", "//", "/.", "/./"}) {
    auto directory = RunDirectory::Open(scratch.path() + spelling, "run", ExistingRun::kOverwrite);
    ASSERT_TRUE(directory.ok()) << directory.status().message();
    ASSERT_TRUE((*directory)->SaveCheckpoint(100, State(1.0f), "{}", 2).ok());
    ASSERT_TRUE((*directory)->SaveCheckpoint(200, State(2.0f), "{}", 2).ok());
    EXPECT_EQ(ValueOf(**directory), 2.0f) << spelling;
    EXPECT_TRUE(fs::exists(scratch.path() + "/run/checkpoints/step_000000000100.consac")) << spelling;
  }
}

TEST(RunDirectory, ADamagedCheckpointOfTheFutureDoesNotPushOutAGoodOne) {
  testing::ScratchFolder scratch("future");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  std::ofstream(directory->File("checkpoints/step_000000000500.consac")) << "damaged";
  ASSERT_TRUE(directory->SaveCheckpoint(300, State(3.0f), "{}", 1).ok());
  EXPECT_EQ(ValueOf(*directory), 3.0f);
}

TEST(RunDirectory, WhenAllCheckpointsAreDamagedThatIsAnError) {
  testing::ScratchFolder scratch("damaged");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  std::ofstream(directory->File("checkpoints/step_000000000500.consac")) << "damaged";
  const Result<StateMap> state = directory->LoadCheckpoint();
  ASSERT_FALSE(state.ok());
  EXPECT_EQ(state.status().code(), StatusCode::kDataLoss);
}

TEST(RunDirectory, HalfWrittenFilesOfAKilledRunAreSweptUp) {
  testing::ScratchFolder scratch("sweep");
  auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  std::ofstream(directory->File("config.yaml")) << "seed: 1\n";
  const std::string half = directory->File("checkpoints/step_000000000500.consac.tmp-123");
  std::ofstream(half) << "half";
  directory.reset();
  directory = Open(scratch.path(), ExistingRun::kResume);
  EXPECT_FALSE(fs::exists(half));
  EXPECT_TRUE(fs::exists(directory->File("config.yaml")));
}

}  // namespace
}  // namespace consac::run
