// --force: what is in the places of a run that is set aside, but is none; and who finds a model meanwhile.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#if defined(__linux__)
#include <fcntl.h>
#include <linux/fs.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

#include <functional>

#include "consac/run/actors.h"
#include "old_run.h"
#include "replaced_run.h"
#include "scripted_engine.h"
#include "session.h"
#include "small_run.h"
#include "worlds/registry.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Something that a run's folder holds under a name of ours.
struct Thing {
  const char* name;
  std::function<void(const std::string& path)> make;
};

std::vector<Thing> ThingsThatAreNoRun([[maybe_unused]] const std::string& elsewhere) {
  return {
    {"an empty folder", [](const std::string& path) { fs::create_directory(path); }},
        {"a file", [](const std::string& path) { Put(path, "mine"); }},
        {"a folder of notes", [](const std::string& path) { Put(path + "/notes.txt", "mine"); }},
        {"a copy of some files",
         [](const std::string& path) {
           Put(path + "/config.yaml", "mine");
           Put(path + "/model.consac", "mine");
         }},
#if !defined(_WIN32)  // there links are a privilege
        {"a link to nothing", [](const std::string& path) { fs::create_symlink("/nonexistent/place", path); }},
        {"a link to itself", [](const std::string& path) { fs::create_symlink(path, path); }},
        {"a link to a run", [=](const std::string& path) { fs::create_directory_symlink(elsewhere, path); }},
#endif
    {
      "a folder as configuration", [](const std::string& path) { fs::create_directories(path + "/config.yaml"); }
    }
  };
}

TEST(ReplacedRun, WhatIsNoRunThatWasSetAsideIsNotPutInARunsPlace) {
  testing::ScratchFolder scratch("no_run_aside");
  const std::string elsewhere = OldRun(scratch.path() + "/elsewhere"), run = scratch.path() + "/run/";
  for (const Thing& thing : ThingsThatAreNoRun(elsewhere.substr(0, elsewhere.size() - 1))) {
    for (const ExistingRun existing : {ExistingRun::kRefuse, ExistingRun::kResume, ExistingRun::kOverwrite}) {
      OldRun(scratch.path());
      thing.make(run + ".replaced");
      const auto before = Contents(scratch.path());
      EXPECT_TRUE(FinishOverwriting(scratch.path(), "run").ok()) << thing.name;
      const Status status = CheckRunName(scratch.path(), "run", existing);
      EXPECT_EQ(status.ok(), existing != ExistingRun::kRefuse) << thing.name << ": " << status.message();
      EXPECT_EQ(Differences(before, Contents(scratch.path())), "") << thing.name;
      (void)RunDirectory::Open(scratch.path(), "run", existing);
      EXPECT_EQ(Differences(before, Contents(scratch.path())), "") << thing.name << ", opened";
    }
  }
}

#if !defined(_WIN32)
// Nothing goes where a link leads, and nothing is replaced on the way back.
TEST(ReplacedRun, WhatIsInTheWayIsNamedAndNothingMoves) {
  testing::ScratchFolder scratch("in_the_way");
  const std::string elsewhere = OldRun(scratch.path() + "/elsewhere"), run = scratch.path() + "/run/";
  for (const char* place : {".replaced", ".replaced.moving", ".replaced.going", "checkpoints/.replaced",
                            "tensorboard/.replaced", "best/.replaced"}) {
    OldRun(scratch.path());
    fs::create_directory_symlink(elsewhere.substr(0, elsewhere.size() - 1), run + place);
    const auto before = Contents(scratch.path());
    const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kOverwrite);
    ASSERT_FALSE(directory.ok()) << place;
    EXPECT_THAT(directory.status().message(), HasSubstr(run + place + "' is in the way; take it away; nothing of"));
    EXPECT_EQ(Differences(before, Contents(scratch.path())), "") << place;
  }
  OldRun(scratch.path());
  fs::remove_all(run + "best");
  fs::create_directory_symlink(elsewhere + "best", run + "best");
  Put(elsewhere + "best/.replaced/model.consac", "another run's");
  Put(run + ".replaced.going/monitor.csv", "gone");
  EXPECT_TRUE(FinishOverwriting(scratch.path(), "run").ok());
  EXPECT_TRUE(fs::exists(elsewhere + "best/.replaced/model.consac")) << "behind a link";
  for (const char* name : {".replaced.moving/model.consac", "checkpoints/.replaced/step_000000000100.consac"}) {
    OldRun(scratch.path());
    Put(run + ".replaced.moving/notes.txt", "mine");
    Put(run + name, "mine too");
    const std::string kept = Contents(run).at(run + "config.yaml");
    const Status status = FinishOverwriting(scratch.path(), "run");
    EXPECT_THAT(status.message(), HasSubstr("is in the way; take it away"));
    EXPECT_EQ(Contents(run).at(run + "model.consac"), "a run's");
    EXPECT_EQ(Contents(run).at(run + "checkpoints/step_000000000100.consac"), "a run's");
    EXPECT_EQ(Contents(run).at(run + name), "mine too");
  }
}
#endif

TEST(ReplacedRun, ARunWhoseOverwritingWasKilledHasItsModels) {
  testing::ScratchFolder scratch("killed_models");
  const std::string run = OldRun(scratch.path());
  fs::remove(run + "best.consac");
  fs::remove(run + "favourite.consac");
  ASSERT_TRUE(SetRunAside(scratch.path() + "/run").ok());
  const Result<std::vector<std::string>> aside = FindModels("run", scratch.path());
  ASSERT_TRUE(aside.ok()) << aside.status().message();
  EXPECT_THAT(*aside, ElementsAre(run + ".replaced/model.consac", run + ".replaced/walker.consac"));
  for (const char* file : kNewFiles) Put(run + file, "new");
  EXPECT_EQ(FindModels("run", scratch.path())->size(), 2u) << "the old run's, which is what there is";
  fs::remove(run + "model.consac");
  fs::rename(run + ".replaced", run + ".replaced.moving");
  fs::rename(run + ".replaced.moving/walker.consac", run + "walker.consac");
  EXPECT_THAT(*FindModels("run", scratch.path()),
              ElementsAre(run + "walker.consac", run + ".replaced.moving/model.consac"));
}

/// The road, which looks at a file in every step.
class WatchingRoad final : public VectorEnv {
 public:
  WatchingRoad(std::string file, std::vector<std::string>* seen)
      : road_((*worlds::FindWorld("road-v0"))->create(2)), file_(std::move(file)), seen_(*seen) {}
  const EnvSpec& spec() const override { return road_->spec(); }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override { road_->Reset(seed, batches); }
  void Step(std::span<Batch> batches) override {
    std::string text = testing::TextOf(file_);
    if (seen_.empty() || seen_.back() != text) seen_.push_back(std::move(text));
    road_->Step(batches);
  }
  void Visit(Archive& archive) override { archive("road", *road_); }

 private:
  std::unique_ptr<VectorEnv> road_;
  std::string file_;
  std::vector<std::string>& seen_;
};

// An engine that loads it while the new run begins gets one that has learned something.
TEST(ReplacedRun, TheOldModelActsUntilTheNewOneHasLearned) {
  testing::ScratchFolder scratch("old_model_acts");
  RunConfig config = SmallRun(scratch.path(), "run");
  config.steps = 256;
  ASSERT_TRUE(Train(config, kNeverStop).ok());
  const std::string file = scratch.path() + "/run/model.consac", old = Contents(scratch.path()).at(file);
  config.force = true;
  config.seed = 99;
  config.checkpoint_every_updates = 2;
  std::vector<std::string> seen;
  const Result<RunSummary> anew = RunSession(
      config, Length::kOfCaller, Only(MakeLocalLink(std::make_unique<WatchingRoad>(file, &seen))), kNeverStop);
  ASSERT_TRUE(anew.ok()) << anew.status().message();
  ASSERT_GE(seen.size(), 2u);
  EXPECT_EQ(seen[0], old);
  EXPECT_NE(seen[1], old) << "after the first checkpoint";
  EXPECT_FALSE(IsReplacingUnfinished(scratch.path() + "/run"));
}

/// The road, which answers the first step with what cannot be learned from.
class FirstStepFails final : public VectorEnv {
 public:
  const EnvSpec& spec() const override { return road_->spec(); }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override { road_->Reset(seed, batches); }
  void Step(std::span<Batch> batches) override {
    road_->Step(batches);
    batches[0].rewards[0] = std::numeric_limits<float>::quiet_NaN();
  }
  void Visit(Archive& archive) override { archive("road", *road_); }

 private:
  std::unique_ptr<VectorEnv> road_ = (*worlds::FindWorld("road-v0"))->create(2);
};

// The commonest fault of a new engine takes no good model away.
TEST(ReplacedRun, IsPutBackWhereTheFirstStepFails) {
  testing::ScratchFolder scratch("first_step_fails");
  RunConfig config = SmallRun(scratch.path(), "run");
  config.steps = 256;
  ASSERT_TRUE(Train(config, kNeverStop).ok());
  const std::map<std::string, std::string> before = Contents(scratch.path());
  config.force = true;
  const Result<RunSummary> anew =
      RunSession(config, Length::kOfCaller, Only(MakeLocalLink(std::make_unique<FirstStepFails>())), kNeverStop);
  ASSERT_FALSE(anew.ok());
  EXPECT_THAT(anew.status().message(), HasSubstr("the run that was to be overwritten is as it was"));
  EXPECT_EQ(Contents(scratch.path()), before);
}

// Nor does a Ctrl-C while the engine is thinking about it.
TEST(ReplacedRun, IsPutBackWhereAStopComesBeforeTheFirstStep) {
  testing::ScratchFolder scratch("stopped_before_a_step");
  RunConfig config = SmallRun(scratch.path(), "engine");
  config.steps = 256;
  ASSERT_TRUE(Train(config, kNeverStop).ok());
  const std::map<std::string, std::string> before = Contents(scratch.path());
  const ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#1000", "10,30#0#0"}, ScriptedEngine::End::kStaySilent);
  config = EngineRun(scratch.path(), engine);
  config.force = true;
  std::atomic<bool> stop{false};
  std::thread hand([&] {
    const std::string begun = scratch.path() + "/engine/checkpoints/step_000000000000.consac";
    for (const double end = Now() + 30.0; Now() < end && !fs::exists(begun);)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    stop = true;
  });
  const Result<RunSummary> anew = Train(config, stop);
  hand.join();
  ASSERT_TRUE(anew.ok()) << anew.status().message();
  EXPECT_TRUE(anew->interrupted);
  EXPECT_EQ(Differences(before, Contents(scratch.path())), "");
}

#if defined(__linux__)
/// Sets or takes the attribute; false where this user or file system cannot.
bool AppendOnly(const std::string& folder, bool on) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY);
  int flags = 0;
  bool done = ioctl(descriptor, FS_IOC_GETFLAGS, &flags) == 0;
  flags = on ? flags | FS_APPEND_FL : flags & ~FS_APPEND_FL;
  done = done && ioctl(descriptor, FS_IOC_SETFLAGS, &flags) == 0;
  close(descriptor);
  return done;
}

// A folder made there could not be removed again.
TEST(ReplacedRun, InAnAppendOnlyFolderNothingIsBegun) {
  testing::ScratchFolder scratch("append_only");
  const std::string run = OldRun(scratch.path());
  Put(run + ".lock", "");
  for (const std::string& folder : {run.substr(0, run.size() - 1), run + "checkpoints", run + "tensorboard/PPO2_1"}) {
    if (!AppendOnly(folder, true)) GTEST_SKIP() << "this user, or this file system, makes nothing append-only";
    const auto directory = RunDirectory::Open(scratch.path(), "run", ExistingRun::kOverwrite);
    ASSERT_TRUE(AppendOnly(folder, false));
    ASSERT_FALSE(directory.ok()) << folder;
    EXPECT_THAT(directory.status().message(), HasSubstr("'" + folder + "' is append-only"));
    for (const char* place : {".replaced.moving", ".replaced", "checkpoints/.replaced", "tensorboard/.replaced"})
      EXPECT_FALSE(fs::exists(run + place)) << place << " in " << folder;
  }
}

// Or it would come back with the next run that is put back.
TEST(ReplacedRun, WhatCannotBeRemovedIsRemovedLater) {
  testing::ScratchFolder scratch("removed_later");
  const std::string run = OldRun(scratch.path()), stale = run + "checkpoints/.replaced";
  ASSERT_TRUE(SetRunAside(scratch.path() + "/run").ok());
  for (const char* file : kNewFiles) Put(run + file, "new");
  const bool kept = AppendOnly(stale, true);
  EXPECT_TRUE(RemoveRunAside(scratch.path() + "/run").ok()) << "the new run is saved";
  EXPECT_EQ(fs::exists(stale), kept);
  EXPECT_EQ(IsReplacingUnfinished(scratch.path() + "/run"), kept);
  if (kept) {
    ASSERT_TRUE(AppendOnly(stale, false));
  }
  EXPECT_TRUE(FinishOverwriting(scratch.path(), "run").ok());
  EXPECT_FALSE(fs::exists(stale));
  EXPECT_FALSE(IsReplacingUnfinished(scratch.path() + "/run"));
  if (!kept) GTEST_SKIP() << "this user, or this file system, makes nothing append-only";
}
#endif

}  // namespace
}  // namespace consac::run
