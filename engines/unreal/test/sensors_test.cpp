// What agents see without a graph: a Blueprint's own sensors, rays with tags, layers and fans, grids, looks of before.
#include <cmath>

#include "CollisionQueryParams.h"
#include "ConsacGridSensorComponent.h"
#include "ConsacRaySensorComponent.h"
#include "DrawDebugHelpers.h"
#include "Engine/HitResult.h"
#include "graphs.h"
#include "tests/allocation_counter.h"

namespace consac::testing {
namespace {

std::vector<float> Values(const TArray<float>& values) {
  return {values.begin(), values.end()};
}

/// A Blueprint class of the sensor that counts its looks: [looks, -looks].
UConsacSensorComponent* Counting(Shim::Game& game, AActor& actor, FConsacSpace space) {
  UConsacSensorComponent* sensor = game.AddComponent<UConsacSensorComponent>(actor);
  sensor->ObservationName = TEXT("count");
  sensor->shim_blueprint_GetSeenSpace = [space] { return space; };
  sensor->shim_blueprint_Look = [looks = 0](TArray<float>& values) mutable {
    ++looks;
    values = {static_cast<float>(looks), static_cast<float>(-looks)};
  };
  return sensor;
}

FConsacSpace Two() {
  return UConsacBlueprintLibrary::MakeBoxSpace(2, -1000.0f, 1000.0f);
}

TEST(Sensors, ABlueprintsOwnIsAnObservation) {
  Shim::Game game;
  AActor* actor = NewObject<AConsacTestActor>(&game.world());
  UConsacSensorComponent* sensor = Counting(game, *actor, Two());
  RoadAgent agent(game, 1, actor);
  std::vector<std::string> errors;
  AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
  trainer->Mode = EConsacMode::ByHand;
  trainer->OnTrainerError.ShimBind(nullptr, [&errors](const FString& error) { errors.push_back(Text(error)); });
  for (int k = 0; k < 10; ++k) game.Tick();
  EXPECT_EQ(errors, std::vector<std::string>());
  EXPECT_GT(agent.steps, 5);
  EXPECT_GT(sensor->GetSensorValues()[0], 8.0f) << "it looked at every step";
  EXPECT_EQ(sensor->GetSpace().Size, 2);
}

TEST(Sensors, LooksOfBeforeAreSeenTooUntilAnEpisodeBegins) {
  Shim::Game game;
  AActor* actor = game.Spawn<AConsacTestActor>();
  UConsacSensorComponent* sensor = Counting(game, *actor, Two());
  sensor->Stack = 3;
  EXPECT_EQ(sensor->BeginStack().Size, 6);
  TArray<float> seen;
  sensor->ForgetLooks();
  sensor->SenseStacked(seen);
  EXPECT_EQ(Values(seen), (std::vector<float>{1, -1, 1, -1, 1, -1})) << "the first stands for those before";
  sensor->SenseStacked(seen);
  sensor->SenseStacked(seen);
  EXPECT_EQ(Values(seen), (std::vector<float>{1, -1, 2, -2, 3, -3}));
  const float* memory = seen.GetData();
  for (int k = 0; k < 100; ++k) sensor->SenseStacked(seen);
  EXPECT_EQ(seen.GetData(), memory) << "no tick asks for memory";
  sensor->ForgetLooks();
  sensor->SenseStacked(seen);
  EXPECT_EQ(Values(seen), (std::vector<float>{104, -104, 104, -104, 104, -104}));
  // Bounds of each number are there for each look, a bound of all stays one.
  FConsacSpace bounded = Two();
  bounded.Low = {-5.0f, -6.0f};
  sensor->shim_blueprint_GetSeenSpace = [bounded] { return bounded; };
  EXPECT_EQ(Values(sensor->BeginStack().Low), (std::vector<float>{-5, -6, -5, -6, -5, -6}));
  EXPECT_EQ(sensor->BeginStack().High.Num(), bounded.High.Num() > 1 ? 6 : 1);
  // A picture of two points and one channel has three of them.
  FConsacSpace picture = Two();
  picture.Shape = {1, 2, 1};
  sensor->shim_blueprint_GetSeenSpace = [picture] { return picture; };
  const FConsacSpace stacked = sensor->BeginStack();
  ASSERT_EQ(stacked.Shape.Num(), 3);
  EXPECT_EQ(stacked.Shape[2], 3);
  sensor->SenseStacked(seen);
  EXPECT_EQ(Values(seen), (std::vector<float>{104, 104, 105, -104, -104, -105}));
}

TEST(Sensors, AnEpisodeSeesNothingOfTheOneBefore) {
  Shim::Game game;
  AActor* actor = NewObject<AConsacTestActor>(&game.world());
  UConsacSensorComponent* sensor = Counting(game, *actor, Two());
  sensor->Stack = 3;
  RoadAgent agent(game, 1, actor);
  agent.agent->MaxEpisodeSteps = 3;
  int torn = 0, begun = 0, looks = 0, first = 0;
  agent.agent->OnEpisodeBegin.ShimBind(agent.agent, [&](UConsacAgentComponent*, int64) {
    looks = 0;
    ++begun;
  });
  sensor->shim_blueprint_Look = [&looks](TArray<float>& values) {
    values = {static_cast<float>(looks), 0.0f};
    ++looks;
  };
  AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
  trainer->Mode = EConsacMode::ByHand;
  agent.agent->OnAction.ShimBind(agent.agent, [&](UConsacAgentComponent* which) {
    TArray<float> seen;
    if (which->GetEpisodeSteps() == 0) {
      const int before = looks;
      sensor->SenseStacked(seen);
      looks = before;
      ++first;
      torn += seen[0] != 0.0f ? 1 : 0;  // no look of the episode before
    }
  });
  for (int k = 0; k < 20; ++k) game.Tick();
  EXPECT_GT(begun, 3);
  EXPECT_GT(first, 3) << "it was looked at";
  EXPECT_EQ(torn, 0);
}

TEST(Sensors, WhatIsNoNumberIsNotStacked) {
  Shim::Game game;
  AActor* actor = NewObject<AConsacTestActor>(&game.world());
  UConsacSensorComponent* sensor = Counting(game, *actor, UConsacBlueprintLibrary::MakeDiscreteSpace(3));
  sensor->Stack = 2;
  RoadAgent agent(game, 1, actor);
  std::vector<std::string> errors;
  AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
  trainer->Mode = EConsacMode::ByHand;
  trainer->OnTrainerError.ShimBind(nullptr, [&errors](const FString& error) { errors.push_back(Text(error)); });
  game.Tick();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("set Stack to 1"), std::string::npos) << errors[0];
}

TEST(Sensors, RaysKnowTagsLayersAndHeights) {
  Shim::Game game;
  AActor* coin = game.Spawn<AConsacTestActor>();
  coin->Tags.Add(TEXT("Coin"));
  // Something above only: whatever goes up hits the coin half way.
  game.world().shim_trace_ = [coin](FHitResult& hit, const FVector& start, const FVector& end) {
    if (end.Z <= start.Z + 1.0) return false;
    hit.Time = 0.5f;
    hit.shim_actor_ = coin;
    return true;
  };
  UConsacRaySensorComponent* rays = game.AddComponent<UConsacRaySensorComponent>(*game.Spawn<AConsacTestActor>());
  rays->Rays = 2;
  rays->SpreadDegrees = 90.0f;
  rays->Fans = 3;
  rays->FanSpreadDegrees = 60.0f;
  rays->DetectableTags = {FName(TEXT("wall")), FName(TEXT("coin"))};
  rays->MoreChannels.Add(ECC_Visibility);
  EXPECT_EQ(rays->GetSpace().Size, 2 * 3 * 2 * 3);
  const std::vector<ECollisionChannel> before = std::exchange(Shim::blocked_channels, {ECC_Pawn});
  const std::vector<float> seen = Values(rays->GetSensorValues());
  Shim::blocked_channels = before;
  std::vector<float> expected;
  for (int layer = 0; layer < 2; ++layer)
    for (int fan = 0; fan < 3; ++fan)
      for (int ray = 0; ray < 2; ++ray) {
        const bool hit = layer == 0 && fan == 2;  // the highest, where the first channel is blocked
        expected.insert(expected.end(), {hit ? 0.5f : 1.0f, 0.0f, hit ? 1.0f : 0.0f});
      }
  EXPECT_EQ(seen, expected);
  rays->Stack = 3;
  rays->BeginStack();
  TArray<float> again;
  rays->SenseStacked(again);
  const std::int64_t allocations = AllocationCount();
  for (int k = 0; k < 10; ++k) rays->SenseStacked(again);
  EXPECT_EQ(AllocationCount(), allocations) << "no tick asks for memory";
}

TEST(Sensors, RaysAreDrawnToTheirEnds) {
  Shim::Game game;
  game.world().shim_trace_ = [](FHitResult& hit, const FVector&, const FVector& end) {
    hit.Time = 0.25f;
    return end.X > 0.0;
  };
  UConsacRaySensorComponent* rays = game.AddComponent<UConsacRaySensorComponent>(*game.Spawn<AConsacTestActor>());
  rays->Rays = 2;  // ahead and behind
  Shim::lines.clear();
  rays->GetSensorValues();
  EXPECT_TRUE(Shim::lines.empty());
  rays->bDraw = true;
  rays->GetSensorValues();
  ASSERT_EQ(Shim::lines.size(), 2u);
  EXPECT_NEAR(Shim::lines[0].to.X, 250.0, 1e-9);
  EXPECT_NEAR(Shim::lines[1].to.X, -1000.0, 1e-9);
  EXPECT_GT(Shim::lines[0].color.R, Shim::lines[0].color.G);
  EXPECT_LT(Shim::lines[1].color.R, Shim::lines[1].color.G);
}

TEST(Sensors, AGridIsAPictureOfWhatIsAround) {
  Shim::Game game;
  AActor* owner = game.Spawn<AConsacTestActor>(FVector(1000.0, 0.0, 0.0));
  AActor* coin = game.Spawn<AConsacTestActor>(FVector(1100.0, -90.0, 0.0));  // ahead, to the left
  AActor* wall = game.Spawn<AConsacTestActor>(FVector(900.0, 110.0, 0.0));   // behind, to the right
  game.Spawn<AConsacTestActor>(FVector(1100.0, 0.0, 80.0));                  // above the grid
  coin->Tags.Add(TEXT("coin"));
  wall->Tags.Add(TEXT("wall"));
  UConsacGridSensorComponent* grid = game.AddComponent<UConsacGridSensorComponent>(*owner);
  grid->Rows = 3;
  grid->Columns = 3;
  EXPECT_EQ(Values(grid->GetSensorValues()), (std::vector<float>{1, 0, 0, 0, 0, 0, 0, 0, 1}));
  grid->DetectableTags = {FName(TEXT("wall")), FName(TEXT("coin"))};
  const FConsacSpace space = grid->GetSpace();
  EXPECT_EQ(space.Size, 18);
  ASSERT_EQ(space.Shape.Num(), 3);
  EXPECT_EQ(space.Shape[2], 2);
  std::vector<float> expected(18, 0.0f);
  expected[1] = expected[16] = 1.0f;
  EXPECT_EQ(Values(grid->GetSensorValues()), expected);
  owner->SetActorLocation(FVector(0.0, 0.0, 0.0));
  EXPECT_EQ(Values(grid->GetSensorValues()), std::vector<float>(18, 0.0f));
}

}  // namespace
}  // namespace consac::testing
