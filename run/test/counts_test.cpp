// Checkpoints that are whole and count what cannot have been counted: refused by name before anything goes on by them.
#include "counts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "consac/model/model_file.h"
#include "old_run.h"
#include "small_run.h"

namespace consac::run {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();

/// The newest checkpoint of a run.
std::string CheckpointOf(const RunConfig& config) {
  std::string found;
  for (const auto& entry : std::filesystem::directory_iterator(config.directory + "/" + config.name + "/checkpoints"))
    if (entry.path().extension() == ".consac") found = std::max(found, entry.path().generic_string());
  return found;
}

/// Gives an element of a field another value, as somebody does who knows how checkpoints are made.
void Forge(const std::string& checkpoint, const std::string& field, std::int64_t value) {
  Result<ModelFile> file = ModelFile::Load(checkpoint);
  ASSERT_TRUE(file.ok()) << file.status().message();
  const auto tensor = file->tensors.find("state/" + field);
  ASSERT_NE(tensor, file->tensors.end()) << field;
  ASSERT_EQ(tensor->second.dtype, DType::kI64) << field;
  std::memcpy(tensor->second.bytes.data(), &value, sizeof(value));
  ASSERT_TRUE(file->Save(checkpoint).ok());
}

/// Also where the system's own copying refuses a file that is there (MinGW's).
void CopyOver(const std::string& from, const std::string& to) {
  std::filesystem::remove(to);
  std::filesystem::copy_file(from, to);
}

struct Forgery {
  RunConfig (*small)(const std::string& directory, const std::string& name);
  const char* field;
  std::int64_t value;
};

TEST(Counts, ThatNobodyCanHaveCountedAreRefusedByNameAndNothingIsTouched) {
  testing::ScratchFolder scratch("forged");
  const Forgery forgeries[] = {
      {SmallRun, "steps", kLeast},
      {SmallRun, "steps", 639},  // of its learners there are 640
      {SmallRun, "next_evaluation", -1},
      {SmallRun, "learner/updates", kLeast},
      {SmallRun, "learner/steps", 641},
      {SmallRun, "learner/adam/steps", kMostCounted + 1},
      {SmallRun, "learner/epoch", -3},
      {SmallRun, "learner/epoch", 5},  // of four
      {SmallRun, "learner_episodes/lengths", -7},
      {SmallRun, "report/episodes/count", -1},
      {SmallRun, "report/episode_curve/stride", 0 - kMostCounted},
      {SmallRun, "world/worlds/0/steps", -1},
      {SmallReplayRun, "learner/due", std::int64_t{1} << 62},
      {SmallReplayRun, "learner/due", 3},  // two agents, one gradient step
      {SmallReplayRun, "learner/round", 1},
      {SmallReplayRun, "learner/round_steps", 600},
      {SmallReplayRun, "learner/round_episodes", 600},
      {SmallReplayRun, "learner/round_slot_steps", 600},
      {SmallSacRun, "learner/due", std::int64_t{1} << 40},
      {SmallDdpgRun, "learner/due", std::int64_t{1} << 40},
  };
  for (const auto small : {SmallRun, SmallReplayRun, SmallSacRun, SmallDdpgRun}) {
    RunConfig config = small(scratch.path(), "forged");
    config.steps = 640;
    config.force = true;
    ASSERT_TRUE(Train(config, kNeverStop).ok());
    config.force = false;
    config.resume = true;
    config.steps = 700;
    const std::string checkpoint = CheckpointOf(config), kept = scratch.path() + "/kept";
    CopyOver(checkpoint, kept);
    for (const Forgery& forgery : forgeries) {
      if (forgery.small != small) continue;
      CopyOver(kept, checkpoint);
      Forge(checkpoint, forgery.field, forgery.value);
      const auto before = Contents(config.directory);
      const Result<RunSummary> resumed = Train(config, kNeverStop);
      ASSERT_FALSE(resumed.ok()) << forgery.field << " = " << forgery.value;
      EXPECT_EQ(resumed.status().code(), StatusCode::kDataLoss);
      EXPECT_THAT(resumed.status().message(),
                  AllOf(HasSubstr("cannot resume '" + config.directory + "/forged': state field '"),
                        HasSubstr("by somebody else's hand")))
          << forgery.field;
      EXPECT_EQ(Differences(before, Contents(config.directory)), "") << forgery.field;
    }
    CopyOver(kept, checkpoint);
    const Result<RunSummary> resumed = Train(config, kNeverStop);
    EXPECT_TRUE(resumed.ok()) << resumed.status().message();
  }
}

TEST(Counts, AreNamedWithTheirValues) {
  StateMap state;
  const auto put = [&state](const std::string& name, std::int64_t value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    state[name] = {DType::kI64, std::vector<std::byte>(bytes.begin(), bytes.end())};
  };
  put("learner/steps", kMostCounted);
  put("world/depth", -5);
  put("next_evaluation", kMostCounted + 1);
  EXPECT_TRUE(CheckCounts(state).ok()) << CheckCounts(state).message();
  put("learner1/steps", kMostCounted + 1);
  EXPECT_EQ(CheckCounts(state).message(),
            "state field 'learner1/steps' is 9007199254740993, and what is counted is from 0 to 9007199254740992");
}

// Before it is read into memory that a run has not.
TEST(Counts, ACheckpointBeyondTheMemoryOfItsRunIsNotRead) {
  testing::ScratchFolder scratch("beyond");
  RunConfig config = SmallRun(scratch.path());
  config.steps = 640;
  config.max_memory_mib = 64;
  ASSERT_TRUE(Train(config, kNeverStop).ok());
  std::filesystem::resize_file(CheckpointOf(config), std::uintmax_t{1} << 30);
  config.resume = true;
  const Status refused = Train(config, kNeverStop).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(), HasSubstr("has 1024 MiB, where one of this run has at most 12"));
}

}  // namespace
}  // namespace consac::run
