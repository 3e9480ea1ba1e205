// The hello level: what a menu's entry builds in the open editor, and that it learns when Play is pressed.
#include <algorithm>
#include <cmath>

#include "Components/DirectionalLightComponent.h"
#include "Components/SkyLightComponent.h"
#include "ConsacLane.h"
#include "ConsacLaneCamera.h"
#include "Editor.h"
#include "Editor/EditorEngine.h"
#include "Engine/DirectionalLight.h"
#include "Engine/SkyLight.h"
#include "Engine/StaticMeshActor.h"
#include "FileHelpers.h"
#include "Framework/Docking/TabManager.h"
#include "GameFramework/PlayerController.h"
#include "Misc/MessageDialog.h"
#include "Misc/Paths.h"
#include "ToolMenus.h"
#include "UObject/UObjectIterator.h"
#include "graphs.h"

namespace consac::testing {
namespace {

/// The editor, in which a person chooses the entry.
class HelloLevel : public ::testing::Test {
 protected:
  HelloLevel() {
    UToolMenus::ShimStart();
    FPaths::ShimSetProject(scratch_.path());
    FMessageDialog::shim_told_.clear();
    FEditorFileUtils::shim_asked_ = 0;
    FEditorFileUtils::shim_answer_ = true;
    Shim::packaged = false;
  }
  ~HelloLevel() override {
    Shim::packaged = true;
    FGlobalTabmanager::Get()->ShimClose(u"ConsacPanel");
    UEditorLoadingAndSavingUtils::ShimCloseLevel();
    FPaths::ShimSetProject(".");
  }
  /// The level that is open then; null where there is none.
  static UWorld* Choose() {
    EXPECT_TRUE(UToolMenus::ShimChoose(u"LevelEditor.MainMenu.Tools", u"ConsacHelloLevel"));
    for (TObjectIterator<UWorld> at; at; ++at)
      if (IsValid(*at) && (*at)->WorldType == EWorldType::Editor) return *at;
    return nullptr;
  }
  static std::string Told() {
    EXPECT_EQ(FMessageDialog::shim_told_.size(), 1u);
    return FMessageDialog::shim_told_.empty() ? "" : Text(FMessageDialog::shim_told_.back());
  }
  template <class T>
  static std::vector<T*> All(const UWorld& world) {
    std::vector<T*> found;
    for (AActor* actor : world.shim_actors_)
      if (actor->ShimClass()->ShimIsA(T::StaticClass())) found.push_back(static_cast<T*>(actor));
    return found;
  }

  const ScratchFolder scratch_{"unreal_hello"};
};

TEST_F(HelloLevel, HasLightFloorCameraTrainerAndWalkersAndSaysWhatToDo) {
  UWorld* level = Choose();
  ASSERT_NE(level, nullptr);
  EXPECT_EQ(FEditorFileUtils::shim_asked_, 1) << "about unsaved work";
  ASSERT_EQ(All<ADirectionalLight>(*level).size(), 1u);
  const ADirectionalLight* sun = All<ADirectionalLight>(*level)[0];
  EXPECT_LT(sun->shim_turned_.Pitch, -20.0) << "from above";
  const auto* rays = sun->FindComponentByClass<UDirectionalLightComponent>();
  EXPECT_TRUE(rays->shim_mobility_ == EComponentMobility::Movable && rays->bAtmosphereSunLight);
  ASSERT_EQ(All<ASkyLight>(*level).size(), 1u);
  EXPECT_TRUE(All<ASkyLight>(*level)[0]->FindComponentByClass<USkyLightComponent>()->shim_captures_);
  ASSERT_EQ(All<AStaticMeshActor>(*level).size(), 1u);
  EXPECT_NE(All<AStaticMeshActor>(*level)[0]->FindComponentByClass<UStaticMeshComponent>()->shim_mesh_, nullptr);
  ASSERT_EQ(All<AConsacTrainer>(*level).size(), 1u);
  const AConsacTrainer* trainer = All<AConsacTrainer>(*level)[0];
  EXPECT_TRUE(trainer->Mode == EConsacMode::Train && trainer->bAutoStart);
  EXPECT_FALSE(trainer->IsTraining()) << "nothing plays in an editor";
  EXPECT_EQ(Text(trainer->GetActorLabel()), "Trainer");
  EXPECT_EQ(All<AConsacLane>(*level).size(), 8u);
  for (const AActor* actor : level->shim_actors_) EXPECT_FALSE(actor->shim_label_.IsEmpty()) << Text(actor->GetName());
  EXPECT_TRUE(level->shim_dirty_) << "the editor asks before it is lost";
  EXPECT_NE(Told().find("1. Press Play."), std::string::npos) << Told();
  EXPECT_TRUE(FGlobalTabmanager::Get()->ShimOpen(u"ConsacPanel").IsValid()) << "the panel opens with it";
}

// The camera looks at the middle of the lanes, and has all of them in its 90 degrees.
TEST_F(HelloLevel, ItsCameraSeesAllLanes) {
  UWorld* level = Choose();
  ASSERT_NE(level, nullptr);
  ASSERT_EQ(All<AConsacLaneCamera>(*level).size(), 1u);
  const AConsacLaneCamera* camera = All<AConsacLaneCamera>(*level)[0];
  const FVector from = camera->GetActorLocation();
  const double pitch = camera->shim_turned_.Pitch * std::acos(-1.0) / 180.0;
  EXPECT_EQ(camera->shim_turned_.Yaw, 90.0) << "along +Y";
  for (const AConsacLane* lane : All<AConsacLane>(*level)) {
    for (const double end : {-2000.0, 2000.0}) {
      const FVector at(end - from.X, lane->GetActorLocation().Y - from.Y, 50.0 - from.Z);
      const double ahead = at.Y * std::cos(pitch) + at.Z * std::sin(pitch);
      const double up = at.Z * std::cos(pitch) - at.Y * std::sin(pitch);
      EXPECT_GT(ahead, 0.0);
      EXPECT_LT(std::abs(at.X), ahead) << "within 45 degrees to each side";
      EXPECT_LT(std::abs(up), ahead * 9.0 / 16.0) << "in a picture of 16 to 9";
    }
  }
}

TEST_F(HelloLevel, LeavesTheOpenLevelWhereSavingWasCancelledOrAGamePlays) {
  UWorld* level = Choose();
  ASSERT_NE(level, nullptr);
  FMessageDialog::shim_told_.clear();
  FEditorFileUtils::shim_answer_ = false;
  EXPECT_EQ(Choose(), level);
  EXPECT_NE(Told().find("stays open"), std::string::npos);
  FEditorFileUtils::shim_answer_ = true;
  FMessageDialog::shim_told_.clear();
  {
    Shim::Game game(*level);
    EXPECT_EQ(Choose(), level);
    EXPECT_EQ(Told(), "A game plays: stop it, then make the hello level.");
  }
  EXPECT_EQ(FEditorFileUtils::shim_asked_, 2) << "nobody is asked for nothing";
}

TEST_F(HelloLevel, LearnsInLessThanAMinuteWhenPlayIsPressed) {
  const UWorld* level = Choose();
  ASSERT_NE(level, nullptr);
  Shim::Game game(*level);
  ASSERT_EQ(All<AConsacTrainer>(game.world()).size(), 1u);
  AConsacTrainer* trainer = All<AConsacTrainer>(game.world())[0];
  ASSERT_EQ(All<AConsacLaneCamera>(game.world()).size(), 1u);
  EXPECT_EQ(game.world().GetFirstPlayerController()->shim_view_.Get(), All<AConsacLaneCamera>(game.world())[0]);
  std::vector<std::string> errors;
  bool completed = false;
  trainer->OnTrainerError.ShimBind(nullptr, [&errors](const FString& error) { errors.push_back(Text(error)); });
  trainer->OnTrainingCompleted.ShimBind(nullptr, [&completed] { completed = true; });
  // How many ticks pass while it learns is the learner's thread's affair: here they are no frames of a screen.
  int ticks = 0;
  ASSERT_TRUE(TickUntil(
      300.0,
      [&] {
        ticks += trainer->GetTrainerProgress().State == FString(TEXT("learning")) ? 0 : 1;
        game.Tick();
      },
      [&] { return completed || !errors.empty(); }));
  EXPECT_EQ(errors, std::vector<std::string>());
  EXPECT_LT(ticks, 60 * 60) << "a minute, at 60 frames a second";
  EXPECT_TRUE(FPaths::FileExists(Text(scratch_.path() + "/Saved/Consac/hello/default.consac")));
  // They go on by what was learned: some 13 steps from coin to coin, with nobody to lead them.
  const auto coins = [&game] {
    int sum = 0;
    for (const AConsacLane* lane : All<AConsacLane>(game.world())) sum += lane->GetCoins();
    return sum;
  };
  const int before = coins();
  for (int k = 0; k < 300; ++k) game.Tick();
  EXPECT_GT(coins() - before, 80) << "of 8 walkers in 300 steps; by chance they find few";
}

}  // namespace
}  // namespace consac::testing
