#include "consac/run/run_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#if !defined(_WIN32)
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <csignal>
#include <cstring>
#include <fstream>
#include <map>

#include "consac/model/model_file.h"
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

TEST(RunDirectory, WhenAllCheckpointsAreDamagedThatIsAnError) {
  testing::ScratchFolder scratch("damaged");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  std::ofstream(directory->File("checkpoints/step_000000000500.consac")) << "damaged";
  const Result<StateMap> state = directory->LoadCheckpoint();
  ASSERT_FALSE(state.ok());
  EXPECT_EQ(state.status().code(), StatusCode::kDataLoss);
}

/// Every file below a folder, with what is in it.
std::map<std::string, std::string> FilesBelow(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path());
    files[entry.path().generic_string()] = std::string((std::istreambuf_iterator<char>(file)), {});
  }
  return files;
}

void Write(const std::string& path, const std::string& text) {
  fs::create_directories(fs::path(path).parent_path());
  std::ofstream(path) << text;
}

TEST(RunDirectory, AFolderThatIsNoRunsLosesNothing) {
  testing::ScratchFolder scratch("foreign");
  for (const char* file : {"progress.csv", "thesis.tmp-1", "model.consac", "checkpoints/mine.consac", "deep/er/x"}) {
    const std::string run = scratch.path() + "/run";
    fs::remove_all(run);
    Write(run + "/" + file, "mine");
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

TEST(RunDirectory, OverwritingRemovesWhatARunWritesAndNothingElse) {
  testing::ScratchFolder scratch("force");
  const std::string run = scratch.path() + "/run/";
  ModelFile model;
  model.spec_json = R"({"kind": "policy", "interface": {"behaviour": "walker"}})";
  Write(run + "config.yaml", "a run's, which the new one replaces");
  for (const char* file : {"progress.csv", "monitor.csv", "curve.svg", "curve.png", "model.consac",
                           "checkpoints/step_000000000100.consac", "tensorboard/PPO2_1/events.out.tfevents.1.host.2",
                           "evaluations.csv", "config.yaml.tmp-77", "checkpoints/step_000000000200.consac.tmp-77",
                           "walker.monitor.csv", "walker.curve.svg", "walker.curve.png", "walker.curve.png.tmp-77"})
    Write(run + file, "a run's");
  ASSERT_TRUE(model.Save(run + "walker.consac").ok());
  for (const char* file : {"notes.txt", "best.consac", "letter.tmp-77", "config.yaml.tmp-me", "checkpoints/mine.txt",
                           "tensorboard/mine.txt", "tensorboard/PPO2_2/mine.txt", "checkpoints/best.consac",
                           "my.curve.png", "best/mine.txt"})
    Write(run + file, "mine");
  ASSERT_TRUE(model.Save(run + "favourite.consac").ok());
  ASSERT_TRUE(model.Save(run + "best/walker.consac").ok());
  const auto directory = Open(scratch.path(), ExistingRun::kOverwrite);
  ASSERT_NE(directory, nullptr);
  for (const char* file : {"model.consac", "walker.consac", "best/walker.consac"})
    EXPECT_TRUE(fs::exists(run + file)) << file << " stays until this run has its own";
  EXPECT_TRUE(directory->has_old_models());
  directory->KeepModel(run + "walker.consac");
  directory->RemoveOldModels();
  EXPECT_TRUE(fs::remove(run + "walker.consac")) << "this run's own";
  EXPECT_FALSE(std::filesystem::exists(run + "tensorboard/PPO2_1"));
  std::vector<std::string> left;
  for (const auto& [path, text] : FilesBelow(run)) left.push_back(path.substr(run.size()));
  EXPECT_THAT(left, ::testing::UnorderedElementsAre(
                        ".lock", "config.yaml", "notes.txt", "best.consac", "letter.tmp-77", "config.yaml.tmp-me",
                        "checkpoints/mine.txt", "tensorboard/mine.txt", "tensorboard/PPO2_2/mine.txt", "best/mine.txt",
                        "checkpoints/best.consac", "favourite.consac", "my.curve.png"));
}

// Killed, or out of descriptors, before the new run has a configuration: it is a run's folder still.
TEST(RunDirectory, OverwritingThatIsInterruptedMayBeTriedAgain) {
  testing::ScratchFolder scratch("interrupted");
  for (const char* file : {"config.yaml", "model.consac", "notes.txt"}) Write(scratch.path() + "/run/" + file, "old");
  for (int i = 0; i < 2; ++i) ASSERT_NE(Open(scratch.path(), ExistingRun::kOverwrite), nullptr) << i;
}

/// A run with two checkpoints and a model, to be overwritten.
std::string OldRun(const std::string& root) {
  const std::string run = root + "/run/";
  fs::remove_all(run);
  for (const char* file : {"config.yaml", "progress.csv", "monitor.csv", "model.consac", "best/model.consac", ".lock",
                           "checkpoints/step_000000000100.consac", "checkpoints/step_000000000200.consac"})
    Write(run + file, "old");
  return run;
}

TEST(RunDirectory, WhatCannotBeOverwrittenLosesNothing) {
  testing::ScratchFolder scratch("refused");
  for (const char* name : {"config.yaml", "progress.csv", "monitor.csv", "evaluations.csv", "curve.svg", "model.consac",
                           "checkpoints/step_000000000200.consac", "tensorboard", "best"}) {
    const std::string run = OldRun(scratch.path());
    const bool folder = std::string_view(name) == "tensorboard" || std::string_view(name) == "best";
    fs::remove_all(run + name);
    if (folder) Write(run + name, "a file");
    if (!folder) fs::create_directory(run + name);
    const auto before = FilesBelow(run);
    const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kOverwrite);
    ASSERT_FALSE(directory.ok()) << name;
    EXPECT_EQ(directory.status().code(), StatusCode::kDataLoss) << name;
    EXPECT_THAT(directory.status().message(), HasSubstr(run + name));
    EXPECT_THAT(directory.status().message(), HasSubstr("nothing of the old run was removed"));
    EXPECT_EQ(FilesBelow(run), before) << name;
  }
}

#if !defined(_WIN32)
TEST(RunDirectory, WithoutDescriptorsOrRoomTheOldRunStays) {
  testing::ScratchFolder scratch("limits");
  const std::string run = OldRun(scratch.path());
  const auto before = FilesBelow(run);
  for (const auto& [resource, limit] : {std::pair{RLIMIT_NOFILE, rlim_t{6}}, std::pair{RLIMIT_FSIZE, rlim_t{1024}}}) {
    const pid_t child = fork();
    if (child == 0) {
      std::signal(SIGXFSZ, SIG_IGN);
      for (int descriptor = 3; descriptor < 100; ++descriptor) close(descriptor);
      const rlimit limits{limit, limit};
      setrlimit(resource, &limits);
      const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kOverwrite);
      _exit(directory.ok() ? 0 : static_cast<int>(directory.status().code()));
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), static_cast<int>(StatusCode::kResourceExhausted));
    EXPECT_EQ(FilesBelow(run), before);
  }
}

TEST(RunDirectory, AFolderThatTakesNoNewFilesLosesNothing) {
  testing::ScratchFolder scratch("closed_folder");
  const std::string run = OldRun(scratch.path());
  for (const std::string& closed : {run, run + "checkpoints"}) {
    const auto before = FilesBelow(run);
    const pid_t child = fork();
    if (child == 0) {
      for (const auto& entry : fs::recursive_directory_iterator(scratch.path())) {
        fs::permissions(entry.path(), fs::perms::all);
      }
      fs::permissions(scratch.path(), fs::perms::all);
      fs::permissions(closed, fs::perms(0555));
      if (getuid() == 0 && setuid(65534) != 0) _exit(100);  // nothing is closed to root
      const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kOverwrite);
      const bool said = directory.status().message().find("Permission denied") != std::string::npos;
      _exit(!said ? 101 : static_cast<int>(directory.status().code()));
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), static_cast<int>(StatusCode::kDataLoss)) << closed;
    fs::permissions(closed, fs::perms::all);
    EXPECT_EQ(FilesBelow(run), before) << closed;
  }
}
#endif

TEST(RunDirectory, CheckpointsThatCannotBeLookedAtMayBeWhole) {
  testing::ScratchFolder scratch("closed");
  const auto directory = Open(scratch.path(), ExistingRun::kRefuse);
  std::filesystem::remove_all(scratch.path() + "/run/checkpoints");
  Write(scratch.path() + "/run/checkpoints", "no folder");  // which nobody can look into, root neither
  const Result<StateMap> state = directory->LoadCheckpoint();
  EXPECT_EQ(state.status().code(), StatusCode::kDataLoss);
  EXPECT_THAT(state.status().message(), HasSubstr("may be whole"));
}

TEST(RunDirectory, AFolderThatCannotBeMadeIsTheOneThatIsNamed) {
  testing::ScratchFolder scratch("no_folder");
  Write(scratch.path() + "/run/config.yaml", "seed: 1\n");
  Write(scratch.path() + "/run/checkpoints", "no folder");
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
