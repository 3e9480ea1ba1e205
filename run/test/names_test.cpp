// What an engine calls its behaviours, its model and its world never leads out of the run's folder, nor says a word of
// its own on the terminal.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "consac/base/path.h"
#include "report/console.h"
#include "run/test/report/files.h"
#include "session.h"
#include "small_run.h"
#include "tests/two_worlds.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;

/// A world in this process that asks for what an engine asks for.
class AskingLink final : public WorldLink {
 public:
  AskingLink(SessionRequest request, std::string id)
      : request_(std::move(request)), world_(*MakeLocalLink("road-v0", 1)) {
    spec_ = world_->spec();
    spec_.id = std::move(id);
  }
  const EnvSpec& spec() const override { return spec_; }
  Status Reset(std::uint64_t seed, std::span<Batch> batches) override { return world_->Reset(seed, batches); }
  Status Step(std::span<Batch> batches, MoreSteps more) override { return world_->Step(batches, more); }
  std::span<const std::uint8_t> present(std::size_t b) const override { return world_->present(b); }
  double world_share() const override { return 0.0; }
  void Visit(Archive& archive) override { world_->Visit(archive); }
  SessionRequest request() const override { return request_; }
  std::string description() const override { return "an engine"; }

 private:
  SessionRequest request_;
  std::unique_ptr<WorldLink> world_;
  EnvSpec spec_;
};

Result<RunSummary> RunWith(const std::string& directory, SessionRequest request, const std::string& id) {
  RunConfig config = SmallRun(directory, "");
  config.world = "tcp://127.0.0.1:1";
  config.steps = -1;
  return RunSession(config, Length::kOfEngine, Only(std::make_unique<AskingLink>(std::move(request), id)), kNeverStop);
}

TEST(RunNames, AWorldsLongNameIsCut) {
  testing::ScratchFolder scratch("long");
  const Result<RunSummary> summary = RunWith(scratch.path(), {10, ""}, std::string(137, 'w'));
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  const std::string folder = ToPath(summary->directory).filename().string();
  EXPECT_EQ(folder.find("www"), 0u) << folder;
  EXPECT_NE(folder.find("__ppo2__"), std::string::npos) << folder;
  EXPECT_LE(folder.size(), 128u - 8u) << "room for a number";
}

TEST(RunNames, BehavioursNamedLikePathsStayInTheRunsFolder) {
  testing::ScratchFolder scratch("names");
  const std::string above = scratch.path() + "/above.consac";
  std::ofstream(above) << "somebody's";
  RunConfig config = SmallRun(scratch.path() + "/runs", "two");
  config.world = "two-v0";
  config.steps = 200;
  auto world = std::make_unique<testing::TwoWorlds>(testing::Half{"../../above", "road-v0"},
                                                    testing::Half{"config.yaml", "road-v0"});
  const auto summary = RunSession(config, Length::kOfCaller, Only(MakeLocalLink(std::move(world))), kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(TextOf(above), "somebody's");
  const std::string run = scratch.path() + "/runs/two/";
  EXPECT_TRUE(fs::exists(ToPath(run + "%2E.%2F..%2Fabove.consac")));
  EXPECT_TRUE(fs::exists(ToPath(run + "config.yaml.consac")));
  EXPECT_NE(TextOf(run + "config.yaml").find("world:"), std::string::npos) << "not a model";
  EXPECT_EQ(std::distance(fs::directory_iterator(ToPath(scratch.path() + "/runs")), {}), 1);
}

TEST(RunNames, AnEnginesModelIsARunNotAPath) {
  testing::ScratchFolder scratch("engine");
  for (const char* name : {"../secret", "/etc/passwd", "a/b", "..", "con"}) {
    for (const std::int64_t length : {std::int64_t{0}, std::int64_t{64}}) {
      const Status status = RunWith(scratch.path() + "/runs", {length, name}, "road-v0").status();
      EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << name << " " << length << ": " << status.message();
      EXPECT_FALSE(fs::exists(ToPath(scratch.path() + "/runs"))) << name;
    }
  }
}

TEST(RunNames, AWorldsNameBecomesAFoldersWhereNoneIsGiven) {
  testing::ScratchFolder scratch("world");
  const Result<RunSummary> summary = RunWith(scratch.path(), {64, ""}, "../My W\xc3\xa4lt");
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(fs::path(ToPath(summary->directory)).filename(), "_.._My_W__lt__ppo2__3");
}

TEST(Console, NothingThatDoesNotShowReachesTheTerminal) {
  std::FILE* stream = std::tmpfile();
  ASSERT_NE(stream, nullptr);
  Console console({stream, false, false, 80});
  console.Line("a\x1b[2J\ntraining completed");
  console.Print("one\ntwo\x1b[1A\n");
  console.Alarm("x\r\ny");
  std::rewind(stream);
  char text[256] = {};
  const std::size_t count = std::fread(text, 1, sizeof(text), stream);
  std::fclose(stream);
  EXPECT_EQ(std::string(text, count), "a\\x1b[2J\\x0atraining completed\none\ntwo\\x1b[1A\nerror: x\\x0d\\x0ay\n");
}

}  // namespace
}  // namespace consac::run
