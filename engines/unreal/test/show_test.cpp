// What people see of a training: agents on the screen, in the Visual Logger, numbers of the game's own in the log.
#include <algorithm>
#include <limits>

#include "Engine/Engine.h"
#include "VisualLogger/VisualLogger.h"
#include "graphs.h"

namespace consac::testing {
namespace {

class Shown : public ::testing::Test {
 protected:
  Shown() {
    GEngine->shim_screen_.clear();
    Shim::vlog.clear();
    Shim::ForgetLog();
    trainer_ = game_.SpawnWith<AConsacTrainer>([](AConsacTrainer& made) {
      made.Mode = EConsacMode::ByHand;
      made.LogSeconds = 0.0f;
    });
  }
  ~Shown() override { Shim::vlog_records = false; }

  Shim::Game game_;
  AConsacTrainer* trainer_ = nullptr;
};

TEST_F(Shown, WhatEachAgentSeesDoesAndEarnsIsOnTheScreen) {
  RoadAgent one(game_, 1), two(game_, 2);
  for (int k = 0; k < 5; ++k) game_.Tick();
  EXPECT_TRUE(GEngine->shim_screen_.empty()) << "nobody asked for it";
  trainer_->bShowAgents = true;
  game_.Tick();
  ASSERT_EQ(GEngine->shim_screen_.size(), 2u);
  const std::string line = Text(GEngine->shim_screen_.begin()->second);
  EXPECT_NE(line.find(Text(one.actor->GetName())), std::string::npos) << line;
  EXPECT_NE(line.find("sees places "), std::string::npos) << line;
  EXPECT_NE(line.find("does walk "), std::string::npos) << line;
  EXPECT_NE(line.find("earned 1,"), std::string::npos) << line;
  EXPECT_NE(line.find("steps"), std::string::npos) << line;
  for (int k = 0; k < 5; ++k) game_.Tick();
  EXPECT_EQ(GEngine->shim_screen_.size(), 2u) << "a line takes the place of the one before";
}

TEST_F(Shown, TheVisualLoggerHasEachDecisionWhereItRecords) {
  RoadAgent agent(game_, 1);
  for (int k = 0; k < 5; ++k) game_.Tick();
  EXPECT_TRUE(Shim::vlog.empty());
  Shim::vlog_records = true;
  for (int k = 0; k < 7; ++k) game_.Tick();
  Shim::vlog_records = false;
  ASSERT_EQ(Shim::vlog.size(), 7u);
  for (const auto& [owner, line] : Shim::vlog) {
    EXPECT_EQ(owner, agent.actor);
    EXPECT_NE(line.find("earned 1,"), std::string::npos) << line << ": by the decision before";
  }
}

TEST_F(Shown, NumbersOfTheGamesOwnAreInTheLogAsMeans) {
  RoadAgent agent(game_, 1);
  game_.Tick();
  for (const float goals : {1.0f, 2.0f, 6.0f}) UConsacBlueprintLibrary::RecordStat(agent.agent, TEXT("goals"), goals);
  UConsacBlueprintLibrary::RecordStat(agent.agent, TEXT("fouls"), 0.5f);
  UConsacBlueprintLibrary::RecordStat(agent.agent, TEXT("fouls"), std::numeric_limits<float>::quiet_NaN());
  UConsacBlueprintLibrary::RecordStat(nullptr, TEXT("nowhere"), 1.0f);
  EXPECT_EQ(Shim::LogLines("'fouls' is NaN or infinite").size(), 1u);
  Shim::ForgetLog();
  trainer_->LogSeconds = 1e-9f;
  game_.Tick();
  ASSERT_EQ(Shim::LogLines("mean reward").size(), 1u);
  EXPECT_NE(Shim::LogLines("mean reward")[0].find(", fouls 0.5, goals 3"), std::string::npos)
      << Shim::LogLines("mean reward")[0];
  Shim::ForgetLog();
  game_.Tick();
  ASSERT_EQ(Shim::LogLines("mean reward").size(), 1u);
  EXPECT_EQ(Shim::LogLines("mean reward")[0].find("goals"), std::string::npos) << "told once";
  // A further training begins with numbers of its own.
  trainer_->LogSeconds = 0.0f;
  UConsacBlueprintLibrary::RecordStat(agent.agent, TEXT("goals"), 7.0f);
  trainer_->StopTraining();
  EConsacResult result = EConsacResult::Failed;
  FString error;
  trainer_->StartTraining(result, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  trainer_->LogSeconds = 1e-9f;
  Shim::ForgetLog();
  game_.Tick();
  ASSERT_EQ(Shim::LogLines("mean reward").size(), 1u);
  EXPECT_EQ(Shim::LogLines("mean reward")[0].find("goals"), std::string::npos) << Shim::LogLines("mean reward")[0];
}

}  // namespace
}  // namespace consac::testing
