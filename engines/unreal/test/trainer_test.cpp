// A Consac Trainer, and a Consac Environment, from one training to the next: who comes after whom, stops before the
// start, pauses, agents that come and go between two ticks, the end of the game.
#include <algorithm>
#include <cstring>
#include <deque>
#include <future>

#include "ConsacFarewell.h"
#include "ConsacHyperparameters.h"
#include "ConsacSubsystem.h"
#include "Editor/EditorEngine.h"
#include "HAL/IConsoleManager.h"
#include "consac/env/buffer.h"
#include "consac/server/env_client.h"
#include "graphs.h"

namespace consac::testing {
namespace {

bool Fast() {
  return UEditorEngine::ShimFrameLimit() > 10000.0f;
}

/// No frame limit but the editor's own.
void ForgetFrameLimit() {
  IConsoleManager::Get().FindConsoleVariable(TEXT("t.MaxFPS"))->ShimForget();
}

AConsacTrainer* SpawnDriving(Shim::Game& game, EConsacMode mode, int64 steps) {
  return game.SpawnWith<AConsacTrainer>([=](AConsacTrainer& made) {
    made.Mode = mode;
    made.Port = 0;
    made.LogSeconds = 0.0f;
    made.TotalSteps = steps;
  });
}

/// A trainer at the other end: takes so many steps, thinks so long about each, and leaves in order.
Status TrainAt(int port, int steps, double seconds = 0.0) {
  auto transport = ConnectTcp({"127.0.0.1", port}, 5.0);
  if (!transport.ok()) return transport.status();
  EnvClientOptions options;
  options.protocol = Protocol::kProtocol2;
  auto client = EnvClient::Open(std::move(*transport), options);
  if (!client.ok()) return client.status();
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  CONSAC_RETURN_IF_ERROR((*client)->Reset(0, {&buffer.batch(), 1}));
  for (int k = 1; k <= steps; ++k) {
    buffer.Advance();
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    std::memset(buffer.batch().actions, 0, sizeof(std::int32_t));
    CONSAC_RETURN_IF_ERROR((*client)->Step({&buffer.batch(), 1}, k == steps ? MoreSteps::kLast : MoreSteps::kYes));
  }
  (*client)->Close();
  return Status::Ok();
}

TEST(Trainings, OneAfterTheOtherAreEachFastAndTold) {
  ForgetFrameLimit();
  Shim::Game game;
  RoadAgent agent(game, 1);
  constexpr int kTrainings = 3, kLength = 200;
  AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::Serve, kLength);
  int completed = 0;
  trainer->OnTrainingCompleted.ShimBind(nullptr, [&completed] { ++completed; });
  game.Tick();
  ASSERT_GT(trainer->GetTrainerPort(), 0);
  for (int training = 1; training <= kTrainings; ++training) {
    EXPECT_FALSE(Fast()) << "nobody is there";
    std::future<Status> peer = std::async(std::launch::async, TrainAt, trainer->GetTrainerPort(), kLength, 0.0);
    const long before = agent.steps;
    const auto tick = [&game] { game.Tick(); };
    ASSERT_TRUE(TickUntil(60.0, tick, [&] { return agent.steps > before + kLength / 2; }));
    EXPECT_TRUE(Fast()) << "training " << training;
    EXPECT_TRUE(TickUntil(60.0, tick, [&] { return completed == training; })) << completed;
    const Status status = peer.get();
    EXPECT_TRUE(status.ok()) << status.message();
    game.Tick();
  }
  EXPECT_EQ(completed, kTrainings);
}

TEST(Trainings, AnEnvironmentWhoseTrainerLeavesEarlyWaitsForAnother) {
  ForgetFrameLimit();
  Shim::Game game;
  RoadGraph graph(game);
  constexpr int kLength = 100000;
  ASSERT_EQ(graph.Setup(kLength, 0), EConsacResult::Success) << Text(graph.error);
  ASSERT_EQ(graph.Tick(), EConsacConnection::Waiting);
  const int32 port = graph.environment().GetTrainingPort();
  for (const int training : {1, 2}) {
    std::future<Status> peer = std::async(std::launch::async, TrainAt, port, 50, 0.0);
    EConsacConnection connection = EConsacConnection::Waiting;
    const auto tick = [&] { connection = graph.Tick(), game.Tick(); };
    ASSERT_TRUE(TickUntil(60.0, tick, [&] { return connection == EConsacConnection::Connected; })) << Text(graph.error);
    EXPECT_TRUE(Fast()) << training;
    // Before all of its steps, and in order.
    EXPECT_TRUE(TickUntil(60.0, tick, [&] { return connection == EConsacConnection::Waiting; })) << Text(graph.error);
    EXPECT_FALSE(Fast()) << "nobody is there";
    EXPECT_TRUE(peer.get().ok());
    EXPECT_EQ(graph.environment().GetTrainingPort(), port);
  }
}

TEST(Trainings, WhatFailsInAnEnvironmentLeavesWhatIsUnderWay) {
  Shim::Game game;
  RoadGraph graph(game);
  ASSERT_EQ(graph.Setup(100, 0), EConsacResult::Success) << Text(graph.error);
  ASSERT_EQ(graph.Tick(), EConsacConnection::Waiting);
  const int32 port = graph.environment().GetTrainingPort();
  ASSERT_GT(port, 0);
  EXPECT_EQ(graph.Setup(-1, 0), EConsacResult::Failed);
  EXPECT_EQ(graph.environment().GetTrainingPort(), port);
  EXPECT_EQ(graph.Tick(), EConsacConnection::Waiting) << Text(graph.error);
}

TEST(Trainings, AStartThatFailsLeavesAutoStartAsItWas) {
  for (const bool stopped : {false, true}) {
    Shim::Game game;
    AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::ByHand, 0);
    if (stopped) trainer->StopTraining();
    game.Tick();
    EConsacResult result = EConsacResult::Success;
    FString error;
    trainer->StartTraining(result, error);
    EXPECT_EQ(result, EConsacResult::Failed) << "there is no agent";
    RoadAgent agent(game, 1);
    const auto tick = [&game] { game.Tick(); };
    EXPECT_EQ(TickUntil(stopped ? 1.5 : 10.0, tick, [&] { return trainer->IsTraining(); }), !stopped);
  }
}

TEST(Trainings, AnEventBeginPlayMayStartTheTraining) {
  // The trainer's own, or that of an actor that begins to play before it; agents begin to play after either.
  for (const bool own : {true, false}) {
    Shim::Game game;
    game.world().shim_begun_ = false;
    AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::ByHand, 0);
    trainer->bAutoStart = false;
    int calls = 0;
    const auto start = [&] {
      EConsacResult result = EConsacResult::Failed;
      FString error;
      trainer->StartTraining(result, error);
      EXPECT_EQ(result, EConsacResult::Success) << own << ": " << Text(error);
      ++calls;
    };
    if (own) trainer->shim_event_begin_play_ = start;
    if (!own) start();
    game.world().shim_begun_ = true;
    Shim::BeginPlay(*trainer);
    std::deque<RoadAgent> agents;
    for (int k = 0; k < 3; ++k) agents.emplace_back(game, static_cast<std::uint64_t>(k) + 1);
    for (int k = 0; k < 10; ++k) game.Tick();
    EXPECT_EQ(calls, 1);
    EXPECT_TRUE(trainer->IsTraining()) << own;
    for (const RoadAgent& agent : agents) EXPECT_GT(agent.steps, 5) << own << ": it came with the level";
  }
}

TEST(Trainings, AStartBeforeTheFirstTickIsRefusedOrTakenBack) {
  EConsacResult result = EConsacResult::Success;
  FString error;
  Shim::Game client(NM_Client), game;
  AConsacTrainer* idle = client.Spawn<AConsacTrainer>();
  idle->StartTraining(result, error);
  EXPECT_EQ(result, EConsacResult::Failed);
  EXPECT_NE(Text(error).find("client"), std::string::npos) << Text(error);
  RoadAgent agent(game, 1);
  AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::ByHand, 0);
  trainer->bAutoStart = false;
  trainer->StartTraining(result, error);
  EXPECT_EQ(result, EConsacResult::Success) << Text(error);
  trainer->StopTraining();
  for (int k = 0; k < 3; ++k) game.Tick();
  EXPECT_FALSE(trainer->IsTraining());
  Shim::Hide(*trainer);
  trainer->StartTraining(result, error);
  EXPECT_EQ(result, EConsacResult::Failed);
  EXPECT_NE(Text(error).find("plays no more"), std::string::npos) << Text(error);
}

/// Nodes that a handler calls, one after another: 'x' is Stop Training, 's' Start Training, which succeeds.
void Call(AConsacTrainer& trainer, const std::string& nodes) {
  for (const char node : nodes) {
    EConsacResult result = EConsacResult::Success;
    FString error;
    if (node == 'x') trainer.StopTraining();
    if (node == 's') trainer.StartTraining(result, error);
    EXPECT_EQ(result, EConsacResult::Success) << nodes << ": " << Text(error);
  }
}

TEST(Trainings, AnEventMayStopAndStartInThatOrder) {
  for (const std::string& nodes : {std::string("x"), std::string("xs"), std::string("xsx"), std::string("xsxs")}) {
    Shim::Game game;
    RoadAgent agent(game, 1);
    AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::ByHand, 0);
    for (int k = 0; k < 10; ++k) game.Tick();
    const std::size_t begun = agent.seeds.size();
    bool struck = false;
    agent.agent->OnObserve.ShimBind(nullptr, [&](UConsacAgentComponent*) {
      if (!std::exchange(struck, true)) Call(*trainer, nodes);
    });
    game.Tick();
    ASSERT_TRUE(struck);
    EXPECT_EQ(trainer->IsTraining(), nodes.back() == 's') << nodes;
    for (int k = 0; k < 5; ++k) game.Tick();
    EXPECT_EQ(agent.seeds.size() > begun, nodes.back() == 's') << nodes << ": a new training begins new episodes";
    EXPECT_LT(trainer->GetTrainerProgress().Steps, nodes.back() == 's' ? 6 : 1000) << nodes;
  }
}

TEST(Trainings, WhoeverHearsOfTheEndMayBeginTheNext) {
  // Told by the tick that finished it, by the one that found its models written, or by a Stop Training before that.
  for (const bool stops : {false, true}) {
    for (const std::string& nodes : {std::string("s"), std::string("xs")}) {
      if (!stops && nodes == "s") continue;  // it goes on by what was learned, and would have to be stopped first
      const ScratchFolder scratch("unreal_next");
      Shim::Game game;
      RoadAgent agent(game, 1);
      AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::Train, 200);
      trainer->SaveFolder = Text(scratch.path());
      trainer->bLockStep = true;
      trainer->MaxStepsPerTick = 10;
      int told = 0;
      bool stopped = false;  // where its models are written before that, it goes on by them
      trainer->OnTrainingCompleted.ShimBind(nullptr, [&] {
        if (told++ == 0) Call(*trainer, stopped ? nodes : "xs");
      });
      const auto over = [&] { return told > 0 || Text(trainer->GetTrainerProgress().State).starts_with("trained"); };
      ASSERT_TRUE(TickUntil(
          60.0, [&] { game.Tick(); }, over));
      stopped = stops && told == 0;
      if (stopped) trainer->StopTraining();
      ASSERT_TRUE(TickUntil(
          60.0, [&] { game.Tick(); }, [&] { return told > 0; }));
      EXPECT_TRUE(trainer->IsTraining()) << nodes << ", " << stops;
      EXPECT_TRUE(TickUntil(
          60.0, [&] { game.Tick(); }, [&] { return told == 2; }))
          << "the next comes to its end too";
    }
  }
}

TEST(Trainings, OneTickWaitsOnceForAllOfItsSteps) {
  Shim::Game game;
  RoadAgent agent(game, 1);
  AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::Serve, 100000);
  trainer->bLockStep = true;
  trainer->MaxWaitSeconds = 0.2f;
  trainer->MaxStepsPerTick = 1000;
  game.Tick();
  constexpr int kSteps = 40;
  std::future<Status> peer = std::async(std::launch::async, TrainAt, trainer->GetTrainerPort(), kSteps, 0.05);
  double longest = 0.0;
  const auto tick = [&] {
    const auto began = std::chrono::steady_clock::now();
    game.Tick();
    longest = std::max(longest, std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
  };
  EXPECT_TRUE(TickUntil(60.0, tick, [&] { return agent.steps >= kSteps; }));
  EXPECT_LT(longest, 1.0) << "40 answers of 50 ms each are 2 s";
  EXPECT_TRUE(
      TickUntil(60.0, tick, [&] { return peer.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }));
  EXPECT_TRUE(peer.get().ok());
}

TEST(Trainings, NoStepOfADestroyedAgentCounts) {
  Shim::Game game;
  std::deque<RoadAgent> agents;
  for (int k = 0; k < 3; ++k) agents.emplace_back(game, static_cast<std::uint64_t>(k) + 1);
  AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::ByHand, 0);
  for (int k = 0; k < 10; ++k) game.Tick();
  const std::int64_t before = trainer->GetTrainerProgress().Steps;
  Shim::ForgetLog();
  Shim::Destroy(*agents[0].actor);
  Shim::Destroy(*agents[1].actor);
  ASSERT_EQ(Shim::Log().size(), 1U) << "said once";
  EXPECT_NE(Shim::Log()[0].find("leaves the training"), std::string::npos) << Shim::Log()[0];
  game.Tick();  // the step under way is theirs too, and is cut
  for (int k = 0; k < 10; ++k) game.Tick();
  EXPECT_EQ(trainer->GetTrainerProgress().Steps, before + 3 + 10);
}

TEST(Trainings, AnAlgorithmThatIsNotTheHyperparametersIsRefused) {
  Shim::Game game;
  RoadAgent agent(game, 1);
  AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::Serve, 100);
  game.Tick();
  std::vector<std::string> told;
  trainer->OnTrainerError.ShimBind(nullptr, [&told](const FString& error) { told.push_back(Text(error)); });
  trainer->Hyperparameters = NewObject<UConsacDqnHyperparameters>(trainer);
  trainer->Program.Program = Text(CONSAC_PROGRAM);
  trainer->Program.Algorithm = TEXT("ppo2");
  trainer->StartProgram();
  ASSERT_EQ(told.size(), 1U);
  EXPECT_NE(told[0].find("ppo2"), std::string::npos) << told[0];
  EXPECT_NE(told[0].find("dqn"), std::string::npos) << told[0];
}

TEST(Trainings, ProgramsThatAreStartedAtOnceHaveARunEach) {
  const ScratchFolder scratch("unreal_two_programs");
  FConsacProgramSettings settings;
  settings.Program = TEXT("/bin/true");  // no run of it is ever there
  settings.RunsFolder = Text(scratch.path());
  for (const std::string run : {"unreal", "unreal-2", "unreal-3"}) {
    FString error;
    UConsacTrainerProgram* program = NewObject<UConsacTrainerProgram>();
    ASSERT_TRUE(program->Start(settings, {}, error)) << Text(error);
    EXPECT_EQ(Text(program->GetModelPath()), scratch.path() + "/" + run + "/model.consac");
  }
}

TEST(Trainings, AnEnvironmentsPortIsClosedAtItsEnd) {
  ForgetFrameLimit();
  Shim::Game game;
  RoadGraph graph(game);
  constexpr int kLength = 200;
  ASSERT_EQ(graph.Setup(kLength, 0), EConsacResult::Success) << Text(graph.error);
  ASSERT_EQ(graph.Tick(), EConsacConnection::Waiting);
  const int32 port = graph.environment().GetTrainingPort();
  std::future<Status> peer = std::async(std::launch::async, TrainAt, port, kLength, 0.0);
  const auto tick = [&] { (void)graph.Tick(), game.Tick(); };
  ASSERT_TRUE(TickUntil(60.0, tick, [&] { return graph.steps > kLength / 2; })) << Text(graph.error);
  EXPECT_TRUE(Fast());
  game.world().shim_paused_ = true;
  game.Tick();
  EXPECT_FALSE(Fast()) << "a game that is paused draws as ever";
  game.world().shim_paused_ = false;
  game.Tick();
  EXPECT_TRUE(Fast());
  EXPECT_TRUE(TickUntil(60.0, tick, [&] { return graph.environment().IsTrainingCompleted(); }));
  EXPECT_TRUE(peer.get().ok());
  EXPECT_EQ(graph.environment().GetTrainingPort(), 0);
  EXPECT_FALSE(ConnectTcp({"127.0.0.1", port}, 0.2).ok());
  EXPECT_EQ(graph.environment().GetTrainingProgress().Steps, kLength);
  EXPECT_EQ(graph.Tick(), EConsacConnection::Completed) << Text(graph.error);
  EXPECT_EQ(graph.Train(), EConsacTraining::Completed) << Text(graph.error);
}

TEST(Trainings, APausedGameDrawsAsEver) {
  ForgetFrameLimit();
  Shim::Game game;
  RoadAgent agent(game, 1);
  SpawnDriving(game, EConsacMode::Train, 1000000);
  for (int k = 0; k < 3; ++k) game.Tick();
  EXPECT_TRUE(Fast());
  game.world().shim_paused_ = true;
  game.Tick();
  EXPECT_FALSE(Fast());
  game.world().shim_paused_ = false;
  game.Tick();
  EXPECT_TRUE(Fast());
}

TEST(Trainings, AStopBeforeTheStartKeepsItFromBeginning) {
  Shim::Game game;
  RoadAgent agent(game, 1);
  AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::ByHand, 0);
  trainer->StopTraining();
  for (int k = 0; k < 5; ++k) game.Tick();
  EXPECT_FALSE(trainer->IsTraining());
  EConsacResult result = EConsacResult::Failed;
  FString error;
  trainer->StartTraining(result, error);
  EXPECT_EQ(result, EConsacResult::Success) << Text(error);
  // Its level is hidden, in the middle of an event too: it begins by itself when the level is shown again.
  for (const bool in_event : {false, true}) {
    if (in_event) agent.agent->OnAction.ShimBind(nullptr, [trainer](UConsacAgentComponent*) { Shim::Hide(*trainer); });
    if (!in_event) Shim::Hide(*trainer);
    game.Tick();
    EXPECT_FALSE(trainer->IsTraining());
    Shim::BeginPlay(*trainer);
    const long before = agent.steps;
    game.Tick();
    EXPECT_GT(agent.steps, before) << in_event;
  }
}

TEST(Trainings, WhoeverComesAndGoesBetweenTwoTicksHasOnePlaceOrNone) {
  Shim::Game game;
  RoadAgent first(game, 1);
  AConsacTrainer* trainer = SpawnDriving(game, EConsacMode::ByHand, 0);
  trainer->RoomForAgents = 3;
  std::vector<std::string> told;
  trainer->OnTrainerError.ShimBind(nullptr, [&told](const FString& error) { told.push_back(Text(error)); });
  game.Tick();
  ASSERT_TRUE(trainer->IsTraining());
  RoadAgent gone(game, 2), twice(game, 3);
  Shim::Hide(*gone.actor);
  Shim::Hide(*twice.actor);
  Shim::BeginPlay(*twice.actor);
  for (int k = 0; k < 10; ++k) game.Tick();
  EXPECT_EQ(gone.seeds.size(), 0U) << "it does not play";
  EXPECT_EQ(gone.steps, 0);
  EXPECT_EQ(twice.seeds.size(), 1U);
  EXPECT_GT(twice.steps, 5);
  Shim::BeginPlay(*gone.actor);
  for (int k = 0; k < 10; ++k) game.Tick();
  EXPECT_GT(gone.steps, 5) << "there is a place for it";
  EXPECT_EQ(told, std::vector<std::string>());
}

TEST(Trainings, QuittingWaitsForWhatIsBeingSavedAndSaysSo) {
  // A driver whose end takes a while.
  struct FLong final : host::Driver {
    explicit FLong(bool* set) : ended(set) {}
    ~FLong() override {
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      *ended = true;
    }
    Status Poll(double) override { return Status::Ok(); }
    bool finished() const override { return false; }
    host::Progress progress() const override { return {}; }
    bool* ended;
  };
  bool ended = false;
  FConsacFarewell farewell;
  farewell.Driver = std::make_unique<FLong>(&ended);
  ConsacPlugin::Leave(ConsacPlugin::SendOut(std::move(farewell)));
  Shim::ForgetLog();
  ConsacPlugin::AwaitFarewells();
  EXPECT_TRUE(ended);
  ASSERT_EQ(Shim::Log().size(), 1U);
  EXPECT_NE(Shim::Log()[0].find("waits until what was learned is saved"), std::string::npos) << Shim::Log()[0];
  ConsacPlugin::AwaitFarewells();
  EXPECT_EQ(Shim::Log().size(), 1U);
}

}  // namespace
}  // namespace consac::testing
