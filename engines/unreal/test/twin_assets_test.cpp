// Twins as assets: imported, shown, packed, imported again; other JSON is left to others.
#include "AssetToolsModule.h"
#include "AutomatedAssetImportData.h"
#include "ConsacTwinFactory.h"
#include "EditorFramework/AssetImportData.h"
#include "twin.h"

namespace consac::testing {
namespace {

class TwinAssets : public ::testing::Test {
 protected:
  TwinAssets() {
    factory_.Hold(NewObject<UConsacTwinFactory>());
    Shim::ForgetLog();
  }
  ~TwinAssets() override { IAssetTools::ShimForgetAll(); }
  std::string File() const { return scratch_.path() + "/twin.json"; }
  UConsacTwin* Drag() {
    auto* data = NewObject<UAutomatedAssetImportData>();
    data->DestinationPath = TEXT("/Game/Robots");
    data->Filenames = {Text(File())};
    data->bReplaceExisting = true;
    const TArray<UObject*> made = FAssetToolsModule::GetModule().Get().ImportAssetsAutomated(data);
    return made.IsEmpty() ? nullptr : static_cast<UConsacTwin*>(made[0]);
  }
  UConsacTwinFactory* factory() const { return static_cast<UConsacTwinFactory*>(factory_.object()); }

  const ScratchFolder scratch_{"unreal_twin_assets"};
  Shim::Game game_;
  Shim::Held factory_;
};

TEST_F(TwinAssets, AFileThatIsDraggedInShowsItsJointsAndPlaysWithoutTheFile) {
  Put(File(), TableOf(Yumi()));
  const UConsacTwin* twin = Drag();
  ASSERT_NE(twin, nullptr);
  EXPECT_EQ(twin->Movable, 16);
  EXPECT_EQ(Text(twin->Robot), Yumi().name);
  ASSERT_EQ(twin->Joints.Num(), static_cast<int32>(Yumi().joints.size()));
  const auto shown = [&](const std::string& line) { return twin->Joints.Contains(Text(line)); };
  EXPECT_TRUE(shown("yumi_joint_1_r: revolute, -168.5 to 168.5 degrees"));
  EXPECT_TRUE(shown("gripper_r_joint_m: prismatic, 0 to 2.5 cm, follows gripper_r_joint"));
  EXPECT_TRUE(twin->shim_dirty_) << "the editor asks whether to save it";
  // A packaged game has the asset and no file.
  UConsacTwin* packed = NewObject<UConsacTwin>();
  packed->ShimLoad(*twin);
  std::filesystem::remove(File());
  const AConsacTwinActor* actor = game_.SpawnWith<AConsacTwinActor>([&](AConsacTwinActor& made) {
    made.Robot->Twin = packed;
    made.Robot->Path = TEXT("no/such/file.json");
  });
  EXPECT_EQ(actor->Robot->GetJointNames().Num(), 16) << "the asset wins over the path";
  EXPECT_TRUE(Shim::Log().empty());
}

TEST_F(TwinAssets, ImportedAgainItStaysTheSameObjectAndADamagedFileChangesNothing) {
  Put(File(), TableOf(Yumi()));
  UConsacTwin* twin = Drag();
  ASSERT_NE(twin, nullptr);
  robot::Robot renamed = Yumi();
  renamed.name = "another";
  Put(File(), TableOf(renamed));
  EXPECT_EQ(Drag(), twin);
  EXPECT_EQ(Text(twin->Robot), "another");
  Put(File(), TableOf(renamed).substr(0, 500));
  EXPECT_EQ(Drag(), nullptr);
  EXPECT_EQ(factory()->Reimport(twin), EReimportResult::Failed);
  EXPECT_EQ(Text(twin->Robot), "another");
  Put(File(), TableOf(Yumi()));
  EXPECT_EQ(factory()->Reimport(twin), EReimportResult::Succeeded);
  EXPECT_EQ(Text(twin->Robot), Yumi().name);
  TArray<FString> files;
  EXPECT_TRUE(factory()->CanReimport(twin, files));
  ASSERT_EQ(files.Num(), 1);
  EXPECT_EQ(Text(files[0]), File());
}

TEST_F(TwinAssets, OtherJsonIsLeftToOthers) {
  Put(File(), R"({"rows": [1, 2]})");
  EXPECT_EQ(Drag(), nullptr);
  EXPECT_TRUE(Shim::Log().empty()) << "nothing of ours looked at it";
  EXPECT_FALSE(factory()->FactoryCanImport(Text(scratch_.path() + "/missing.json")));
}

}  // namespace
}  // namespace consac::testing
