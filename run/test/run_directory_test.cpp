#include "consac/run/run_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#if !defined(_WIN32)
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <cstring>
#include <fstream>
#include <map>
#include <set>

#include "consac/base/file.h"
#include "consac/model/model_file.h"
#include "tests/files.h"
#include "tests/support.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;
using testing::FilesBelow;
using ::testing::HasSubstr;
using testing::Put;
using testing::TextOf;

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

TEST(RunDirectory, ACheckpointThatIsTooLargeIsNotRead) {
  testing::ScratchFolder scratch("large");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  ASSERT_TRUE(directory->SaveCheckpoint(100, State(1.0f), "{}", 3).ok());
  EXPECT_TRUE(directory->LoadCheckpoint(1 << 20).ok());
  fs::resize_file(directory->File("checkpoints/step_000000000100.consac"), std::uintmax_t{1} << 30);
  const Status refused = directory->LoadCheckpoint(1 << 20).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(),
              HasSubstr("step_000000000100.consac' has 1024 MiB, where one of this run has at most 1"));
}

TEST(RunDirectory, HoweverItsFolderIsSpelledCheckpointsStay) {
  testing::ScratchFolder scratch("spelled");
  for (const char* spelling : {"/", "//", "/.", "/./"}) {
    auto directory = RunDirectory::Open(scratch.path() + spelling, "run", ExistingRun::kOverwrite);
    ASSERT_TRUE(directory.ok()) << directory.status().message();
    std::ofstream((*directory)->File("config.yaml")) << "seed: 1\n";
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

TEST(RunDirectory, CheckpointsThatSomebodyNamedAreTheirs) {
  testing::ScratchFolder scratch("named_checkpoints");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  std::set<std::string> there = {"step_best.consac", "step_3000.consac",          "step_000000001000 copy.consac",
                                 "step_-1.consac",   "step_0000000001000.consac", "learner.replay.rows_mine.rows"};
  for (const std::string& name : there) std::ofstream(directory->File("checkpoints/" + name)) << "mine";
  for (int k = 0; k < 3; ++k)  // which removes segments that are not needed, too
    ASSERT_TRUE(directory->SaveCheckpoint(999999999999 + k, State(1.0f), "{}", 1).ok());
  there.insert("step_1000000000001.consac");
  std::set<std::string> left;
  for (const auto& entry : fs::directory_iterator(directory->File("checkpoints"))) {
    left.insert(entry.path().filename().string());
  }
  EXPECT_EQ(left, there);
}

TEST(RunDirectory, WhenAllCheckpointsAreDamagedThatIsAnError) {
  testing::ScratchFolder scratch("damaged");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  std::ofstream(directory->File("checkpoints/step_000000000500.consac")) << "damaged";
  const Result<StateMap> state = directory->LoadCheckpoint();
  ASSERT_FALSE(state.ok());
  EXPECT_EQ(state.status().code(), StatusCode::kDataLoss);
}

// Beside every file that is saved by another name first.
TEST(RunDirectory, WhatAKilledProcessHasHalfWrittenGoes) {
  testing::ScratchFolder scratch("half_written");
  const std::string run = scratch.path() + "/run/";
  const char* const files[] = {"config.yaml.tmp-12", "model.consac.tmp-12", "curve.svg.tmp-12",
                               "checkpoints/step_000000000100.consac.tmp-12", "best/model.consac.tmp-12"};
  for (const char* file : files) Put(run + file, "half");
  for (const char* file : {"config.yaml", "best/model.consac", "best/notes.tmp-12"}) Put(run + file, "whole");
  ASSERT_NE(Open(scratch.path(), ExistingRun::kResume), nullptr);
  for (const char* file : files) EXPECT_FALSE(fs::exists(run + file)) << file;
  EXPECT_TRUE(fs::exists(run + "best/model.consac") && fs::exists(run + "best/notes.tmp-12"));
}

TEST(RunDirectory, AFolderThatIsNoRunsLosesNothing) {
  testing::ScratchFolder scratch("foreign");
  for (const char* file : {"progress.csv", "thesis.tmp-1", "model.consac", "checkpoints/mine.consac", "deep/er/x"}) {
    const std::string run = scratch.path() + "/run";
    fs::remove_all(run);
    Put(run + "/" + file, "mine");
    const auto before = FilesBelow(run);
    for (const ExistingRun existing : {ExistingRun::kRefuse, ExistingRun::kOverwrite}) {
      const auto directory = RunDirectory::Open(scratch.path(), "run", existing);
      ASSERT_FALSE(directory.ok()) << file;
      EXPECT_EQ(directory.status().code(), StatusCode::kAlreadyExists);
      EXPECT_THAT(directory.status().message(), HasSubstr("left alone"));
    }
    EXPECT_EQ(FilesBelow(run), before) << file;
  }
}

#if !defined(_WIN32)
TEST(RunDirectory, ALockThatIsALinkIsNamed) {
  testing::ScratchFolder scratch("lock_link");
  fs::create_directories(scratch.path() + "/run");
  fs::create_symlink(scratch.path() + "/elsewhere", scratch.path() + "/run/.lock");
  const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kRefuse);
  EXPECT_THAT(directory.status().message(), HasSubstr("/run/.lock' is a link"));
  EXPECT_EQ(directory.status().code(), StatusCode::kDataLoss);
}

// What a run that goes on would write to, or put its own in the place of.
TEST(RunDirectory, FilesThatAreNoneOrAreSomebodyElsesTooAreNotGoneOnWith) {
  testing::ScratchFolder scratch("go_on");
  const std::string run = scratch.path() + "/run/";
  const auto said = [&](const std::string& name, auto&& make) {
    fs::remove_all(run);
    for (const char* file : {"config.yaml", "monitor.csv", "model.consac"}) Put(run + file, "old");
    fs::remove(run + name);
    make(run + name);
    const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kResume);
    EXPECT_EQ(directory.status().code(), StatusCode::kDataLoss) << name;
    return directory.status().message();
  };
  for (const char* name : {"monitor.csv", "model.consac"}) {
    EXPECT_THAT(said(name, [](const std::string& path) { ASSERT_EQ(mkfifo(path.c_str(), 0600), 0); }),
                HasSubstr(std::string(name) + "' is no regular file"));
    EXPECT_THAT(said(name, [](const std::string& path) { fs::create_directory(path); }),
                HasSubstr(std::string(name) + "' is no regular file"));
    EXPECT_THAT(said(name, [](const std::string& path) { fs::create_symlink("/dev/full", path); }),
                HasSubstr(std::string(name) + "' is "));
  }
  Put(scratch.path() + "/theirs", "theirs");
  for (const char* name : {"monitor.csv", "config.yaml", "model.consac", "curve.svg", "curve.png", ".lock",
                           "progress.csv", "hunter.monitor.csv"}) {
    EXPECT_THAT(said(name, [&](const std::string& path) { fs::create_hard_link(scratch.path() + "/theirs", path); }),
                HasSubstr(std::string(name) + "' has another name (a hard link)"));
    EXPECT_THAT(said(name, [&](const std::string& path) { fs::create_symlink(scratch.path() + "/theirs", path); }),
                HasSubstr(std::string(name) + "' is a link"));
  }
  // A behaviour's model is known by its log; another model there is nobody's business.
  EXPECT_THAT(said("hunter.consac",
                   [&](const std::string& path) {
                     fs::create_hard_link(scratch.path() + "/theirs", path);
                     Put(run + "hunter.monitor.csv", "old");
                   }),
              HasSubstr("hunter.consac' has another name"));
  fs::remove_all(run);
  Put(run + "config.yaml", "old");
  fs::create_hard_link(scratch.path() + "/theirs", run + "mine.consac");
  EXPECT_TRUE(RunDirectory::Open(scratch.path(), "run", ExistingRun::kResume).ok());
}

// Two runs with one lock would wait for each other, or be written to by two.
TEST(RunDirectory, ALockThatIsSomebodyElsesTooIsNotTaken) {
  testing::ScratchFolder scratch("lock_hard_link");
  const auto mine = Open(scratch.path(), ExistingRun::kRefuse);
  fs::create_directories(scratch.path() + "/other");
  fs::create_hard_link(mine->File(".lock"), scratch.path() + "/other/.lock");
  const auto other = RunDirectory::Open(scratch.path(), "other", ExistingRun::kRefuse);
  EXPECT_THAT(other.status().message(), HasSubstr("/other/.lock' has another name (a hard link)"));
}
#endif

TEST(RunDirectory, CheckpointsThatCannotBeLookedAtMayBeWhole) {
  testing::ScratchFolder scratch("closed");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  std::filesystem::remove_all(scratch.path() + "/run/checkpoints");
  Put(scratch.path() + "/run/checkpoints", "no folder");  // which nobody can look into, root neither
  const Result<StateMap> state = directory->LoadCheckpoint();
  EXPECT_EQ(state.status().code(), StatusCode::kDataLoss);
  EXPECT_THAT(state.status().message(), HasSubstr("may be whole"));
}

TEST(RunDirectory, AFolderThatCannotBeMadeIsTheOneThatIsNamed) {
  testing::ScratchFolder scratch("no_folder");
  Put(scratch.path() + "/run/config.yaml", "seed: 1\n");
  Put(scratch.path() + "/run/checkpoints", "no folder");
  const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kResume);
  EXPECT_THAT(directory.status().message(), HasSubstr("cannot make folder '" + scratch.path() + "/run/checkpoints'"));
}

#if !defined(_WIN32)  // where a folder with an open file cannot be deleted
TEST(RunDirectory, AFolderThatWasDeletedBelongsToWhoeverMakesItAnew) {
  testing::ScratchFolder scratch("deleted");
  const auto first = Open(scratch.path(), ExistingRun::kRefuse);
  ASSERT_TRUE(first->SaveCheckpoint(900, State(1.0f), "{}", 3).ok());
  fs::remove_all(first->path());
  EXPECT_EQ(first->CheckOurs().code(), StatusCode::kDataLoss);
  EXPECT_FALSE(first->SaveCheckpoint(950, State(1.0f), "{}", 3).ok());
  const auto second = Open(scratch.path(), ExistingRun::kRefuse);
  ASSERT_TRUE(second->SaveCheckpoint(100, State(2.0f), "{}", 1).ok());
  const Status lost = first->SaveCheckpoint(50, State(1.0f), "{}", 1);
  EXPECT_THAT(lost.message(), HasSubstr("another run"));
  EXPECT_EQ(ValueOf(*second), 2.0f);
  EXPECT_TRUE(second->CheckOurs().ok());
}

// Asked before the first file of a save, the folder may be another run's when the second is written.
TEST(RunDirectory, BetweenTwoFilesOfASaveItsFolderMayBeExchangedAndNothingGoesIntoTheOther) {
  testing::ScratchFolder scratch("exchanged");
  for (const bool link : {false, true}) {
    const std::string root = scratch.path() + (link ? "/link" : "/folder"), other = root + "/other";
    fs::create_directories(other + "/checkpoints");
    for (const char* file : {"/.lock", "/model.consac", "/checkpoints/step_000000000100.consac"})
      std::ofstream(other + file) << "theirs";
    const auto directory = Open(root, ExistingRun::kRefuse);
    ASSERT_TRUE(directory->CheckOurs().ok());
    ASSERT_TRUE(directory->SaveCheckpoint(50, State(1.0f), "{}", 1).ok());
    fs::rename(directory->path(), root + "/moved");
    if (link)
      fs::create_directory_symlink(other, directory->path());
    else
      fs::rename(other, directory->path());
    const std::string bytes = "ours";
    const Status refused = directory->Write(directory->File("model.consac"), std::as_bytes(std::span(bytes)));
    EXPECT_THAT(refused.message(), HasSubstr("belongs to another run now"));
    EXPECT_FALSE(directory->SaveCheckpoint(100, State(1.0f), "{}", 1).ok());
    for (const char* file : {"model.consac", "checkpoints/step_000000000100.consac"})
      EXPECT_EQ(TextOf(directory->File(file)), "theirs") << file;
    EXPECT_FALSE(fs::exists(root + "/moved/model.consac"));
  }
}
#endif

TEST(RunDirectory, ACheckpointThatCannotBeReadIsNotTakenForDamaged) {
  testing::ScratchFolder scratch("unreadable");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  ASSERT_TRUE(directory->SaveCheckpoint(100, State(1.0f), "{}", 3).ok());
  fs::create_directory(directory->File("checkpoints/step_000000000500.consac"));  // nobody can read that, root neither
  const Result<StateMap> state = directory->LoadCheckpoint();
  ASSERT_FALSE(state.ok());
  EXPECT_EQ(state.status().code(), StatusCode::kDataLoss);
  EXPECT_THAT(state.status().message(), HasSubstr("cannot be read"));
}

#if !defined(_WIN32)
TEST(RunDirectory, APipeInACheckpointsPlaceIsNotWaitedFor) {
  testing::ScratchFolder scratch("pipe");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  ASSERT_TRUE(directory->SaveCheckpoint(100, State(1.0f), "{}", 3).ok());
  ASSERT_EQ(mkfifo(directory->File("checkpoints/step_000000000500.consac").c_str(), 0600), 0);
  EXPECT_THAT(directory->LoadCheckpoint().status().message(), HasSubstr("no regular file"));
}
#endif

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
