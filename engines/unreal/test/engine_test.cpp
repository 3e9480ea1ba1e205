// What the engine does of itself: programs whose handle is closed, lines taken apart, limits of frames and of ticks,
// levels that are hidden and shown, clients that run what their server runs.
#include <signal.h>
#include <sys/wait.h>

#include <chrono>
#include <cmath>
#include <fstream>

#include "Components/SceneCaptureComponent2D.h"
#include "ConsacCameraSensorComponent.h"
#include "Editor/EditorEngine.h"
#include "GameFramework/WorldSettings.h"
#include "HAL/IConsoleManager.h"
#include "Misc/App.h"
#include "graphs.h"

namespace consac::testing {
namespace {

bool Said(const std::string& what) {
  return !Shim::LogLines(what).empty();
}

/// A program that does what `lines` say, in a folder of its own; it gets that folder as $FOLDER.
FConsacProgramSettings Script(const ProgramFolder& folder, const std::string& lines) {
  const std::string path = folder.path() + "/program";
  std::ofstream(path) << "#!/bin/sh\nFOLDER='" << folder.path() << "'\n" << lines << "\n";
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  FConsacProgramSettings settings;
  settings.Program = Text(path);
  settings.RunsFolder = Text(folder.path());
  return settings;
}

/// Whether there is such a file within a minute.
bool Comes(const std::string& path) {
  return TickUntil(
      60.0, [] { std::this_thread::sleep_for(std::chrono::milliseconds(2)); },
      [&] { return std::filesystem::exists(path); });
}

TEST(Engine, AProgramGoesOnWhenNobodyHoldsIt) {
  const ProgramFolder folder("unreal_goes_on");
  FString error;
  ASSERT_TRUE(NewObject<UConsacTrainerProgram>()->Start(Script(folder, "exec sleep 120"), {}, error)) << Text(error);
  const int child = FPlatformProcess::shim_latest_;
  const int open = FPlatformProcess::shim_open_;
  const auto begun = std::chrono::steady_clock::now();
  Shim::Collect();
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(60)) << "the game stood still";
  EXPECT_EQ(FPlatformProcess::shim_open_, open - 1) << "its handle is closed";
  EXPECT_EQ(waitpid(child, nullptr, WNOHANG), 0) << "it works no more";
}

TEST(Engine, AProgramThatIsStoppedMaySaveFirstAndHoldsNobody) {
  const ProgramFolder folder("unreal_may_save");
  const std::string lines =
      "trap 'sleep 1; echo saved > \"$FOLDER/saved\"; exit' TERM\n: > \"$FOLDER/ready\"\nwhile :; do sleep 0.02; done";
  UConsacTrainerProgram* program = NewObject<UConsacTrainerProgram>();
  FString error;
  ASSERT_TRUE(program->Start(Script(folder, lines), {}, error)) << Text(error);
  ASSERT_TRUE(Comes(folder.path() + "/ready"));
  program->Stop();
  EXPECT_FALSE(program->IsRunning());
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/saved")) << "the game waited for it";
  EXPECT_TRUE(Comes(folder.path() + "/saved"));
}

TEST(Engine, AnArgumentKeepsItsBlanksOrIsRefused) {
  const ProgramFolder folder("unreal_blanks");
  const FConsacProgramSettings script =
      Script(folder, "printf '%s\\n' \"$@\" > \"$FOLDER/told\"\nmv \"$FOLDER/told\" \"$FOLDER/all\"");
  UConsacTrainerProgram* program = NewObject<UConsacTrainerProgram>();
  FString error;
  FConsacProgramSettings settings = script;
  settings.RunName = TEXT("one two");
  ASSERT_TRUE(program->Start(settings, {TEXT("--set"), TEXT("a=b c d")}, error)) << Text(error);
  ASSERT_TRUE(Comes(folder.path() + "/all"));
  std::ifstream file(folder.path() + "/all");
  const std::string all((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  EXPECT_NE(all.find("\none two\n"), std::string::npos) << all;
  EXPECT_NE(all.find("\na=b c d\n"), std::string::npos) << all;
  for (const char* name : {"one  two", " one", "one   "}) {
    settings.RunName = Text(name);
    EXPECT_FALSE(NewObject<UConsacTrainerProgram>()->Start(settings, {}, error)) << name;
    EXPECT_NE(Text(error).find("blanks"), std::string::npos) << Text(error);
  }
}

TEST(Engine, AFrameLimitThatSomebodySetsMeanwhileStays) {
  IConsoleVariable& limit = *IConsoleManager::Get().FindConsoleVariable(TEXT("t.MaxFPS"));
  IConsoleVariable& screen = *IConsoleManager::Get().FindConsoleVariable(TEXT("r.VSync"));
  limit.ShimForget(), screen.ShimForget();
  screen.ShimSet(1.0f, IConsoleVariable::kShimProject);
  EXPECT_EQ(UEditorEngine::ShimFrameLimit(), 120.0f) << "no limit is the editor's own";
  Shim::Game game;
  RoadAgent agent(game, 1);
  AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
  trainer->Mode = EConsacMode::Train;
  for (int k = 0; k < 3; ++k) game.Tick();
  EXPECT_GT(UEditorEngine::ShimFrameLimit(), 10000.0f);
  limit.ShimSet(30.0f, IConsoleVariable::kShimConsole);
  trainer->StopTraining();
  EXPECT_EQ(limit.GetFloat(), 30.0f);
  EXPECT_EQ(limit.ShimSetBy(), IConsoleVariable::kShimConsole);
  EXPECT_EQ(screen.GetFloat(), 1.0f);
  limit.ShimForget(), screen.ShimForget();
}

TEST(Engine, ATickThatItsLevelDoesNotAllowIsSaid) {
  for (const float wanted : {0.5f, 0.0001f, 0.02f}) {
    Shim::Game game;
    RoadAgent agent(game, 1);
    game.SpawnWith<AConsacTrainer>([wanted](AConsacTrainer& made) {
      made.Mode = EConsacMode::ByHand;
      made.bFixedStep = true;
      made.FixedStepSeconds = wanted;
    });
    Shim::ForgetLog();
    game.Tick();
    const double before = game.world().GetTimeSeconds();
    game.Tick();
    const double passed = game.world().GetTimeSeconds() - before;
    const bool kept = std::abs(passed - static_cast<double>(wanted)) < 1e-6;
    EXPECT_EQ(kept, wanted == 0.02f) << passed;
    EXPECT_EQ(Said("Undilated Frame Time"), !kept);
  }
  Shim::Game game;
  game.world().GetWorldSettings()->MaxUndilatedFrameTime = 1.0f;
  RoadAgent agent(game, 1);
  game.SpawnWith<AConsacTrainer>([](AConsacTrainer& made) {
    made.Mode = EConsacMode::ByHand;
    made.bFixedStep = true;
    made.FixedStepSeconds = 0.5f;
  });
  Shim::ForgetLog();
  game.Tick();
  EXPECT_FALSE(Said("Undilated Frame Time")) << "this level allows it";
}

TEST(Engine, ALevelThatIsHiddenAndShownHasOneCapture) {
  Shim::Game game;
  RoadAgent agent(game, 1);
  auto* camera = game.AddComponent<UConsacCameraSensorComponent>(*agent.actor);
  const auto captures = [&] {
    int count = 0;
    for (const UActorComponent* component : agent.actor->shim_components_)
      count += component->ShimClass()->ShimIsA(USceneCaptureComponent2D::StaticClass()) ? 1 : 0;
    return count;
  };
  EXPECT_EQ(captures(), 1);
  for (int round = 0; round < 3; ++round) {
    camera->Prepare();  // and nobody comes to read it
    Shim::Hide(*agent.actor);
    EXPECT_EQ(captures(), 0);
    const std::size_t left = Shim::Objects();
    Shim::Collect();
    EXPECT_LE(Shim::Objects() + 2, left) << "neither capture nor picture is kept";
    EXPECT_EQ(camera->GetSensorValues().Num(), camera->Width * camera->Height) << "black, while nobody sees it";
    Shim::BeginPlay(*agent.actor);
    EXPECT_EQ(captures(), 1);
  }
  camera->bGray = false;
  EXPECT_EQ(camera->GetSensorValues()[3 * 7], 7.0f) << "red counts columns, as bright as on a screen";
}

TEST(Engine, AnEnvironmentListensOnItsServerAlone) {
  Shim::Game server(NM_ListenServer), client(NM_Client);
  RoadGraph there(server), here(client);
  ASSERT_EQ(there.Setup(100, 0), EConsacResult::Success);
  ASSERT_EQ(here.Setup(100, 0), EConsacResult::Success);
  EXPECT_EQ(there.Tick(), EConsacConnection::Waiting) << Text(there.error);
  EXPECT_EQ(here.Tick(), EConsacConnection::Failed);
  EXPECT_NE(Text(here.error).find("client"), std::string::npos) << Text(here.error);
  EXPECT_EQ(here.environment().GetTrainingPort(), 0);
}

}  // namespace
}  // namespace consac::testing
