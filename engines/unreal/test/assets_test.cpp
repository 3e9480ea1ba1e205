// Models as assets: imported, shown, packed, imported again, and taken wherever a path is.
#include <algorithm>

#include "AssetToolsModule.h"
#include "AutomatedAssetImportData.h"
#include "ConsacModelFactory.h"
#include "EditorFramework/AssetImportData.h"
#include "Misc/Paths.h"
#include "random_policy.h"

namespace consac::testing {
namespace {

/// A policy for the road with random weights.
Policy RoadPolicy(std::uint64_t seed, int seen = 2) {
  Rng rng(seed, 0);
  PolicyData data = RandomPolicyData(*Space::Box(0, 40, {seen}), *Space::Discrete(3), seen, 3, {16}, rng);
  data.behaviour = "default";
  for (float& parameter : data.parameters) parameter = static_cast<float>(rng.Between(-2.0, 2.0));
  data.training_json = R"({"algorithm": "ppo2", "steps": 20000})";
  return *Policy::Create(std::move(data), 1);
}

/// The editor with the plugin's factory.
class Assets : public ::testing::Test {
 protected:
  ~Assets() override { IAssetTools::ShimForgetAll(); }
  void Write(std::uint64_t seed, const std::string& name = "road", int seen = 2) {
    ASSERT_TRUE(RoadPolicy(seed, seen).ToFile(1).Save(File(name)).ok());
  }
  std::string File(const std::string& name) const { return scratch_.path() + "/" + name + ".consac"; }
  /// Dragged into the Content Browser; replaces what is there.
  UConsacModel* Drag(const std::string& name) {
    auto* data = NewObject<UAutomatedAssetImportData>();
    data->DestinationPath = TEXT("/Game/Models");
    data->Filenames = {Text(File(name))};
    data->bReplaceExisting = true;
    const TArray<UObject*> made = FAssetToolsModule::GetModule().Get().ImportAssetsAutomated(data);
    return made.IsEmpty() ? nullptr : static_cast<UConsacModel*>(made[0]);
  }
  /// What it chooses at each of some places.
  static std::vector<int> Choices(UConsacModel& model) {
    std::vector<int> choices;
    for (float place = 0.0f; place <= 40.0f; place += 2.0f) {
      EConsacResult result = EConsacResult::Failed;
      FConsacAction action;
      FString error;
      model.Predict({place, 40.0f - place}, true, result, action, error);
      EXPECT_EQ(result, EConsacResult::Success) << Text(error);
      choices.push_back(action.Choice);
    }
    return choices;
  }

  const ScratchFolder scratch_{"unreal_assets"};
  Shim::Game game_;
  Shim::Held held_;
  UConsacModelFactory* factory_ = [this] {
    auto* made = NewObject<UConsacModelFactory>();
    held_.Hold(made);
    return made;
  }();
};

TEST_F(Assets, AFileThatIsDraggedInShowsWhatIsInside) {
  Write(1);
  const UConsacModel* model = Drag("road");
  ASSERT_NE(model, nullptr);
  EXPECT_EQ(Text(model->GetName()), "road");
  EXPECT_EQ(Text(model->Behaviour), "default");
  EXPECT_EQ(Text(model->Algorithm), "ppo2");
  EXPECT_EQ(model->TrainedSteps, 20000);
  EXPECT_EQ(model->ObservationSize, 2);
  EXPECT_EQ(model->ActionSize, 1);
  EXPECT_GT(model->Parameters, 0);
  ASSERT_EQ(model->Sees.Num(), 1);
  EXPECT_NE(Text(model->Sees[0]).find("Box"), std::string::npos) << Text(model->Sees[0]);
  EXPECT_FALSE(model->bRemembers);
  EXPECT_TRUE(model->shim_dirty_) << "the editor asks whether to save it";
}

TEST_F(Assets, WhatIsNoModelBecomesNoAsset) {
  ASSERT_TRUE(WriteFileAtomically(File("broken"), std::as_bytes(std::span("not a model"))).ok());
  const std::size_t before = Shim::Objects();
  EXPECT_EQ(Drag("broken"), nullptr);
  EXPECT_EQ(IAssetTools::ShimAsset("/Game/Models/broken"), nullptr);
  Shim::Collect();
  EXPECT_LE(Shim::Objects(), before + 1);  // its package
}

// A packaged game has the asset and no file.
TEST_F(Assets, APackedAssetActsWithoutAFile) {
  Write(2);
  UConsacModel* model = Drag("road");
  ASSERT_NE(model, nullptr);
  UConsacModel* packed = NewObject<UConsacModel>();
  packed->ShimLoad(*model);
  std::filesystem::remove(File("road"));
  EXPECT_EQ(Choices(*packed), Choices(*model));
  EXPECT_EQ(packed->TrainedSteps, 20000);
  // By a trainer, too.
  RoadAgent agent(game_, 1);
  AConsacTrainer* trainer = game_.SpawnWith<AConsacTrainer>([&](AConsacTrainer& made) {
    made.Mode = EConsacMode::Act;
    FConsacBehaviourModel row;
    row.Model = packed;
    row.Path = TEXT("no/such/file.consac");
    made.Models.Add(row);
  });
  for (int k = 0; k < 5; ++k) game_.Tick();
  EXPECT_TRUE(trainer->IsTraining()) << "the asset wins over the path";
  EXPECT_GT(agent.steps, 2);
}

TEST_F(Assets, ImportedAgainItStaysTheSameObjectWithTheNewFile) {
  Write(3);
  UConsacModel* model = Drag("road");
  ASSERT_NE(model, nullptr);
  const std::vector<int> first = Choices(*model);
  Write(4);
  EXPECT_EQ(Drag("road"), model) << "whoever refers to it goes on";
  const std::vector<int> second = Choices(*model);
  EXPECT_NE(second, first);
  Write(3);
  EXPECT_TRUE(FReimportHandler::ShimReimport(model));
  EXPECT_EQ(Choices(*model), first);
  EXPECT_GT(model->shim_edited_, 2) << "the Details panel is told";
  // From another place.
  Write(4, "elsewhere");
  factory_->SetReimportPaths(model, {Text(File("elsewhere"))});
  EXPECT_TRUE(FReimportHandler::ShimReimport(model));
  EXPECT_EQ(Choices(*model), second);
  // A damaged file changes nothing.
  ASSERT_TRUE(WriteFileAtomically(File("elsewhere"), std::as_bytes(std::span("damaged"))).ok());
  EXPECT_FALSE(FReimportHandler::ShimReimport(model));
  EXPECT_EQ(Choices(*model), second);
  EXPECT_FALSE(FReimportHandler::ShimReimport(NewObject<UConsacModel>())) << "it was imported from nowhere";
}

TEST_F(Assets, OneThatDoesNotFitIsToldInALine) {
  Write(5, "wide", 3);
  UConsacModel* model = Drag("wide");
  ASSERT_NE(model, nullptr);
  RoadAgent agent(game_, 1);
  std::vector<std::string> errors;
  const auto begin = [&](UConsacModel* asset) {
    errors.clear();
    AConsacTrainer* trainer = game_.SpawnWith<AConsacTrainer>([&](AConsacTrainer& made) {
      made.Mode = EConsacMode::Act;
      made.OnTrainerError.ShimBind(nullptr, [&errors](const FString& error) { errors.push_back(Text(error)); });
      FConsacBehaviourModel row;
      row.Model = asset;
      made.Models.Add(row);
    });
    game_.Tick();
    EXPECT_FALSE(trainer->IsTraining());
    Shim::Destroy(*trainer);
    return errors.size() == 1 ? errors[0] : "lines: " + std::to_string(errors.size());
  };
  EXPECT_NE(begin(model).find("3"), std::string::npos);
  EXPECT_NE(begin(NewObject<UConsacModel>()).find("is empty"), std::string::npos) << errors[0];
}

TEST_F(Assets, AButtonMakesAssetsOfWhatWasTrained) {
  FPaths::ShimSetProject(scratch_.path());
  std::vector<std::string> errors;
  AConsacTrainer* trainer = game_.SpawnWith<AConsacTrainer>([&](AConsacTrainer& made) {
    made.bAutoStart = false;
    made.SaveFolder = TEXT("my road.1");
    made.OnTrainerError.ShimBind(nullptr, [&errors](const FString& error) { errors.push_back(Text(error)); });
  });
  trainer->ImportModels();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("train first"), std::string::npos) << errors[0];
  trainer->Program.Program = TEXT("/no/such/program");
  trainer->StartProgram();
  errors.clear();
  const std::string saved = scratch_.path() + "/Saved/Consac/";
  std::filesystem::create_directories(saved + "my road.1");
  std::filesystem::create_directories(saved + "unreal");
  for (const char* name : {"my road.1/default", "my road.1/default.stopped", "my road.1/default.before",
                           "my road.1/enemy.fast", "unreal/model"})
    ASSERT_TRUE(RoadPolicy(6).ToFile(1).Save(saved + name + ".consac").ok());
  trainer->ImportModels();
  EXPECT_EQ(errors, std::vector<std::string>());
  auto* model = static_cast<UConsacModel*>(IAssetTools::ShimAsset("/Game/Consac/my_road_1/default"));
  ASSERT_NE(model, nullptr);
  EXPECT_NE(IAssetTools::ShimAsset("/Game/Consac/my_road_1/enemy.fast"), nullptr) << "a behaviour with a dot";
  EXPECT_NE(IAssetTools::ShimAsset("/Game/Consac/unreal/model"), nullptr) << "what the program made";
  EXPECT_EQ(IAssetTools::ShimAsset("/Game/Consac/my_road_1/default.stopped"), nullptr);
  EXPECT_EQ(IAssetTools::ShimAsset("/Game/Consac/my_road_1/default.before"), nullptr);
  const std::vector<int> before = Choices(*model);
  ASSERT_TRUE(RoadPolicy(7).ToFile(1).Save(saved + "my road.1/default.consac").ok());
  trainer->ImportModels();
  EXPECT_EQ(IAssetTools::ShimAsset("/Game/Consac/my_road_1/default"), model);
  EXPECT_NE(Choices(*model), before);
  // Files that become no assets are told of, and a run is looked for where the program puts it.
  trainer->SaveFolder = FString();
  trainer->Program.RunsFolder = TEXT("all");
  trainer->Program.RunName = FString();
  EXPECT_EQ(Text(trainer->Program.GetRunsFolder()), saved + "all");
  std::filesystem::create_directories(saved + "all/unreal");
  ASSERT_TRUE(WriteFileAtomically(saved + "all/unreal/model.consac", std::as_bytes(std::span("broken"))).ok());
  trainer->ImportModels();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("1 of 1 models of " + saved + "all/unreal became no assets"), std::string::npos)
      << errors[0];
  FPaths::ShimSetProject(".");
}

}  // namespace
}  // namespace consac::testing
