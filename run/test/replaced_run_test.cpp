// --force: the old run is set aside, and goes only once the new one is saved.
#include "replaced_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#if !defined(_WIN32)
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <csignal>
#include <fstream>
#include <functional>
#include <random>
#include <thread>

#include "old_run.h"
#include "small_run.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::HasSubstr;

TEST(ReplacedRun, GoesOnceTheNewOneIsSavedAndNothingElseDoes) {
  testing::ScratchFolder scratch("replaced");
  const std::string run = OldRun(scratch.path());
  const auto directory = Overwrite(scratch.path());
  ASSERT_NE(directory, nullptr);
  EXPECT_TRUE(directory->replaces());
  for (const char* file : kNewFiles) {
    EXPECT_FALSE(fs::exists(run + file)) << "the new run begins in a place of its own: " << file;
    Put(run + file, "new");
  }
  ASSERT_TRUE(directory->RemoveReplaced().ok());
  EXPECT_FALSE(directory->replaces());
  std::vector<std::string> left;
  for (const auto& [path, text] : Contents(run)) left.push_back(path.substr(run.size()));
  EXPECT_THAT(left, ::testing::UnorderedElementsAre(
                        "config.yaml", "model.consac", "checkpoints/step_000000000000.consac",
                        "tensorboard/PPO2_1/events.out.tfevents.9.host.9", "notes.txt", "best.consac",
                        "checkpoints/mine.txt", "tensorboard/mine.txt", "tensorboard/PPO2_2/mine.txt", "best/mine.txt",
                        "checkpoints/best.consac", "favourite.consac", "my.curve.png"));
  EXPECT_FALSE(fs::exists(run + ".replaced.going"));
}

TEST(ReplacedRun, IsPutBackWhereTheNewOneIsNotSaved) {
  testing::ScratchFolder scratch("put_back");
  const std::string run = OldRun(scratch.path());
  const auto before = Contents(run);
  for (int i = 0; i < 2; ++i) {
    const auto directory = Overwrite(scratch.path());
    ASSERT_NE(directory, nullptr);
    for (const char* file : kNewFiles) Put(run + file, "new");
  }
  EXPECT_EQ(Differences(before, Contents(run)), "");
  EXPECT_FALSE(IsReplacingUnfinished(run));
}

// Killed on the way there, while the new run was made, on the way back, and while the old one went.
TEST(ReplacedRun, WhatAKilledProcessHasLeftIsFinishedAtTheNextStart) {
  testing::ScratchFolder scratch("killed_aside");
  for (const ExistingRun existing : {ExistingRun::kRefuse, ExistingRun::kResume, ExistingRun::kOverwrite}) {
    std::string run = OldRun(scratch.path());
    const auto before = Contents(run);
    const auto expect_old = [&](const char* when) {
      const auto left = Contents(run);
      (void)CheckRunName(scratch.path(), "run", existing);
      EXPECT_EQ(Differences(left, Contents(run)), "") << when << ": who only looks moves nothing";
      EXPECT_TRUE(FinishOverwriting(scratch.path(), "run").ok()) << when;
      const Status status = CheckRunName(scratch.path(), "run", existing);
      EXPECT_EQ(status.ok(), existing != ExistingRun::kRefuse) << status.message();
      EXPECT_EQ(Differences(before, Contents(run)), "") << when;
      EXPECT_FALSE(IsReplacingUnfinished(run)) << when;
    };
    ASSERT_TRUE(SetRunAside(scratch.path() + "/run").ok());
    expect_old("before the new run");
    ASSERT_TRUE(SetRunAside(scratch.path() + "/run").ok());
    for (const char* file : kNewFiles) Put(run + file, "new");
    expect_old("with files of the new run");
    ASSERT_TRUE(SetRunAside(scratch.path() + "/run").ok());
    fs::rename(run + ".replaced", run + ".replaced.moving");
    fs::rename(run + ".replaced.moving/config.yaml", run + "config.yaml");
    fs::rename(run + "checkpoints/.replaced/step_000000000100.consac", run + "checkpoints/step_000000000100.consac");
    expect_old("on the way");
    ASSERT_TRUE(SetRunAside(scratch.path() + "/run").ok());
    for (const char* file : kNewFiles) Put(run + file, "new");
    fs::rename(run + ".replaced", run + ".replaced.going");
    fs::remove(run + ".replaced.going/monitor.csv");
    EXPECT_TRUE(FinishOverwriting(scratch.path(), "run").ok());
    EXPECT_FALSE(fs::exists(run + "monitor.csv")) << "the new run is whole, the old one is not";
    EXPECT_EQ(Contents(run).at(run + "model.consac"), "new");
    EXPECT_FALSE(IsReplacingUnfinished(run));
    EXPECT_FALSE(fs::exists(run + "checkpoints/.replaced"));
  }
}

TEST(ReplacedRun, WhatCannotBeSetAsideLosesNothing) {
  testing::ScratchFolder scratch("not_aside");
  for (const char* name : {"config.yaml", "progress.csv", "monitor.csv", "evaluations.csv", "curve.svg", "model.consac",
                           "checkpoints/step_000000000100.consac", "best/model.consac"}) {
    const std::string run = OldRun(scratch.path());
    fs::remove(run + name);
    fs::create_directory(run + name);
    const auto before = Contents(run);
    const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kOverwrite);
    ASSERT_FALSE(directory.ok()) << name;
    EXPECT_EQ(directory.status().code(), StatusCode::kDataLoss) << name;
    EXPECT_THAT(directory.status().message(), HasSubstr(run + name));
    EXPECT_THAT(directory.status().message(), HasSubstr("nothing of the old run was removed"));
    EXPECT_EQ(Differences(before, Contents(run)), "") << name;
  }
}

#if !defined(_WIN32)
/// What `body` returns in a process of its own.
int InChild(const std::function<int()>& body) {
  const pid_t child = fork();
  if (child == 0) _exit(body());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 255;
}

TEST(ReplacedRun, AFolderThatTakesNoNewFilesLosesNothing) {
  testing::ScratchFolder scratch("closed_folder");
  const std::string run = OldRun(scratch.path());
  for (const std::string& closed : {run, run + "checkpoints", run + "tensorboard", run + "best"}) {
    const auto before = Contents(run);
    const int code = InChild([&] {
      for (const auto& entry : fs::recursive_directory_iterator(scratch.path()))
        fs::permissions(entry.path(), fs::perms::all);
      fs::permissions(scratch.path(), fs::perms::all);
      fs::permissions(closed, fs::perms(0555));
      if (getuid() == 0 && setuid(65534) != 0) return 100;  // nothing is closed to root
      const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kOverwrite);
      const bool said = directory.status().message().find("Permission denied") != std::string::npos;
      return said ? static_cast<int>(directory.status().code()) : 101;
    });
    EXPECT_EQ(code, static_cast<int>(StatusCode::kDataLoss)) << closed;
    fs::permissions(closed, fs::perms::all);
    EXPECT_EQ(Differences(before, Contents(run)), "") << closed;
  }
}

/// Something that keeps a new run from beginning or from being saved.
struct Obstacle {
  const char* name;
  std::function<void(const std::string& run)> make;
};

// The whole way: whatever keeps the new run from being begun and saved, the old one is there and can be gone on with.
TEST(ReplacedRun, ANewRunThatCannotBeginOrBeSavedTakesNothingAway) {
  testing::ScratchFolder scratch("obstacles");
  RunConfig config = SmallRun(scratch.path(), "run");
  config.steps = 256;
  config.tensorboard = true;
  config.eval_every = 128;
  config.eval_episodes = 1;
  const Result<RunSummary> first = Train(config, kNeverStop);
  ASSERT_TRUE(first.ok()) << first.status().message();
  const std::string run = scratch.path() + "/run/", kept = scratch.path() + "/kept";
  fs::copy(run, kept, fs::copy_options::recursive);
  config.force = true;
  config.seed = 99;

  const auto anew = [&](const char* name, auto&& make) {
    return Obstacle{name, [name, make](const std::string& folder) {
                      fs::remove_all(folder + name);
                      make(folder + name);
                    }};
  };
  const auto to_nothing = [](const std::string& path) { fs::create_symlink("/nonexistent/place", path); };
  const auto to_itself = [](const std::string& path) { fs::create_symlink(path, path); };
  const auto to_folder = [](const std::string& path) { fs::create_directory_symlink("/tmp", path); };
  const auto a_file = [](const std::string& path) { Put(path, "no folder"); };
  const auto a_pipe = [](const std::string& path) { ASSERT_EQ(mkfifo(path.c_str(), 0600), 0); };
  const auto limit = [](int resource, rlim_t value) {
    return [resource, value](const std::string&) {
      std::signal(SIGXFSZ, SIG_IGN);
      if (resource == RLIMIT_NOFILE) {
        for (int descriptor = 3; descriptor < 100; ++descriptor) close(descriptor);
      }
      rlimit both{};
      getrlimit(static_cast<decltype(RLIMIT_NOFILE)>(resource), &both);
      both.rlim_cur = value;
      setrlimit(static_cast<decltype(RLIMIT_NOFILE)>(resource), &both);
    };
  };
  for (const Obstacle& obstacle :
       {anew("tensorboard", to_nothing), anew("tensorboard", to_itself), anew("tensorboard", a_file),
        anew("best", to_nothing), anew("best", to_itself), anew("best", to_folder), anew("best", a_file),
        anew("best/model.consac", a_pipe), anew("monitor.csv", a_pipe), Obstacle{"no room", limit(RLIMIT_FSIZE, 1024)},
        Obstacle{"little room", limit(RLIMIT_FSIZE, 6000)}, Obstacle{"4 descriptors", limit(RLIMIT_NOFILE, 4)},
        Obstacle{"6 descriptors", limit(RLIMIT_NOFILE, 6)}}) {
    fs::remove_all(run);
    fs::copy(kept, run, fs::copy_options::recursive);
    std::map<std::string, std::string> before = Contents(run);
    const std::string told = scratch.path() + "/told";
    const int code = InChild([&] {
      obstacle.make(run);
      const Result<RunSummary> summary = Train(config, kNeverStop);
      for (const auto resource : {RLIMIT_FSIZE, RLIMIT_NOFILE}) {
        rlimit room{};
        getrlimit(resource, &room);
        room.rlim_cur = room.rlim_max;
        (void)setrlimit(resource, &room);
      }
      std::ofstream(told) << summary.status().message();
      return summary.ok() ? 0 : 1;
    });
    EXPECT_EQ(code, 1) << obstacle.name;
    EXPECT_THAT(testing::TextOf(told),
                AnyOf(HasSubstr("nothing of the old run was removed"), HasSubstr("is as it was")))
        << obstacle.name;
    std::map<std::string, std::string> after = Contents(run);
    for (auto* files : {&before, &after})
      std::erase_if(*files, [&](const auto& entry) { return entry.first.starts_with(run + obstacle.name); });
    EXPECT_EQ(Differences(before, after), "") << obstacle.name;
    EXPECT_FALSE(IsReplacingUnfinished(run)) << obstacle.name;
  }
}

// As it is when a process is killed while it gives the run its old model under a name to be renamed.
TEST(ReplacedRun, ASecondNameOfItsModelIsNotLeft) {
  testing::ScratchFolder scratch("second_name");
  RunConfig config = SmallRun(scratch.path(), "run");
  config.steps = 256;
  const Result<RunSummary> old = Train(config, kNeverStop);
  ASSERT_TRUE(old.ok());
  const std::string run = scratch.path() + "/run";
  const auto kill_it = [&]() -> int {
    const auto directory = Overwrite(scratch.path());
    std::error_code error;
    fs::create_hard_link(run + kRunAside + "/model.consac", run + "/model.consac.tmp-4711", error);
    _exit(directory == nullptr || error ? 1 : 0);  // nothing is put back
  };
  for (int i = 0; i < 2; ++i) {  // the second time --force goes on from it
    ASSERT_EQ(InChild(kill_it), 0);
    ASSERT_TRUE(IsReplacingUnfinished(run));
  }
  config.resume = true;
  const Result<RunSummary> resumed = Train(config, kNeverStop);
  ASSERT_TRUE(resumed.ok()) << resumed.status().message();
  EXPECT_EQ(resumed->weights_hash, old->weights_hash);
  EXPECT_FALSE(fs::exists(run + "/model.consac.tmp-4711"));
}

TEST(ReplacedRun, KilledAtAnyMomentTheOldRunOrTheNewOneIsWhole) {
  testing::ScratchFolder scratch("killed_force");
  RunConfig config = SmallRun(scratch.path(), "run");
  config.steps = 256;
  config.seed = 99;
  const Result<RunSummary> old = Train(config, kNeverStop);
  ASSERT_TRUE(old.ok());
  const std::string run = scratch.path() + "/run", kept = scratch.path() + "/kept";
  fs::copy(run, kept, fs::copy_options::recursive);
  config.seed = 3;
  config.force = true;
  const auto began = std::chrono::steady_clock::now();
  const Result<RunSummary> anew = Train(config, kNeverStop);
  const auto length =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - began).count();
  ASSERT_TRUE(anew.ok());
  std::mt19937 random(7);
  std::int64_t longest = 2 * length;
  int olds = 0, news = 0;
  for (int i = 0; i < 300 && (i < 40 || olds == 0 || news == 0); ++i) {
    fs::remove_all(run);
    fs::copy(kept, run, fs::copy_options::recursive);
    const pid_t child = fork();
    if (child == 0) _exit(Train(config, kNeverStop).ok() ? 0 : 1);
    const std::int64_t life = std::uniform_int_distribution<std::int64_t>(0, longest)(random);
    std::this_thread::sleep_for(std::chrono::microseconds(life));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    RunConfig bare;
    bare.directory = scratch.path();
    bare.name = "run";
    bare.resume = bare.quiet = true;
    const Result<RunSummary> resumed = Train(bare, kNeverStop);
    ASSERT_TRUE(resumed.ok()) << resumed.status().message();
    EXPECT_THAT(resumed->weights_hash, AnyOf(old->weights_hash, anew->weights_hash)) << i;
    const bool is_new = resumed->weights_hash == anew->weights_hash;
    (is_new ? news : olds) += 1;
    // A machine that others load is slower or faster than it was: half of the moments stay before the new run is saved.
    longest = std::max<std::int64_t>(is_new ? longest * 4 / 5 : longest * 5 / 4, 1000);
  }
  EXPECT_GT(olds, 0);
  EXPECT_GT(news, 0);
}
#endif

}  // namespace
}  // namespace consac::run
