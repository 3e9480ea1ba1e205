// The nodes one by one: sockets with a client at the other end, waiting, sensors, texts, the plugin's automation tests.
#include <filesystem>
#include <fstream>
#include <map>

#include "CollisionQueryParams.h"
#include "ConsacCameraSensorComponent.h"
#include "ConsacConvert.h"
#include "ConsacRaySensorComponent.h"
#include "ConsacSampleGameMode.h"
#include "ConsacTransformSensorComponent.h"
#include "Engine/HitResult.h"
#include "HAL/PlatformProcess.h"
#include "Misc/AutomationTest.h"
#include "Modules/ModuleManager.h"
#include "graphs.h"

namespace consac::testing {
namespace {

/// The engine's start and end; at the end nothing is left.
class Engine : public ::testing::Environment {
 public:
  void SetUp() override { Shim::StartModules(); }
  void TearDown() override {
    Shim::Collect();
    EXPECT_EQ(Shim::Objects(), 0U);
    Shim::StopModules();
  }
};
[[maybe_unused]] const ::testing::Environment* const kEngine = ::testing::AddGlobalTestEnvironment(new Engine);

TEST(Plugin, ItsOwnAutomationTestsHold) {
  ASSERT_FALSE(FAutomationTestBase::ShimAll().empty());
  for (const char* const run : {"once", "again at once"}) {
    for (FAutomationTestBase* test : FAutomationTestBase::ShimAll()) {
      test->ShimRun();
      for (const FString& failure : test->ShimFailures())
        ADD_FAILURE() << test->ShimName() << ", " << run << ": " << Text(failure);
    }
  }
}

TEST(Plugin, TextsSurviveTheWay) {
  for (const std::string& text : {std::string(), std::string("plain"), std::string("Õhtu € 😀 日本")}) {
    EXPECT_EQ(ConsacPlugin::ToUtf8(ConsacPlugin::FromUtf8(text)), text);
  }
}

TEST(Plugin, SpacesThatCannotBeAreNamed) {
  std::map<std::string, std::string> told;
  const auto say = [&](const char* name, const std::function<void(FConsacSpace&)>& spoil) {
    FConsacSpace space;
    spoil(space);
    const Result<Space> made = ConsacPlugin::ToSpace(space);
    return told[name] = made.ok() ? "" : made.status().message();
  };
  EXPECT_EQ(say("box", [](FConsacSpace&) {}), "");
  EXPECT_NE(say("no size", [](FConsacSpace& s) { s.Size = 0; }), "");
  EXPECT_NE(say("huge", [](FConsacSpace& s) { s.Size = 2000000000; }), "");
  EXPECT_NE(say("bounds",
                [](FConsacSpace& s) {
                  s.Size = 3;
                  s.Low = {0.0f, 1.0f};
                })
                .find("2 lower bounds"),
            std::string::npos);
  EXPECT_NE(say("order",
                [](FConsacSpace& s) {
                  s.Low = {1.0f};
                  s.High = {0.0f};
                }),
            "");
  EXPECT_NE(say("shape",
                [](FConsacSpace& s) {
                  s.Size = 6;
                  s.Shape = {2, 2};
                }),
            "");
  EXPECT_EQ(say("picture",
                [](FConsacSpace& s) {
                  s.Size = 12;
                  s.Shape = {2, 2, 3};
                  s.bBytes = true;
                }),
            "");
  EXPECT_NE(say("choices", [](FConsacSpace& s) { s.Kind = EConsacSpaceKind::MultiDiscrete; }), "");
  EXPECT_NE(say("overflow", [](FConsacSpace& s) { s.Shape = {65536, 65536, 65536}; }), "");
}

/// A socket that is open on any free port, and a client.
class SocketNodes : public ::testing::Test {
 protected:
  SocketNodes() : socket_(UConsacBlueprintLibrary::CreateConsacSocket(nullptr, TEXT("127.0.0.1"), 0)) {
    socket_->OpenSocket(result_, error_);
    client_ = std::move(*ConnectTcp({"127.0.0.1", socket_->GetOpenPort()}, 5.0));
  }

  bool Becomes(EConsacAnswer wanted, void (UConsacSocket::*look)(EConsacAnswer&, FString&)) {
    EConsacAnswer answer = wanted == EConsacAnswer::No ? EConsacAnswer::Yes : EConsacAnswer::No;
    return TickUntil(
        5.0, [&] { (socket_->*look)(answer, error_); }, [&] { return answer == wanted; });
  }
  void Say(std::string_view text) { ASSERT_TRUE(client_->Write(std::as_bytes(std::span(text)), 1.0).ok()); }
  std::string Heard() {
    std::byte bytes[64];
    const Result<std::size_t> count = client_->Read(bytes, 5.0);
    return count.ok() ? std::string(reinterpret_cast<const char*>(bytes), *count) : "";
  }

  UConsacSocket* socket_;
  std::unique_ptr<Transport> client_;
  EConsacResult result_ = EConsacResult::Failed;
  FString error_, text_;
};

TEST_F(SocketNodes, TheThesisMessagesByHand) {
  ASSERT_EQ(result_, EConsacResult::Success) << Text(error_);
  ASSERT_TRUE(Becomes(EConsacAnswer::Yes, &UConsacSocket::CheckConnection)) << Text(error_);
  socket_->AcceptConnection(result_, text_, error_);
  ASSERT_EQ(result_, EConsacResult::Success);
  EXPECT_NE(Text(text_).find("127.0.0.1"), std::string::npos);
  FString message;
  UConsacBlueprintLibrary::CompileTrainingData(RoadDone(), RoadSeen(), 10, TEXT("m"), result_, message, error_);
  socket_->SendData(message, result_, error_);
  EXPECT_EQ(result_, EConsacResult::Success);
  EXPECT_EQ(Heard(), "D#3#0#B#2#0,0,40,40#10#m\n");
  Say("2\n");
  ASSERT_TRUE(Becomes(EConsacAnswer::Yes, &UConsacSocket::CheckPendingData)) << Text(error_);
  socket_->AcceptPendingData(result_, text_, error_);
  EXPECT_EQ(Text(text_), "2");
  socket_->AcceptPendingData(result_, text_, error_);
  EXPECT_EQ(result_, EConsacResult::Failed);
  client_->Close();
  EXPECT_TRUE(Becomes(EConsacAnswer::Failed, &UConsacSocket::CheckPendingData));
  EXPECT_FALSE(socket_->IsConnected());
  EXPECT_TRUE(socket_->IsOpen());
}

/// What a Wait And Accept Message told.
struct Told {
  std::string message, timeout, failed;
  int count = 0;
  explicit Told(UConsacWaitMessageAction& action) {
    action.OnMessage.ShimBind(nullptr, [this](const FString& text, const FString&) { message = Text(text), ++count; });
    action.OnTimeout.ShimBind(nullptr,
                              [this](const FString&, const FString& error) { timeout = Text(error), ++count; });
    action.OnFailed.ShimBind(nullptr, [this](const FString&, const FString& error) { failed = Text(error), ++count; });
  }
};

TEST_F(SocketNodes, WaitAndAcceptMessage) {
  Shim::Game game;
  ASSERT_TRUE(Becomes(EConsacAnswer::Yes, &UConsacSocket::CheckConnection));
  socket_->AcceptConnection(result_, text_, error_);
  const auto wait = [&](UConsacSocket* socket, float seconds) {
    return UConsacWaitMessageAction::WaitAndAcceptMessage(&game.world(), socket, seconds);
  };

  UConsacWaitMessageAction* comes = wait(socket_, 1000.0f);
  Told told(*comes);
  comes->Activate();
  for (int k = 0; k < 10; ++k) game.Tick();
  EXPECT_EQ(told.count, 0);
  Say("1\n");
  EXPECT_TRUE(TickUntil(
      5.0, [&] { game.Tick(); }, [&] { return told.count > 0; }));
  EXPECT_EQ(told.message, "1");
  EXPECT_TRUE(comes->shim_ready_);
  for (int k = 0; k < 10; ++k) game.Tick();
  EXPECT_EQ(told.count, 1);

  UConsacWaitMessageAction* late = wait(socket_, 0.1f);
  Told late_told(*late);
  late->Activate();
  for (int k = 0; k < 10; ++k) game.Tick();
  EXPECT_NE(late_told.timeout, "");

  UConsacWaitMessageAction* nothing = wait(nullptr, 0.1f);
  Told nothing_told(*nothing);
  nothing->Activate();
  EXPECT_NE(nothing_told.failed.find("Create Socket"), std::string::npos);

  UConsacWaitMessageAction* nowhere = UConsacWaitMessageAction::WaitAndAcceptMessage(nullptr, socket_, 1.0f);
  Told nowhere_told(*nowhere);
  nowhere->Activate();
  EXPECT_NE(nowhere_told.failed, "");

  UConsacWaitMessageAction* leaves = wait(socket_, 1000.0f);
  Told leaves_told(*leaves);
  leaves->Activate();
  client_->Close();
  EXPECT_TRUE(TickUntil(
      5.0, [&] { game.Tick(); }, [&] { return leaves_told.count > 0; }));
  EXPECT_NE(leaves_told.failed, "");
  wait(socket_, 1000.0f)->Activate();  // still waits when play stops
}

TEST_F(SocketNodes, WhoeverWaitsForAMessageHearsThatItsLevelHasEnded) {
  Shim::Game game;
  ASSERT_TRUE(Becomes(EConsacAnswer::Yes, &UConsacSocket::CheckConnection));
  socket_->AcceptConnection(result_, text_, error_);
  UWorld* world = &game.world();
  const auto wait = [&] { return UConsacWaitMessageAction::WaitAndAcceptMessage(world, socket_, 1000.0f); };
  UConsacWaitMessageAction* first = wait();
  int failed = 0;
  first->OnFailed.ShimBind(nullptr, [&](const FString&, const FString& error) {
    ++failed;
    EXPECT_NE(Text(error).find("level has ended"), std::string::npos) << Text(error);
    UConsacWaitMessageAction* again = wait();  // a graph that tries again
    again->OnFailed.ShimBind(nullptr, [&](const FString&, const FString&) { ++failed; });
    again->Activate();
  });
  first->Activate();
  for (int k = 0; k < 3; ++k) game.Tick();
  EXPECT_EQ(failed, 0);
  game.Travel();
  EXPECT_EQ(failed, 1);
  game.Tick();
  EXPECT_EQ(failed, 1);
}

TEST(Sensors, RaysTransformAndCameraBecomeObservations) {
  Shim::Game game;
  // A wall at X = 500: the share of a ray before it.
  game.world().shim_trace_ = [](FHitResult& hit, const FVector& start, const FVector& end) {
    const double share = (500.0 - start.X) / (end.X - start.X);
    if (!(share >= 0.0 && share <= 1.0)) return false;
    hit.Time = static_cast<float>(share);
    return true;
  };
  AActor* actor = NewObject<AConsacTestActor>(&game.world());
  UConsacRaySensorComponent* rays = game.AddComponent<UConsacRaySensorComponent>(*actor);
  UConsacTransformSensorComponent* place = game.AddComponent<UConsacTransformSensorComponent>(*actor);
  UConsacCameraSensorComponent* camera = game.AddComponent<UConsacCameraSensorComponent>(*actor);
  rays->Rays = 4;
  rays->Length = 1000.0f;
  place->Scale = 10.0f;
  camera->Width = 4;
  camera->Height = 3;
  camera->bGray = false;
  RoadAgent agent(game, 1, actor);
  actor->SetActorLocation(FVector(100.0, -20.0, 5.0));
  ASSERT_EQ(agent.agent->GetSensors().Num(), 3);
  AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
  trainer->Mode = EConsacMode::ByHand;
  std::vector<std::string> errors;
  trainer->OnTrainerError.ShimBind(nullptr, [&errors](const FString& error) { errors.push_back(Text(error)); });
  for (int k = 0; k < 20; ++k) game.Tick();
  EXPECT_EQ(errors, std::vector<std::string>());
  EXPECT_GT(agent.steps, 10);

  const TArray<float> lengths = rays->GetSensorValues();
  ASSERT_EQ(lengths.Num(), 4);
  EXPECT_NEAR(lengths[0], 0.4f, 1e-5f);
  for (int k = 1; k < 4; ++k) EXPECT_EQ(lengths[k], 1.0f) << k;
  const TArray<float> where = place->GetSensorValues();
  ASSERT_EQ(where.Num(), 7);
  EXPECT_FLOAT_EQ(where[0], 10.0f);
  EXPECT_FLOAT_EQ(where[1], -2.0f);
  EXPECT_FLOAT_EQ(where[6], 1.0f);
  const TArray<float> picture = camera->GetSensorValues();
  ASSERT_EQ(picture.Num(), 36);
  EXPECT_EQ(picture[3 * (2 * 4 + 3)], 3.0f);      // red counts columns
  EXPECT_EQ(picture[3 * (2 * 4 + 3) + 1], 2.0f);  // green counts rows
  camera->bGray = true;
  EXPECT_NEAR(camera->GetSensorValues()[11], 0.299f * 3.0f + 0.587f * 2.0f, 1e-5f);
}

TEST(Sensors, RaysEndAtWhatBlocksTheirChannelAndSeeCharacters) {
  Shim::Game game;
  game.world().shim_trace_ = [](FHitResult& hit, const FVector&, const FVector&) {
    hit.Time = 0.25f;
    return true;
  };
  const std::vector<ECollisionChannel> before =
      std::exchange(Shim::blocked_channels, {ECC_Pawn});  // a character: to Visibility it is not there
  UConsacRaySensorComponent* rays = game.AddComponent<UConsacRaySensorComponent>(*game.Spawn<AConsacTestActor>());
  rays->Rays = 1;
  EXPECT_EQ(rays->GetSensorValues()[0], 0.25f);
  rays->Channel = ECC_Visibility;
  EXPECT_EQ(rays->GetSensorValues()[0], 1.0f);
  Shim::blocked_channels = before;
}

TEST(Sensors, ACameraThatIsGivenAnotherSizeInPlaySeesAtThatSize) {
  Shim::Game game;
  UConsacCameraSensorComponent* camera =
      game.AddComponent<UConsacCameraSensorComponent>(*game.Spawn<AConsacTestActor>());
  camera->bGray = false;
  // As many points each time; then none, as many as no picture has, and a picture again.
  for (const auto& [width, height] :
       {std::pair{4, 3}, std::pair{3, 4}, std::pair{2, 6}, std::pair{0, 4}, std::pair{5, 2}}) {
    camera->Prepare();  // what is drawn at the size of before
    camera->Width = width;
    camera->Height = height;
    const TArray<float> picture = camera->GetSensorValues();
    ASSERT_EQ(picture.Num(), 3 * width * height);
    if (width == 0) continue;
    EXPECT_EQ(picture[picture.Num() - 3], static_cast<float>(width - 1));
    EXPECT_EQ(picture[picture.Num() - 2], static_cast<float>(height - 1));
  }
}

TEST(Sensors, ACameraOfASizeThatCannotBeIsRefused) {
  for (const auto& [width, height] :
       {std::pair{-1, 84}, std::pair{0, 84}, std::pair{84, -2000000000}, std::pair{65536, 65536}}) {
    Shim::Game game;
    RoadAgent agent(game, 1);
    UConsacCameraSensorComponent* camera = NewObject<UConsacCameraSensorComponent>(agent.actor);
    agent.actor->ShimAddSubobject(camera);
    camera->Width = width;
    camera->Height = height;
    camera->RegisterComponent();
    EXPECT_EQ(camera->GetSensorValues().Num(), 0);
    EXPECT_EQ(camera->GetSpace().Size, 0);
    AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
    trainer->bAutoStart = false;
    game.Tick();
    EConsacResult result = EConsacResult::Success;
    FString error;
    trainer->StartTraining(result, error);
    EXPECT_EQ(result, EConsacResult::Failed);
    EXPECT_NE(Text(error).find("camera"), std::string::npos) << Text(error);
  }
}

TEST(Sensors, OneWithoutAnAgentSaysSo) {
  Shim::Game game;
  Shim::ForgetLog();
  game.AddComponent<UConsacRaySensorComponent>(*game.Spawn<AConsacTestActor>());
  ASSERT_EQ(Shim::Log().size(), 1U);
  EXPECT_NE(Shim::Log()[0].find("without a Consac Agent"), std::string::npos);
}

TEST(Program, WhatCannotBeStartedIsSaid) {
  FConsacProgramSettings settings;
  EConsacResult result = EConsacResult::Success;
  UConsacTrainerProgram* program = nullptr;
  FString error;
  UConsacBlueprintLibrary::StartTrainerProgram(nullptr, settings, result, program, error);
  EXPECT_EQ(result, EConsacResult::Failed);
  EXPECT_EQ(program, nullptr);
  EXPECT_NE(Text(error).find("Consac/Programs"), std::string::npos) << Text(error);
  settings.Program = Text(CONSAC_PROGRAM);
  settings.RunName = TEXT("a\"b");
  UConsacBlueprintLibrary::StartTrainerProgram(nullptr, settings, result, program, error);
  EXPECT_EQ(result, EConsacResult::Failed);
  EXPECT_NE(Text(error).find("quote"), std::string::npos) << Text(error);
}

TEST(Program, ATokenIsNotLoggedAndAnEndedProgramsHandleIsClosed) {
  const ProgramFolder scratch("unreal_token");
  FConsacProgramSettings settings;
  settings.Program = Text(CONSAC_PROGRAM);
  settings.RunsFolder = Text(scratch.path());
  settings.RunName = TEXT("secretive");
  settings.ExtraArguments = TEXT("--no-such-option");  // ends at once
  UConsacTrainerProgram* program = NewObject<UConsacTrainerProgram>();
  const int before = FPlatformProcess::shim_open_;
  Shim::ForgetLog();
  FString error;
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE(program->Start(settings, {TEXT("--token"), TEXT("open-sesame")}, error)) << Text(error);
    ASSERT_TRUE(TickUntil(
        30.0, [] { std::this_thread::sleep_for(std::chrono::milliseconds(1)); },
        [&] { return !program->IsRunning(); }));
  }
  EXPECT_EQ(FPlatformProcess::shim_open_, before + 1);
  EXPECT_FALSE(program->Start(settings, {TEXT("--token"), TEXT("open-sesame\"")}, error));
  EXPECT_EQ(Text(error).find("sesame"), std::string::npos) << Text(error);
  program->Stop();
  EXPECT_EQ(FPlatformProcess::shim_open_, before);
  ASSERT_EQ(Shim::Log().size(), 4U);
  for (const std::string& line : Shim::Log()) EXPECT_EQ(line.find("sesame"), std::string::npos) << line;
  EXPECT_NE(Shim::Log()[0].find("secretive"), std::string::npos) << Shim::Log()[0];
}

/// A program that writes its arguments into `folder`, one after another.
std::string WriteListener(const std::string& folder) {
  const std::string path = folder + "/listener.sh";
  std::ofstream(path) << "#!/bin/sh\necho \"$@\" > '" << folder << "/part'\nmv '" << folder << "/part' '" << folder
                      << "/arguments'\n";
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

/// What it was started with; removes that.
std::string HeardBy(const std::string& folder) {
  const std::string path = folder + "/arguments";
  EXPECT_TRUE(TickUntil(
      30.0, [] { std::this_thread::sleep_for(std::chrono::milliseconds(1)); },
      [&] { return std::filesystem::exists(path); }));
  std::string line;
  std::getline(std::ifstream(path), line);
  std::filesystem::remove(path);
  return line;
}

TEST(Program, ItIsSentToThePortThatIsOpen) {
  const ProgramFolder scratch("unreal_port");
  Shim::Game game;
  RoadAgent agent(game, 1);
  AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
  trainer->Port = 0;
  trainer->Program.Program = Text(WriteListener(scratch.path()));
  trainer->Program.RunsFolder = Text(scratch.path());
  std::vector<std::string> errors;
  trainer->OnTrainerError.ShimBind(nullptr, [&errors](const FString& error) { errors.push_back(Text(error)); });
  trainer->StartProgram();
  ASSERT_EQ(errors.size(), 1U) << "nothing is open yet";
  EXPECT_NE(errors[0].find("start the game first, or give a port"), std::string::npos) << errors[0];
  game.Tick();
  ASSERT_GT(trainer->GetTrainerPort(), 0);
  trainer->StartProgram();
  EXPECT_EQ(errors.size(), 1U);
  const std::string heard = HeardBy(scratch.path());
  EXPECT_NE(heard.find("tcp://127.0.0.1:" + std::to_string(trainer->GetTrainerPort()) + " "), std::string::npos)
      << heard;
}

TEST(Program, WhatListensOnEveryAddressIsReachedAtItsOwn) {
  const ProgramFolder scratch("unreal_host");
  FConsacProgramSettings settings;
  settings.Program = Text(WriteListener(scratch.path()));
  settings.RunsFolder = Text(scratch.path());
  for (const auto& [host, reached] :
       {std::pair("0.0.0.0", "127.0.0.1"), std::pair("::", "[::1]"), std::pair("10.0.0.7", "10.0.0.7")}) {
    settings.Host = Text(host);
    FString error;
    UConsacTrainerProgram* program = NewObject<UConsacTrainerProgram>();
    ASSERT_TRUE(program->Start(settings, {}, error)) << Text(error);
    const std::string heard = HeardBy(scratch.path());
    EXPECT_NE(heard.find("tcp://" + std::string(reached) + ":5005 "), std::string::npos) << heard;
  }
}

TEST(Samples, TheGameModeSpawnsTheRoad) {
  Shim::Game game;
  const std::size_t before = game.world().shim_actors_.size();
  game.Spawn<AConsacSampleGameMode>();
  EXPECT_EQ(game.world().shim_actors_.size(), before + 2);
}

}  // namespace
}  // namespace consac::testing
