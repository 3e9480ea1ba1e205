// No thread to be had: what can be done without is done without, the rest is one line and an exit code. Never a hang.
#include "consac/base/thread.h"
#include "consac/host/driver.h"
#include "consac/run/thread_pool.h"
#include "engines/host/test/ticked_engine.h"
#include "tests/limits/limited.h"
#include "tests/protocol2_peers.h"

namespace consac::testing {
namespace {

const std::vector<Limit> kNoThread = {{RLIMIT_NPROC, 1}};

TEST(LimitOfThreads, AThreadThatCannotStartIsAStatus) {
  const int code = InChild([] {
    Thread before;
    bool ran = false;
    if (!before.Start([&] { ran = true; }).ok()) return 1;
    before.Join();
    Impose(kNoThread);
    Thread after;
    const Status status = after.Start([] {});
    after.Join();
    return ran && !after.started() && status.code() == StatusCode::kResourceExhausted ? 0 : 2;
  });
  EXPECT_EQ(code, 0);
}

TEST(LimitOfThreads, ThePoolGoesOnWithThoseThatThereAre) {
  const int code = InChild([] {
    Impose({{RLIMIT_NPROC, 3}});
    run::ThreadPool pool(8);
    std::vector<int> ran(100, 0);
    pool.executor().ForEach(100, [&](std::int64_t block) { ++ran[static_cast<std::size_t>(block)]; });
    return pool.threads() == 3 && ran == std::vector<int>(100, 1) ? 0 : 1;
  });
  EXPECT_EQ(code, 0);
}

TEST(LimitOfThreads, AnEngineThatCannotLearnAsideHearsWhy) {
  const int code = InChild([] {
    TickedEngine engine("road-v0", 1, 2);
    Impose(kNoThread);
    host::TrainOptions options;
    options.total_steps = 1000;
    const auto driver = host::Train(engine.world(), options);
    return !driver.ok() && driver.status().code() == StatusCode::kResourceExhausted ? 0 : 1;
  });
  EXPECT_EQ(code, 0);
}

TEST(LimitOfThreads, TheTrainingOnOneThreadIsTheSame) {
  ScratchFolder scratch("threads");
  const auto train = [&](const char* name, const std::vector<Limit>& limits) {
    Program program(scratch.path(),
                    {"train", "cartpole-v1", "--steps", "4096", "--threads", "4", "--name", name, "--json"},
                    {.limits = limits});
    const Outcome left = program.Wait();
    EXPECT_EQ(left.code, 0) << left.error;
    EXPECT_EQ(Count(left.error, "\n"), limits.empty() ? 0 : 1) << left.error;
    const std::size_t hash = left.out.find("weights_hash");
    return hash == std::string::npos ? "no hash of " + std::string(name) : left.out.substr(hash);
  };
  EXPECT_EQ(train("many", {}), train("one", kNoThread));
}

TEST(LimitOfThreads, AnEngineIsWaitedForHere) {
  ScratchFolder scratch("engines");
  EnvServerOptions options;
  options.training_length = 4096;
  Engine engine(options, "cartpole-v1", 1);
  Program program(scratch.path(),
                  {"train", "tcp://127.0.0.1:" + std::to_string(engine.port()), "--name", "here", "--no-table",
                   "--no-progress", "--set", "n_steps=512"},
                  {.limits = kNoThread});
  const Outcome left = program.Wait();
  EXPECT_EQ(left.code, 0) << left.error;
  EXPECT_EQ(Count(left.error, "cannot start a thread"), 1) << left.error;
  EXPECT_TRUE(std::filesystem::exists(scratch.path() + "/runs/here/model.consac"));
}

TEST(LimitOfThreads, WhatNeedsAThreadSaysSo) {
  ScratchFolder scratch("demo");
  const Outcome left = Program(scratch.path(), {"demo", "--steps", "300"}, {.limits = kNoThread}).Wait();
  EXPECT_EQ(left.code, 6) << left.error;
  EXPECT_EQ(Count(left.error, "\n"), 1) << left.error;
  EXPECT_EQ(Count(left.error, "cannot start a thread"), 1) << left.error;
}

}  // namespace
}  // namespace consac::testing
