// Pipelined: what agents see in one tick decides what they do in the next, in every mode alike.
#include <cstring>
#include <future>

#include "ConsacHyperparameters.h"
#include "consac/env/buffer.h"
#include "consac/server/env_client.h"
#include "graphs.h"
#include "tests/remembering.h"

namespace consac::testing {
namespace {

/// An agent that sees the number of the tick, and writes down what happens when.
struct Watcher {
  explicit Watcher(Shim::Game& game, int32 period) {
    AActor* actor = NewObject<AConsacTestActor>(&game.world());
    agent = NewObject<UConsacAgentComponent>(actor);
    actor->ShimAddSubobject(agent);
    agent->DecisionPeriod = period;
    FConsacEntry seen, done;
    seen.Name = TEXT("seen");
    done.Name = TEXT("done");
    seen.Space = done.Space = UConsacBlueprintLibrary::MakeBoxSpace(1, 0.0f, 1000.0f);
    agent->Observations.Add(seen);
    agent->Actions.Add(done);
    agent->OnEpisodeBegin.ShimBind(agent, [this](UConsacAgentComponent*, int64) { Say("begins"); });
    agent->OnObserve.ShimBind(agent, [this](UConsacAgentComponent* which) {
      Say("sees");
      EXPECT_TRUE(which->SetObservationNumber(TEXT("seen"), static_cast<float>(tick)));
    });
    agent->OnAction.ShimBind(agent, [this](UConsacAgentComponent* which) {
      Say("does " + std::to_string(static_cast<int>(which->GetActionNumber(TEXT("done")))));
    });
    Shim::Enter(game.world(), *actor, FVector());
  }
  void Say(const std::string& what) { said.push_back(std::to_string(tick) + " " + what); }

  UConsacAgentComponent* agent;
  std::vector<std::string> said;
  int tick = 0;
};

class PipelinedTest : public ::testing::Test {
 protected:
  PipelinedTest() : scratch_("unreal_pipelined") {
    const Status saved = Policy::Create(RememberingPolicy(), 1)->ToFile(1).Save(scratch_.path() + "/sum.consac");
    EXPECT_TRUE(saved.ok()) << saved.message();
  }
  AConsacTrainer* Spawn(EConsacMode mode, bool pipelined) {
    trainer_ = game_.SpawnWith<AConsacTrainer>([&](AConsacTrainer& made) {
      made.Mode = mode;
      made.Port = 0;
      made.LogSeconds = 0.0f;
      made.bPipelined = pipelined;
      FConsacBehaviourModel model;
      model.Path = Text(scratch_.path() + "/sum.consac");
      made.Models.Add(model);
    });
    trainer_->OnTrainerError.ShimBind(nullptr, [](const FString& error) { ADD_FAILURE() << Text(error); });
    return trainer_;
  }
  void Tick(Watcher& watcher, int ticks) {
    for (int k = 0; k < ticks; ++k, ++watcher.tick) game_.Tick();
  }

  ScratchFolder scratch_;
  Shim::Game game_;
  AConsacTrainer* trainer_ = nullptr;
};

using Lines = std::vector<std::string>;

// The model's action is the sum of what it has seen since the episode began.
TEST_F(PipelinedTest, WhatIsSeenInOneTickIsDoneInTheNext) {
  Watcher watcher(game_, 1);
  Spawn(EConsacMode::Act, true);
  Tick(watcher, 4);
  EXPECT_EQ(watcher.said,
            (Lines{"0 begins", "0 sees", "1 does 0", "1 sees", "2 does 1", "2 sees", "3 does 3", "3 sees"}));
}

TEST_F(PipelinedTest, OfALongerPeriodTheLookIsOneTickEarlierAndThePeriodStays) {
  Watcher watcher(game_, 3);
  Spawn(EConsacMode::Act, true);
  Tick(watcher, 8);
  EXPECT_EQ(watcher.said, (Lines{"0 begins", "0 sees", "1 does 0", "3 sees", "4 does 3", "6 sees", "7 does 9"}));
}

TEST_F(PipelinedTest, WithoutItIsAsItWas) {
  Watcher watcher(game_, 2);
  Spawn(EConsacMode::Act, false);
  Tick(watcher, 5);
  EXPECT_EQ(watcher.said, (Lines{"0 begins", "0 sees", "0 does 0", "2 sees", "2 does 2", "4 sees", "4 does 6"}));
}

// A training has the delay that its model will have.
TEST_F(PipelinedTest, ATrainingInsideHasTheSameDelay) {
  Watcher watcher(game_, 1);
  AConsacTrainer* trainer = Spawn(EConsacMode::Train, true);
  trainer->MaxStepsPerTick = 7;  // one all the same
  Tick(watcher, 3);
  ASSERT_EQ(watcher.said.size(), 6u);
  EXPECT_EQ(watcher.said[0], "0 begins");
  EXPECT_EQ(watcher.said[1], "0 sees");
  EXPECT_EQ(watcher.said[2].substr(0, 6), "1 does");
  EXPECT_EQ(watcher.said[3], "1 sees");
  EXPECT_EQ(watcher.said[4].substr(0, 6), "2 does");
  EXPECT_EQ(watcher.said[5], "2 sees");
}

TEST_F(PipelinedTest, WhatIsEarnedBetweenTheTwoCountsAndTheActionCanBeRead) {
  Watcher watcher(game_, 1);
  watcher.agent->MaxEpisodeSteps = 4;
  AConsacTrainer* trainer = Spawn(EConsacMode::Act, true);
  Tick(watcher, 1);
  EXPECT_TRUE(watcher.agent->GetActionNumbers(TEXT("done")).IsEmpty()) << "none was carried out";
  watcher.agent->AddReward(100.0f);  // before the first action nothing counts
  for (int tick = 1; tick <= 8; ++tick) {
    Tick(watcher, 1);
    // As an Event Tick of the game that reads the action all the time; a new episode has none yet.
    EXPECT_EQ(watcher.agent->GetActionNumbers(TEXT("done")).IsEmpty(), tick % 4 == 0) << tick;
    watcher.agent->AddReward(1.0f);
  }
  EXPECT_EQ(watcher.agent->GetEpisodeReward(), 1.0f);
  EXPECT_EQ(trainer->GetTrainerProgress().Episodes, 2);
  // The second episode also had what was earned while its first decision was waited for.
  EXPECT_FLOAT_EQ(static_cast<float>(trainer->GetTrainerProgress().MeanEpisodeReward), 3.5f);
}

TEST_F(PipelinedTest, AnEpisodeMayEndBetweenTheTwo) {
  Watcher watcher(game_, 1);
  AConsacTrainer* trainer = Spawn(EConsacMode::Act, true);
  Tick(watcher, 3);
  watcher.agent->EndEpisode(EConsacEpisodeEnd::Terminated);
  EXPECT_EQ(trainer->GetTrainerProgress().Episodes, 0);
  watcher.said.clear();
  Tick(watcher, 2);
  EXPECT_EQ(watcher.said, (Lines{"3 does 3", "3 sees", "3 begins", "3 sees", "4 does 3", "4 sees"}));
  EXPECT_EQ(trainer->GetTrainerProgress().Episodes, 1);
}

TEST_F(PipelinedTest, WhoComesWhereNobodyLearnsIsPipelinedToo) {
  Watcher watcher(game_, 1);
  Spawn(EConsacMode::Act, true);
  Tick(watcher, 2);
  Watcher late(game_, 1);
  for (int tick = 0; tick < 3; ++tick, ++late.tick) game_.Tick();
  EXPECT_EQ(late.said, (Lines{"0 begins", "0 sees", "1 does 0", "1 sees", "2 does 1", "2 sees"}));
}

TEST_F(PipelinedTest, AStopWithinAnActionIsNotFollowedByALook) {
  Watcher watcher(game_, 1);
  AConsacTrainer* trainer = Spawn(EConsacMode::Act, true);
  Tick(watcher, 2);
  watcher.agent->OnAction.ShimBind(watcher.agent, [trainer](UConsacAgentComponent*) { trainer->StopTraining(); });
  const std::size_t before = watcher.said.size();
  Tick(watcher, 3);
  EXPECT_EQ(watcher.said.size(), before + 1) << "the action of the other event alone";
  EXPECT_FALSE(trainer->IsTraining());
}

// A trainer outside: its answer has the time of a tick, and none passes without a step.
TEST_F(PipelinedTest, ATrainerOutsideHasATickForItsAnswer) {
  Watcher watcher(game_, 1);
  AConsacTrainer* trainer = Spawn(EConsacMode::Serve, true);
  trainer->bLockStep = true;
  trainer->MaxWaitSeconds = 10.0f;
  Tick(watcher, 1);
  constexpr int kSteps = 50;
  std::future<Status> peer = std::async(std::launch::async, [port = trainer->GetTrainerPort()] {
    auto client = EnvClient::Open(*ConnectTcp({"127.0.0.1", port}, 5.0), {});
    if (!client.ok()) return client.status();
    BatchBuffer rows((*client)->spec().behaviours[0]);
    CONSAC_RETURN_IF_ERROR((*client)->Reset(0, {&rows.batch(), 1}));
    for (int step = 1; step <= kSteps; ++step) {
      rows.Advance();
      std::memset(rows.batch().actions, 0, sizeof(float));
      CONSAC_RETURN_IF_ERROR((*client)->Step({&rows.batch(), 1}, step == kSteps ? MoreSteps::kLast : MoreSteps::kYes));
    }
    (*client)->Close();
    return Status::Ok();
  });
  const auto decisions = [&] {
    return std::count(watcher.said.begin(), watcher.said.end(), std::to_string(watcher.tick - 1) + " does 0");
  };
  ASSERT_TRUE(TickUntil(
      60.0, [&] { Tick(watcher, 1); }, [&] { return decisions() == 1; }));
  for (int step = 1; step < kSteps; ++step) {
    Tick(watcher, 1);
    EXPECT_EQ(decisions(), 1) << "a tick without a step";
    EXPECT_EQ(watcher.said.back(), std::to_string(watcher.tick - 1) + " sees") << "in the tick of the action, after it";
  }
  const Status status = peer.get();
  EXPECT_TRUE(status.ok()) << status.message();
}

}  // namespace
}  // namespace consac::testing
