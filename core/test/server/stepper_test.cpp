// Agents that come and go, in the three ways to begin the next episode; columns of infos.
#include "server/stepper.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "tests/swarm_world.h"

namespace consac {
namespace {

using protocol2::Autoreset;

/// Two agents that live 2 and 4 steps.
class StepperTest : public ::testing::Test {
 protected:
  void Begin(Autoreset autoreset, bool respawn = false, std::int32_t copies = 1) {
    world_ = std::make_unique<testing::Swarm>(copies, 2, respawn);
    stepper_ = std::make_unique<Stepper>(*world_);
    result_.resize(stepper_->result_room() / 8 + 1);
    stepper_->WriteTo(reinterpret_cast<std::byte*>(result_.data()));
    ASSERT_TRUE(stepper_->SetAutoreset(autoreset).ok());
    std::vector<std::byte> reset(stepper_->blocks().seeds);
    for (std::int32_t i = 0; i < copies; ++i)
      reset[protocol2::kActiveOffset + static_cast<std::size_t>(i)] = std::byte{1};
    ASSERT_TRUE(stepper_->Reset(reset, true, 0).ok());
    stepper_->FinishReset();
  }
  Status Step() {
    std::vector<std::byte> step(stepper_->blocks().step_bytes);
    for (std::size_t i = 0; i < stepper_->blocks().environments; ++i) step[protocol2::kActiveOffset + i] = std::byte{1};
    const Status read = stepper_->ReadStep(step);
    if (read.ok()) {
      stepper_->Step();
      stepper_->FinishStep();
    }
    return read;
  }
  /// State and age of each slot: "T16 a3".
  std::string Slot(std::size_t slot) const {
    const auto* payload = reinterpret_cast<const std::byte*>(result_.data());
    const protocol2::BehaviourBlocks& at = stepper_->blocks().behaviours[0];
    std::array<float, 2> row;
    std::memcpy(row.data(), payload + at.observations + slot * sizeof(row), sizeof(row));
    const auto state = std::to_integer<unsigned>(payload[at.states + slot]);
    std::string text;
    if ((state & protocol2::kTerminated) != 0) text += "ended ";
    if ((state & protocol2::kFinal) != 0) text += "final ";
    if ((state & protocol2::kFirst) != 0) text += "first ";
    text += (state & protocol2::kActive) != 0 ? "there " : "away ";
    return text + "at " + std::to_string(static_cast<int>(row[1]));
  }
  std::string Both() const { return Slot(0) + " | " + Slot(1); }
  std::string Infos() const {
    const auto* payload = reinterpret_cast<const std::byte*>(result_.data());
    std::uint32_t parts = 0, length = 0;
    std::memcpy(&parts, payload, sizeof(parts));
    if ((parts & protocol2::kPartInfos) == 0) return "";
    std::size_t at = stepper_->blocks().result_bytes;
    for (std::size_t slot = 0; slot < 2; ++slot) {
      if (Slot(slot).find("final") != std::string::npos) at += 8;
    }
    std::memcpy(&length, payload + at, sizeof(length));
    return {reinterpret_cast<const char*>(payload + at + sizeof(length)), length};
  }

  std::unique_ptr<testing::Swarm> world_;
  std::unique_ptr<Stepper> stepper_;
  std::vector<std::uint64_t> result_;
};

TEST_F(StepperTest, AnAgentThatHasEndedIsAwayUntilTheEpisodeOfItsWorldIsOver) {
  Begin(Autoreset::kSameStep);
  EXPECT_EQ(Both(), "first there at 0 | first there at 0");
  ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "there at 1 | there at 1");
  ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "ended final away at 2 | there at 2");
  EXPECT_EQ(stepper_->agents_stepped(), 2);
  ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "away at 2 | there at 3");
  EXPECT_EQ(stepper_->agents_stepped(), 1);
  ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "first there at 0 | ended final first there at 0");
}

TEST_F(StepperTest, NextStepShowsTheLastOfEveryAgentFirst) {
  Begin(Autoreset::kNextStep);
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "ended away at 2 | there at 2");
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "away at 2 | ended away at 4");
  ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "first there at 0 | first there at 0");
  EXPECT_EQ(stepper_->agents_stepped(), 0);
  ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "there at 1 | there at 1");
}

TEST_F(StepperTest, DisabledAsksForAResetOnlyOnceEveryAgentHasEnded) {
  Begin(Autoreset::kDisabled);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "away at 2 | ended away at 4");
  EXPECT_EQ(protocol2::FaultName(Step()), "RESET_REQUIRED");
  EXPECT_EQ(stepper_->TakeBlamed(), 0);
  std::vector<std::byte> reset(stepper_->blocks().seeds);
  reset[protocol2::kActiveOffset] = std::byte{1};
  ASSERT_TRUE(stepper_->Reset(reset, false, 0).ok());
  stepper_->FinishReset();
  EXPECT_EQ(Both(), "first there at 0 | first there at 0");
}

TEST_F(StepperTest, AnAgentMayComeBackByItself) {
  Begin(Autoreset::kSameStep, true);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "away at 2 | there at 3");
  ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Both(), "first there at 0 | ended final away at 4");
}

TEST_F(StepperTest, ActionsOfAgentsThatAreAwayAreNotLookedAt) {
  Begin(Autoreset::kSameStep);
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(Step().ok());
  std::vector<std::byte> step(stepper_->blocks().step_bytes);
  step[protocol2::kActiveOffset] = std::byte{1};
  const std::int32_t actions[2] = {99, 1};
  std::memcpy(step.data() + stepper_->blocks().behaviours[0].actions, actions, sizeof(actions));
  EXPECT_TRUE(stepper_->ReadStep(step).ok());
  const std::int32_t bad[2] = {0, 99};
  std::memcpy(step.data() + stepper_->blocks().behaviours[0].actions, bad, sizeof(bad));
  EXPECT_EQ(protocol2::FaultName(stepper_->ReadStep(step)), "OUT_OF_RANGE");
}

TEST_F(StepperTest, InfosThatDoNotFitAreLeftOut) {
  Begin(Autoreset::kSameStep);
  stepper_->LimitInfos(stepper_->blocks().largest_result);
  for (int step = 0; step < 4; ++step) {
    ASSERT_TRUE(Step().ok());
    EXPECT_EQ(Infos(), "");
    EXPECT_LE(stepper_->result_bytes(), stepper_->blocks().largest_result);
  }
}

TEST_F(StepperTest, InfosOfTheLastStepOfAnEpisodeAreFinal) {
  Begin(Autoreset::kSameStep);
  ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Infos(), R"({"final_infos":{},"infos":{"age":{"slots":[0,1],"values":[1.0,1.0]}}})");
  ASSERT_TRUE(Step().ok());
  EXPECT_EQ(Infos(),
            R"({"final_infos":{"age":{"slots":[0],"values":[2.0]}},"infos":{"age":{"slots":[1],"values":[2.0]}}})");
}

/// Worlds that begin together or not at all, and what seeds they were given.
class Together final : public VectorEnv {
 public:
  const EnvSpec& spec() const override { return swarm_.spec(); }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override {
    seeds.push_back(seed);
    swarm_.Reset(seed, batches);
  }
  void Step(std::span<Batch> batches) override { swarm_.Step(batches); }
  std::span<const std::uint8_t> present(std::size_t b) const override { return swarm_.present(b); }
  void Visit(Archive& archive) override { swarm_.Visit(archive); }

  std::vector<std::uint64_t> seeds;

 private:
  testing::Swarm swarm_{3, 2, false};
};

/// One insect, whose group is paid 1 in every step, whoever is there.
class PaidInsect final : public testing::Swarm {
 public:
  PaidInsect() : Swarm(1, 1, true), spec_(Swarm::spec()) { spec_.groups = {{"all", {{0, 0}}}}; }
  const EnvSpec& spec() const override { return spec_; }
  std::span<const float> group_rewards() const override { return paid_; }

 private:
  EnvSpec spec_;
  std::vector<float> paid_{1.0f};
};

// R107: what a group is paid while its world is empty would be in nobody's reward.
TEST(StepperGroups, AreNotPaidWhereNobodyTookPart) {
  PaidInsect world;
  Stepper stepper(world);
  stepper.Agree({.groups = true});
  std::vector<std::uint64_t> result(stepper.result_room() / 8 + 1);
  stepper.WriteTo(reinterpret_cast<std::byte*>(result.data()));
  std::vector<std::byte> all(stepper.blocks().seeds);
  all[protocol2::kActiveOffset] = std::byte{1};
  ASSERT_TRUE(stepper.Reset(all, true, 0).ok());
  stepper.FinishReset();
  all.resize(stepper.blocks().step_bytes);
  std::string paid;
  for (int i = 0; i < 6; ++i) {
    ASSERT_TRUE(stepper.ReadStep(all).ok());
    stepper.Step();
    stepper.FinishStep();
    std::uint32_t parts = 0;
    std::memcpy(&parts, result.data(), sizeof(parts));
    paid += (parts & protocol2::kPartGroups) != 0 ? "1" : "0";
  }
  EXPECT_EQ(paid, "110011") << "it ends with the second step, is away for two, and comes back";
}

TEST(StepperSeeds, ALaterResetWithoutSeedsTakesSeedsThatTheSessionHasNotGivenYet) {
  Together worlds;
  Stepper stepper(worlds);
  std::vector<std::uint64_t> result(stepper.result_room() / 8 + 1);
  stepper.WriteTo(reinterpret_cast<std::byte*>(result.data()));
  ASSERT_TRUE(stepper.SetAutoreset(Autoreset::kSameStep).ok());
  std::vector<std::byte> reset(stepper.blocks().seeds);
  for (std::size_t i = 0; i < stepper.blocks().environments; ++i) reset[protocol2::kActiveOffset + i] = std::byte{1};
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(stepper.Reset(reset, i == 0, 7).ok());
    stepper.FinishReset();
  }
  EXPECT_EQ(worlds.seeds, (std::vector<std::uint64_t>{7, 10, 13})) << "one of its own for each of the three worlds";
}

}  // namespace
}  // namespace consac
