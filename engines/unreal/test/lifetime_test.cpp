// How the plugin lives in a hostile engine: Hot Reload, garbage collection, packaged games, several worlds and net
// modes in one process, travel, streaming, settings that are somebody else's.
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <future>
#include <limits>
#include <memory>

#include "Components/SceneCaptureComponent2D.h"
#include "Components/StaticMeshComponent.h"
#include "ConsacCameraSensorComponent.h"
#include "ConsacChase.h"
#include "ConsacFarewell.h"
#include "ConsacRoad.h"
#include "ConsacSubsystem.h"
#include "ConsacTransformSensorComponent.h"
#include "Editor.h"
#include "Editor/EditorEngine.h"
#include "HAL/IConsoleManager.h"
#include "Misc/App.h"
#include "graphs.h"

namespace consac::testing {
namespace {

long Count(const std::string& what) {
  return static_cast<long>(Shim::LogLines(what).size());
}

AConsacTrainer* Trainer(Shim::Game& game, EConsacMode mode) {
  return game.SpawnWith<AConsacTrainer>([mode](AConsacTrainer& made) {
    made.Mode = mode;
    made.Port = 0;
    made.LogSeconds = 0.0f;
  });
}

TEST(Lifetime, WhatHotReloadMakesIsDestroyedWithoutState) {
  EXPECT_GT(Shim::HotReload(), 10);
}

TEST(Lifetime, AnEntryHasOneNameHoweverTheGameSpellsIt) {
  // A packaged game keeps one spelling of a name: that of who came first, who may be anybody.
  EXPECT_EQ(Text(FName(TEXT("SpeltAnyhow")).ToString()), "SpeltAnyhow");
  Shim::Game game;
  RoadAgent agent(game, 1);
  FConsacEntry entry;
  entry.Name = TEXT("speltanyhow");
  EXPECT_EQ(Text(entry.Name.ToString()), "SpeltAnyhow") << "the shim is as hostile as that";
  entry.Space = UConsacBlueprintLibrary::MakeBoxSpace(1, 0.0f, 1.0f);
  agent.agent->Observations.Add(entry);
  const ScratchFolder scratch("unreal_names");
  AConsacTrainer* trainer = Trainer(game, EConsacMode::Train);
  game.Tick();
  game.Tick();
  EConsacResult result = EConsacResult::Failed;
  FString error;
  trainer->SaveModel(TEXT("default"), Text(scratch.path() + "/model.consac"), result, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  const auto policy = Policy::Load(scratch.path() + "/model.consac", 1);
  ASSERT_TRUE(policy.ok());
  const std::string space = policy->data().observation_space.ToString();
  EXPECT_NE(space.find("speltanyhow"), std::string::npos) << space;
  EXPECT_EQ(space.find("SpeltAnyhow"), std::string::npos) << space;
}

TEST(Lifetime, ThePackagedSamplesAreSeenAndStandSomewhere) {
  Shim::Game game;
  AConsacRoad* road = game.SpawnWith<AConsacRoad>([](AConsacRoad& made) { made.Port = 0; });
  AConsacChase* chase = game.SpawnWith<AConsacChase>([](AConsacChase& made) { made.Chasers = 2; });
  chase->Trainer->Mode = EConsacMode::ByHand;
  for (int k = 0; k < 3; ++k) game.Tick();
  int meshes = 0;
  for (AActor* actor : {static_cast<AActor*>(road), static_cast<AActor*>(chase)}) {
    for (UActorComponent* component : actor->shim_components_) {
      if (!component->ShimClass()->ShimIsA(UStaticMeshComponent::StaticClass())) continue;
      const auto* mesh = static_cast<UStaticMeshComponent*>(component);
      EXPECT_NE(mesh->shim_mesh_, nullptr);
      EXPECT_DOUBLE_EQ(mesh->shim_rotation_.W, 1.0);
      EXPECT_DOUBLE_EQ(mesh->shim_rotation_.X + mesh->shim_rotation_.Y + mesh->shim_rotation_.Z, 0.0);
      ++meshes;
    }
  }
  EXPECT_EQ(meshes, 3);
  for (AActor* actor : game.world().shim_actors_) {
    const FVector at = actor->GetActorLocation();
    EXPECT_LT(std::abs(at.X) + std::abs(at.Y) + std::abs(at.Z), 1e5) << Text(actor->GetName());
  }
}

TEST(Lifetime, ASampleWhoseLevelIsHiddenAndShownIsThereOnce) {
  Shim::Game game;
  AConsacChase* chase = game.SpawnWith<AConsacChase>([](AConsacChase& made) { made.Chasers = 2; });
  chase->Trainer->Mode = EConsacMode::ByHand;
  game.Tick();
  const std::vector<AActor*> actors = game.world().shim_actors_;
  for (AActor* actor : actors) Shim::Hide(*actor);
  for (AActor* actor : actors) Shim::BeginPlay(*actor);
  EXPECT_EQ(game.world().shim_actors_, actors);
  for (int k = 0; k < 3; ++k) game.Tick();
  EXPECT_EQ(UConsacSubsystem::Of(chase)->GetAgents().Num(), 2);
  EXPECT_TRUE(chase->Trainer->IsTraining());
}

TEST(Lifetime, NothingTrainsOnAClient) {
  Shim::Game server(NM_ListenServer), client(NM_Client);
  RoadAgent there(server, 1), here(client, 1);
  AConsacTrainer* serving = Trainer(server, EConsacMode::ByHand);
  AConsacTrainer* idle = Trainer(client, EConsacMode::ByHand);
  Shim::ForgetLog();
  for (int k = 0; k < 5; ++k) server.Tick(), client.Tick();
  EXPECT_TRUE(serving->IsTraining());
  EXPECT_FALSE(idle->IsTraining());
  EXPECT_EQ(here.steps, 0);
  EXPECT_EQ(Count("Error"), 0) << "a client is no fault";
  EConsacResult result = EConsacResult::Success;
  FString error;
  idle->StartTraining(result, error);
  EXPECT_EQ(result, EConsacResult::Failed);
  EXPECT_NE(Text(error).find("client"), std::string::npos) << Text(error);
}

TEST(Lifetime, ASecondTrainerWaitsForItsTurn) {
  for (const bool streamed : {false, true}) {
    Shim::Game game;
    RoadAgent agent(game, 1);
    AConsacTrainer* first = Trainer(game, EConsacMode::ByHand);
    AConsacTrainer* second = Trainer(game, EConsacMode::ByHand);
    for (int k = 0; k < 5; ++k) game.Tick();
    EXPECT_TRUE(first->IsTraining());
    EXPECT_FALSE(second->IsTraining());
    if (streamed) Shim::StreamOut(*first);
    if (!streamed) Shim::Destroy(*first);
    Shim::Collect();
    const long before = agent.steps;
    for (int k = 0; k < 5; ++k) game.Tick();
    EXPECT_TRUE(second->IsTraining());
    EXPECT_GT(agent.steps, before);
    EXPECT_EQ(UConsacSubsystem::Of(second)->GetTrainer(), second);
  }
}

TEST(Lifetime, EachWorldHasItsOwnAgentsAndTrainer) {
  Shim::Game game;
  RoadAgent before(game, 1);
  AConsacTrainer* old_trainer = Trainer(game, EConsacMode::ByHand);
  UWorld& old_world = game.world();
  game.Tick();
  // A seamless travel: the next world begins while the last still plays.
  game.OpenWorld();
  RoadAgent after(game, 2);
  AConsacTrainer* trainer = Trainer(game, EConsacMode::ByHand);
  for (int k = 0; k < 5; ++k) game.Tick();
  EXPECT_TRUE(old_trainer->IsTraining());
  EXPECT_TRUE(trainer->IsTraining());
  EXPECT_EQ(UConsacSubsystem::Of(trainer)->GetAgents().Num(), 1);
  game.CloseWorld(old_world);
  const long steps = after.steps;
  for (int k = 0; k < 5; ++k) game.Tick();
  EXPECT_EQ(after.steps, steps + 5);
}

TEST(Lifetime, ATravelKeepsNothingOfTheWorldItLeaves) {
  Shim::Game game;
  RoadAgent agent(game, 1);
  Trainer(game, EConsacMode::ByHand);
  // What a graph keeps in its game: a socket with somebody who waits at it, and a model.
  Shim::Held socket_held, model_held;
  UConsacSocket* socket = UConsacBlueprintLibrary::CreateConsacSocket(agent.actor, TEXT("127.0.0.1"), 0);
  socket_held.Hold(socket);
  EConsacResult result = EConsacResult::Failed;
  FString error;
  socket->OpenSocket(result, error);
  UConsacWaitMessageAction::WaitAndAcceptMessage(agent.actor, socket, 100.0f)->Activate();
  game.Tick();
  Shim::Collect();
  game.Travel();  // ends the test where a part of the world is still held
  EXPECT_TRUE(socket->IsOpen()) << "its game goes on";
  game.Tick();
}

TEST(Lifetime, AnObjectOfAGameIsNotTakenForGarbageWhileItIsHeld) {
  Shim::Game game;
  AActor* actor = game.Spawn<AConsacTestActor>();
  Shim::Held held;
  UConsacSocket* socket = UConsacBlueprintLibrary::CreateConsacSocket(actor, TEXT("127.0.0.1"), 0);
  held.Hold(socket);
  const std::shared_ptr<UObject*> token = Shim::TokenOf(socket);
  EConsacResult result = EConsacResult::Failed;
  FString error;
  socket->OpenSocket(result, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  const int32 port = socket->GetOpenPort();
  Shim::Collect();
  ASSERT_NE(*token, nullptr);
  EXPECT_EQ(socket->ShimOuter(), game.world().GetGameInstance()) << "it belongs to its game";
  EXPECT_EQ(socket->GetOpenPort(), port);
  held.Hold(nullptr);
  Shim::Collect();
  EXPECT_EQ(*token, nullptr) << "what nobody keeps goes";
  EXPECT_FALSE(ConnectTcp({"127.0.0.1", port}, 0.2).ok()) << "and its port with it";
}

TEST(Lifetime, APortThatAnotherGameHasIsTriedAgain) {
  Shim::Game game, other;
  RoadAgent agent(game, 1), far(other, 1);
  AConsacTrainer* first = Trainer(game, EConsacMode::Serve);
  game.Tick();
  ASSERT_GT(first->GetTrainerPort(), 0);
  AConsacTrainer* second = Trainer(other, EConsacMode::Serve);
  second->Port = first->GetTrainerPort();
  int told = 0;
  second->OnTrainerError.ShimBind(nullptr, [&told](const FString&) { ++told; });
  for (int k = 0; k < 5; ++k) other.Tick();
  EXPECT_FALSE(second->IsTraining());
  EXPECT_EQ(told, 1);
  first->StopTraining();
  EXPECT_TRUE(TickUntil(
      30.0, [&] { other.Tick(); }, [&] { return second->IsTraining(); }));
  EXPECT_EQ(told, 1);
}

TEST(Lifetime, ATrainerWithoutAgentsBeginsWhenOneHasCome) {
  Shim::Game game;
  AConsacTrainer* trainer = Trainer(game, EConsacMode::ByHand);
  std::vector<std::string> told;
  trainer->OnTrainerError.ShimBind(nullptr, [&told](const FString& error) { told.push_back(Text(error)); });
  for (int k = 0; k < 5; ++k) game.Tick();
  EXPECT_FALSE(trainer->IsTraining());
  ASSERT_EQ(told.size(), 1U);
  EXPECT_NE(told[0].find("it begins by itself once one has come"), std::string::npos) << told[0];
  RoadAgent agent(game, 1);
  EXPECT_TRUE(TickUntil(
      30.0, [&] { game.Tick(); }, [&] { return trainer->IsTraining(); }));
  EXPECT_EQ(told.size(), 1U);
}

TEST(Lifetime, ATrainerIsThereWhereverThePlayerIs) {
  Shim::Game game;
  EXPECT_TRUE(game.Spawn<AConsacTestActor>()->ShimStreamsByPlace());
  EXPECT_FALSE(game.Spawn<AConsacTrainer>()->ShimStreamsByPlace());
}

TEST(Lifetime, AnUnattendedGameWaitsForNobodyWhoHasNotCome) {
  FApp::ShimSetUnattended(true);
  {
    Shim::Game game;
    RoadAgent agent(game, 1);
    AConsacTrainer* trainer = Trainer(game, EConsacMode::Serve);
    trainer->MaxWaitSeconds = 20.0f;
    const auto begun = std::chrono::steady_clock::now();
    for (int k = 0; k < 20; ++k) game.Tick();
    EXPECT_TRUE(trainer->IsTraining());
    EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(15));
  }
  FApp::ShimSetUnattended(false);
}

TEST(Lifetime, WhatFailsInEveryTickIsOneLine) {
  Shim::Game game;
  AActor* actor = game.Spawn<AConsacTestActor>();
  UConsacAgentComponent* agent = game.AddComponent<UConsacAgentComponent>(*actor);
  Shim::ForgetLog();
  for (int k = 0; k < 100; ++k) agent->SetObservationNumber(TEXT("nowhere"), 1.0f);
  EXPECT_EQ(Count("nowhere"), 1);
  agent->SetObservationNumber(TEXT("elsewhere"), 1.0f);
  EXPECT_EQ(Count("elsewhere"), 1);
}

TEST(Lifetime, AStopHoldsTheGameNoLongerThanItSays) {
  // A driver whose end takes until it is let go.
  struct FSlow final : host::Driver {
    explicit FSlow(std::shared_ptr<std::promise<void>> held) : go(std::move(held)) {}
    ~FSlow() override { go->get_future().wait(); }
    Status Poll(double) override { return Status::Ok(); }
    bool finished() const override { return false; }
    host::Progress progress() const override { return {}; }
    std::shared_ptr<std::promise<void>> go;
  };
  auto go = std::make_shared<std::promise<void>>();
  FConsacFarewell farewell;
  farewell.Driver = std::make_unique<FSlow>(go);
  const auto begun = std::chrono::steady_clock::now();
  ConsacPlugin::FLeaving& leaving = ConsacPlugin::SendOut(std::move(farewell));
  EXPECT_FALSE(ConsacPlugin::IsOut(leaving, 0.05));
  EXPECT_EQ(ConsacPlugin::Leave(leaving), "");
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(10));
  go->set_value();
  ConsacPlugin::AwaitFarewells();
}

TEST(Lifetime, TrainingsThatEndAtOnceWriteTheirFilesOneAfterAnother) {
  const ScratchFolder scratch("unreal_one_file");
  const std::string path = scratch.path() + "/default.stopped.consac";
  for (int round = 0; round < 5; ++round) {
    std::vector<ConsacPlugin::FLeaving*> leaving;
    for (const std::byte value : {std::byte{1}, std::byte{2}, std::byte{3}}) {
      ModelFile model;
      model.spec_json = "{}";
      model.tensors["row"] = {DType::kU8, {1 << 20}, std::vector<std::byte>(std::size_t{1} << 20, value)};
      FConsacFarewell farewell;
      farewell.Models.emplace_back(path, std::move(model));
      leaving.push_back(&ConsacPlugin::SendOut(std::move(farewell)));
    }
    for (ConsacPlugin::FLeaving* one : leaving) {
      ASSERT_TRUE(ConsacPlugin::IsOut(*one, 60.0));
      EXPECT_EQ(ConsacPlugin::Leave(*one), "") << "round " << round;
    }
    const auto written = ModelFile::Load(path);
    ASSERT_TRUE(written.ok()) << written.status().message();
    const std::vector<std::byte>& row = written->tensors.at("row").bytes;
    EXPECT_EQ(row, std::vector<std::byte>(row.size(), row[0])) << "round " << round;
  }
}

TEST(Lifetime, NoTickWaitsForTheModelsOfATrainingThatIsComplete) {
  const ScratchFolder scratch("unreal_slow_disk");
  // A file that whoever opens it waits for: its other end opens once the game has ticked on, or after so long anyway.
  const std::string slow = scratch.path() + "/default.consac.tmp-" + std::to_string(getpid());
  ASSERT_EQ(mkfifo(slow.c_str(), 0600), 0);
  std::promise<void> go;
  std::thread disk([&slow, may = go.get_future()] {
    may.wait_for(std::chrono::seconds(20));
    std::ifstream(slow).ignore(std::numeric_limits<std::streamsize>::max());
  });
  {
    Shim::Game game;
    RoadAgent agent(game, 1);
    int completed = 0, told = 0;
    AConsacTrainer* trainer = game.SpawnWith<AConsacTrainer>([&](AConsacTrainer& made) {
      made.Mode = EConsacMode::Train;
      made.LogSeconds = 0.0f;
      made.TotalSteps = 200;
      made.WhileLearning = EConsacWhileLearning::Wait;
      made.SaveFolder = Text(scratch.path());
    });
    trainer->OnTrainingCompleted.ShimBind(nullptr, [&completed] { ++completed; });
    trainer->OnTrainerError.ShimBind(nullptr, [&told](const FString&) { ++told; });
    const auto at_end = [&] { return Text(trainer->GetTrainerProgress().State).find("trained") == 0; };
    double longest = 0.0;
    const auto tick = [&] {
      const auto begun = std::chrono::steady_clock::now();
      game.Tick();
      longest = std::max(longest, std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
    };
    ASSERT_TRUE(TickUntil(60.0, tick, at_end)) << Text(trainer->GetTrainerProgress().State);
    for (int k = 0; k < 10; ++k) tick();
    EXPECT_LT(longest, 10.0) << "a tick waited for the disk";
    EXPECT_EQ(completed, 0) << "whoever hears of the end may load the model";
    go.set_value();
    EXPECT_TRUE(TickUntil(60.0, tick, [&] { return completed > 0; }));
    for (int k = 0; k < 10; ++k) tick();
    EXPECT_EQ(completed, 1);
    EXPECT_EQ(told, 1) << "nothing can be synced there";
  }
  disk.join();
}

TEST(Lifetime, FramesWaitForNothingWhileItTrainsAndAllIsPutBack) {
  struct Brake {
    const TCHAR* name;
    float value, released;
    IConsoleVariable::ShimPriority priority;
  };
  const Brake brakes[] = {{TEXT("t.MaxFPS"), 72.0f, 100000.0f, IConsoleVariable::kShimConsole},
                          {TEXT("t.IdleWhenNotForeground"), 1.0f, 0.0f, IConsoleVariable::kShimProject},
                          {TEXT("r.VSync"), 1.0f, 0.0f, IConsoleVariable::kShimCode},
                          {TEXT("r.VSyncEditor"), 1.0f, 0.0f, IConsoleVariable::kShimConstructor},
                          {TEXT("r.DontLimitOnBattery"), 0.0f, 1.0f, IConsoleVariable::kShimConstructor}};
  const auto variable = [](const Brake& brake) { return IConsoleManager::Get().FindConsoleVariable(brake.name); };
  for (const Brake& brake : brakes)
    variable(brake)->ShimForget(), variable(brake)->ShimSet(brake.value, brake.priority);
  const auto fast = [&] {
    bool all = !GEditor->ShimSleeps() && UEditorEngine::ShimFrameLimit() > 10000.0f;
    for (const Brake& brake : brakes) all = all && variable(brake)->GetFloat() == brake.released;
    return all;
  };
  const auto untouched = [&] {
    bool all = GEditor->ShimSleeps();
    for (const Brake& brake : brakes)
      all = all && variable(brake)->GetFloat() == brake.value && variable(brake)->ShimSetBy() == brake.priority;
    return all;
  };
  for (const int end : {0, 1, 2, 3}) {
    Shim::Game game;
    RoadAgent agent(game, 1);
    AConsacTrainer* trainer = Trainer(game, EConsacMode::Train);
    EXPECT_TRUE(untouched());
    for (int k = 0; k < 3; ++k) game.Tick();
    EXPECT_TRUE(fast());
    if (end == 0) trainer->StopTraining();
    if (end == 1) Shim::Destroy(*trainer);
    if (end == 2) game.Travel();
    if (end < 3) {
      EXPECT_TRUE(untouched()) << end;
    }
  }
  EXPECT_TRUE(untouched());
  {
    Shim::Game game;
    RoadAgent agent(game, 1);
    Trainer(game, EConsacMode::Serve);
    for (int k = 0; k < 3; ++k) game.Tick();
    EXPECT_TRUE(untouched()) << "nobody trains yet";
    AConsacTrainer* slow = Trainer(game, EConsacMode::Train);
    slow->bFullSpeed = false;
  }
  for (const Brake& brake : brakes) variable(brake)->ShimForget();
}

TEST(Lifetime, TheGameWaitsOnceForThePicturesOfADecision) {
  Shim::Game game;
  std::vector<std::unique_ptr<RoadAgent>> agents;
  for (int k = 0; k < 3; ++k) {
    agents.push_back(std::make_unique<RoadAgent>(game, static_cast<std::uint64_t>(k) + 1));
    auto* camera = game.AddComponent<UConsacCameraSensorComponent>(*agents.back()->actor);
    camera->Width = camera->Height = 4;
  }
  Trainer(game, EConsacMode::ByHand);
  USceneCaptureComponent2D::shim_asked_.clear();
  game.Tick();
  EXPECT_EQ(USceneCaptureComponent2D::shim_asked_, "CCCRRRW");
  game.Tick();
  EXPECT_EQ(USceneCaptureComponent2D::shim_asked_, "CCCRRRWCCCRRRW");
  // A game that draws nothing asks for nothing, and sees black.
  FApp::ShimSetRenders(false);
  auto* camera = agents[0]->actor->FindComponentByClass<UConsacCameraSensorComponent>();
  const TArray<float> seen = camera->GetSensorValues();
  FApp::ShimSetRenders(true);
  ASSERT_EQ(seen.Num(), 16);
  for (const float number : seen) EXPECT_EQ(number, 0.0f);
  EXPECT_EQ(USceneCaptureComponent2D::shim_asked_, "CCCRRRWCCCRRRWC");
  for (const auto& agent : agents)
    for (UActorComponent* component : agent->actor->shim_components_)
      if (component->ShimClass()->ShimIsA(USceneCaptureComponent2D::StaticClass())) {
        EXPECT_FALSE(static_cast<USceneCaptureComponent2D*>(component)->bCaptureOnMovement);
      }
}

}  // namespace
}  // namespace consac::testing
