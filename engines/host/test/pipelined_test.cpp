// Models that compute while the engine goes on: what is seen at one Poll is decided on at the next.
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <thread>

#include "consac/host/driver.h"
#include "engines/host/test/ticked_engine.h"
#include "tests/remembering.h"

namespace consac::host {
namespace {

using consac::testing::OnesEnv;
using consac::testing::RememberingPolicy;
using consac::testing::TickedEngine;

std::vector<std::byte> Remembering() {
  return Policy::Create(RememberingPolicy(), 1)->ToFile(1).Serialise();
}

std::unique_ptr<Driver> ActOn(TickWorld& world, const std::vector<std::byte>& model, bool pipelined) {
  ActOptions options;
  options.mode = ActionMode::kSample;  // draws too are the same
  options.seed = 5;
  options.pipelined = pipelined;
  return *Act(world, std::span(&model, 1), options);
}

// Three agents whose episodes end at different steps, by a model that remembers and draws.
TEST(Pipelined, ModelsDoBitForBitWhatTheyDoAtOnceOnePollLater) {
  const std::vector<std::byte> model = Remembering();
  std::vector<std::vector<float>> actions[2];
  for (const bool pipelined : {false, true}) {
    TickedEngine engine(std::make_unique<OnesEnv>(3), 1);
    const std::unique_ptr<Driver> driver = ActOn(engine.world(), model, pipelined);
    ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    ASSERT_EQ(engine.world().cue(), Cue::kReset);
    for (int decision = 0; decision < 40; ++decision) {
      ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
      if (pipelined) {
        ASSERT_EQ(engine.world().cue(), Cue::kWait) << "what was seen is handed over only";
        ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
      }
      ASSERT_EQ(engine.world().cue(), Cue::kAct);
      std::vector<float>& row = actions[pipelined ? 1 : 0].emplace_back(3);
      for (AgentId a = 0; a < 3; ++a) std::memcpy(&row[static_cast<std::size_t>(a)], engine.world().Action(a), 4);
    }
  }
  EXPECT_EQ(actions[0], actions[1]);
}

std::atomic<std::thread::id> thinks_on;

/// As what it remembers does, and writes down which thread asked.
void AddWatchedBlock() {
  testing::AddSumBlock();
  if (nn::FindOp("test_watched") != nullptr) return;
  static nn::Op watched = *nn::FindOp("test_sum");
  watched.name = "test_watched";
  watched.forward = [](const nn::PlacedBlock& block, const nn::BlockCall& call) {
    thinks_on = std::this_thread::get_id();
    nn::FindOp("test_sum")->forward(block, call);
  };
  nn::AddOp(watched);
}

TEST(Pipelined, TheEnginesThreadDoesNotCompute) {
  AddWatchedBlock();
  PolicyData data = RememberingPolicy();
  data.network.blocks[0].op = "test_watched";
  const std::vector<std::byte> model = Policy::Create(std::move(data), 1)->ToFile(1).Serialise();
  for (const bool pipelined : {false, true}) {
    TickedEngine engine(std::make_unique<OnesEnv>(2), 1);
    const std::unique_ptr<Driver> driver = ActOn(engine.world(), model, pipelined);
    for (int tick = 0; tick < 10; ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    EXPECT_EQ(thinks_on.load() != std::this_thread::get_id(), pipelined);
    EXPECT_GT(driver->progress().steps, 0);
  }
}

// Agents may leave and come while the models compute; a driver may go then.
TEST(Pipelined, AgentsComeAndGoMeanwhileAndSoMayTheDriver) {
  const std::vector<std::byte> model = Remembering();
  TickedEngine engine(std::make_unique<OnesEnv>(3), 1, true);
  TickWorld& world = engine.world();
  {
    const std::unique_ptr<Driver> driver = ActOn(world, model, true);
    for (int tick = 0; tick < 2; ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    ASSERT_EQ(world.cue(), Cue::kWait);
    world.Leave(1);
    ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    ASSERT_EQ(world.cue(), Cue::kAct);
    EXPECT_FALSE(world.Joined(1));
    for (int tick = 0; tick < 3; ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    EXPECT_EQ(*world.Join(0), 1);
    for (int tick = 0; tick < 22; ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    EXPECT_TRUE(world.Joined(1));
    ASSERT_EQ(world.cue(), Cue::kWait) << "the driver goes while it computes";
  }
  EXPECT_TRUE(world.settled());
  const std::unique_ptr<Driver> next = ActOn(world, model, true);
  for (int tick = 0; tick < 3; ++tick) ASSERT_TRUE(engine.Tick(*next, 0.0).ok());
  EXPECT_EQ(world.cue(), Cue::kAct);
}

}  // namespace
}  // namespace consac::host
