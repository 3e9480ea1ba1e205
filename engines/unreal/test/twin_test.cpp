// A robot's twin: its components against RobotStudio's poses in Unreal's convention, what moves and what does not,
// limits, joints that follow, and what is refused, each in one line.
#include "twin.h"

#include "Components/StaticMeshComponent.h"
#include "Engine/StaticMesh.h"

namespace consac::testing {
namespace {

using robot::Convention;
using robot::Transform;

class Twin : public ::testing::Test {
 protected:
  Twin() {
    Put(File(), TableOf(Yumi()));
    Shim::ForgetLog();
  }
  std::string File(const std::string& name = "twin.json") const { return scratch_.path() + "/" + name; }
  /// Lines of the log that hold `part`, which is forgotten afterwards.
  static int Lines(const std::string& part) {
    const auto& log = Shim::Log();
    const auto count = std::count_if(log.begin(), log.end(),
                                     [&](const std::string& line) { return line.find(part) != std::string::npos; });
    EXPECT_EQ(log.size(), static_cast<std::size_t>(count)) << (log.empty() ? "" : log.back());
    Shim::ForgetLog();
    return static_cast<int>(count);
  }

  const ScratchFolder scratch_{"unreal_twin"};
  Shim::Game game_;
};

TArray<double> PoseOf(const robot::Robot& robot, const std::vector<double>& positions) {
  TArray<double> pose;
  for (std::size_t i = 0; i < positions.size(); ++i)
    pose.Add(AsNodesTakeIt(robot.joints[static_cast<std::size_t>(robot.position_joints[i])], positions[i]));
  return pose;
}

TEST_F(Twin, StandsWhereRobotStudioSays) {
  UConsacTwinComponent* twin = SpawnTwin(game_, File());
  const robot::Robot& robot = Yumi();
  ASSERT_EQ(twin->GetJointNames().Num(), robot.positions());
  const auto expect_reference = [&](const auto& frame_of_link) {
    const twin::Deviation off = twin::OffReference(
        robot, twin::ReferencePoses(kYumi), [&](const std::vector<double>& positions, std::int32_t link) {
          EXPECT_TRUE(twin->SetPose(PoseOf(robot, positions)));
          const Transform rebased = TransformFrom(Convention::kUnreal, frame_of_link(link));
          return rebased * Transform{Inverse(robot.joints[static_cast<std::size_t>(link) - 1].axis_turn), {}};
        });
    EXPECT_LT(off.position, 1e-5) << "m";
    EXPECT_LT(off.orientation, 0.01 * robot::kPiRadians / 180.0);
    EXPECT_GT(off.position, 1e-7) << "RobotStudio's numbers are rounded: an exact match would be a test of itself";
  };
  const auto name = [&](std::int32_t link) { return FName(*Text(robot.links[static_cast<std::size_t>(link)].name)); };
  expect_reference([&](std::int32_t link) { return FrameIn(*twin, twin->GetLinkComponent(name(link))); });
  expect_reference([&](std::int32_t link) {
    FTransform pose;
    EXPECT_TRUE(twin->GetEndEffector(name(link), pose));
    const FVector p = pose.GetLocation();
    const FQuat q = pose.GetRotation();
    return Transform{{q.X, q.Y, q.Z, q.W}, {p.X, p.Y, p.Z}};
  });
  EXPECT_TRUE(Shim::Log().empty());
}

TEST_F(Twin, AJointIsItsComponentsRollAndNothingElse) {
  UConsacTwinComponent* twin = SpawnTwin(game_, File());
  ASSERT_TRUE(twin->SetJoint(TEXT("yumi_joint_4_r"), 30.0));
  const USceneComponent* link = twin->GetLinkComponent(TEXT("yumi_link_5_r"));
  ASSERT_NE(link, nullptr);
  // FRotator(0, 0, Roll).Quaternion(), as the engine documents it.
  const double half = 15.0 * robot::kPiRadians / 180.0;
  EXPECT_NEAR(link->shim_rotation_.X, -std::sin(half), 1e-15);
  EXPECT_EQ(link->shim_rotation_.Y, 0.0);
  EXPECT_EQ(link->shim_rotation_.Z, 0.0);
  EXPECT_NEAR(link->shim_rotation_.W, std::cos(half), 1e-15);
  ASSERT_TRUE(twin->SetJoint(TEXT("gripper_r_joint"), 1.25));
  const USceneComponent* finger = twin->GetLinkComponent(TEXT("gripper_r_finger_r"));
  ASSERT_NE(finger, nullptr);
  EXPECT_NEAR(finger->shim_location_.X, 1.25, 1e-12) << "cm along X";
  EXPECT_NEAR(twin->GetJoint(TEXT("GRIPPER_R_JOINT")), 1.25, 1e-12) << "names know no capitals";
  EXPECT_NEAR(twin->GetJoint(TEXT("yumi_joint_4_r")), 30.0, 1e-12);
}

TEST_F(Twin, AJointMovesExactlyWhatHangsOnIt) {
  UConsacTwinComponent* twin = SpawnTwin(game_, File());
  const robot::Robot& robot = Yumi();
  const auto frames = [&] {
    std::vector<Transform> all;
    for (const robot::Link& link : robot.links) all.push_back(FrameIn(*twin, twin->GetLinkComponent(*Text(link.name))));
    return all;
  };
  for (const std::int32_t moved : robot.position_joints) {
    const std::vector<Transform> before = frames();
    const FName joint = *Text(robot.joints[static_cast<std::size_t>(moved)].name);
    ASSERT_TRUE(twin->SetJoint(joint, twin->GetJoint(joint) + 0.5));
    const std::vector<Transform> after = frames();
    for (std::size_t link = 0; link < before.size(); ++link) {
      bool hangs = false;
      for (auto at = static_cast<std::int32_t>(link); at > 0 && !hangs;) {
        const robot::Joint& above = robot.joints[static_cast<std::size_t>(at) - 1];
        hangs = at - 1 == moved || above.mimics == moved;
        at = above.parent;
      }
      EXPECT_EQ(after[link] != before[link], hangs) << robot.links[link].name;
    }
  }
}

TEST_F(Twin, KeepsLimitsAndMovesWhatFollows) {
  UConsacTwinComponent* twin = SpawnTwin(game_, File());
  double lower = 1.0, upper = 1.0;
  ASSERT_TRUE(twin->GetJointLimits(TEXT("yumi_joint_2_r"), lower, upper));
  EXPECT_NEAR(lower, -143.5, 1e-6);
  EXPECT_NEAR(upper, 43.5, 1e-6);
  EXPECT_TRUE(twin->SetJoint(TEXT("yumi_joint_2_r"), 1000.0));
  EXPECT_NEAR(twin->GetJoint(TEXT("yumi_joint_2_r")), 43.5, 1e-6);
  EXPECT_TRUE(twin->SetJoint(TEXT("gripper_l_joint"), 99.0));
  EXPECT_NEAR(twin->GetJoint(TEXT("gripper_l_joint")), 2.5, 1e-9);
  EXPECT_NEAR(twin->GetJoint(TEXT("gripper_l_joint_m")), 2.5, 1e-9) << "it follows";
  EXPECT_FALSE(twin->GetJointLimits(TEXT("yumi_base_link_to_body"), lower, upper)) << "fixed";
  const TArray<double> pose = twin->GetPose();
  ASSERT_TRUE(twin->SetJoint(TEXT("yumi_joint_1_l"), 12.0));
  ASSERT_TRUE(twin->SetPose(pose));
  EXPECT_EQ(twin->GetPose()[0], pose[0]);
  EXPECT_NEAR(twin->GetJoint(TEXT("yumi_joint_1_l")), 0.0, 1e-12);
  EXPECT_TRUE(Shim::Log().empty());
}

TEST_F(Twin, WhatItRefusesIsOneLineAndMovesNothing) {
  UConsacTwinComponent* twin = SpawnTwin(game_, File());
  ASSERT_TRUE(twin->SetJoint(TEXT("yumi_joint_1_r"), 10.0));
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(twin->SetJoint(TEXT("elbow"), 1.0));
  EXPECT_EQ(Lines("no joint 'elbow': there are '"), 1);
  EXPECT_FALSE(twin->SetJoint(TEXT("yumi_joint_1_r"), nothing));
  EXPECT_EQ(Lines("joint 'yumi_joint_1_r' cannot be brought to nan"), 1);
  EXPECT_FALSE(twin->SetJoint(TEXT("gripper_r_joint_m"), 1.0));
  EXPECT_EQ(Lines("follows joint 'gripper_r_joint'"), 1);
  EXPECT_FALSE(twin->SetPose({1.0, 2.0}));
  EXPECT_EQ(Lines("a pose of this robot has 16 numbers, and 2 are given"), 1);
  TArray<double> pose = twin->GetPose();
  pose[3] = nothing;
  EXPECT_FALSE(twin->SetPose(pose));
  EXPECT_EQ(Lines("cannot be brought to nan"), 1);
  pose[3] = 0.0;
  for (int k = 0; k < 100; ++k) pose.Add(0.0);
  EXPECT_FALSE(twin->SetPose(pose));
  EXPECT_EQ(Lines("and 116 are given"), 1);
  FTransform at;
  EXPECT_FALSE(twin->GetEndEffector(TEXT("hand"), at));
  EXPECT_EQ(Lines("no link 'hand': there are '"), 1);
  EXPECT_EQ(twin->GetLinkComponent(TEXT("hand")), nullptr);
  EXPECT_EQ(twin->GetJoint(TEXT("elbow")), 0.0);
  EXPECT_NEAR(twin->GetJoint(TEXT("yumi_joint_1_r")), 10.0, 1e-12);
}

TEST_F(Twin, AFileThatIsNoTwinIsOneLineAndEveryNodeStillAnswers) {
  std::string later = TableOf(Yumi());
  later.replace(later.find("\"version\": 1"), 12, "\"version\": 7");
  Put(File("later.json"), later);
  Put(File("cut.json"), TableOf(Yumi()).substr(0, 2000));
  robot::Robot capitals = Yumi();
  capitals.joints[4].name = "YUMI_JOINT_1_R";
  capitals.joints[5].name = "yumi_joint_1_r";
  capitals.joints[3].name = "another";
  Put(File("capitals.json"), TableOf(capitals));
  const std::pair<std::string, std::string> files[] = {
      {"missing.json", "missing.json"}, {"later.json", "7"}, {"cut.json", "cut.json"}, {"capitals.json", "capitals"}};
  for (const auto& [name, said] : files) {
    Shim::ForgetLog();
    UConsacTwinComponent* twin = SpawnTwin(game_, File(name));
    EXPECT_EQ(Lines(said), 1) << name;
    EXPECT_EQ(twin->GetJointNames().Num(), 0);
    EXPECT_EQ(twin->GetPose().Num(), 0);
    EXPECT_EQ(twin->GetJoint(TEXT("yumi_joint_1_r")), 0.0);
    EXPECT_EQ(twin->GetLinkComponent(TEXT("world")), nullptr);
  }
  UConsacTwinComponent* empty = SpawnTwin(game_, "");
  EXPECT_TRUE(Shim::Log().empty()) << "a graph may set one";
  FTransform pose;
  EXPECT_FALSE(empty->GetEndEffector(NAME_None, pose));
  EXPECT_FALSE(empty->SetPose({}));
  EXPECT_FALSE(empty->SetJoint(TEXT("yumi_joint_1_r"), 1.0));
  EXPECT_EQ(Lines("there is no robot"), 1) << "it says so once a second";
}

TEST_F(Twin, AGraphMaySetAnother) {
  UConsacTwinComponent* twin = SpawnTwin(game_, "");
  UConsacTwin* yumi = NewObject<UConsacTwin>(twin);
  FString error;
  ASSERT_TRUE(yumi->Load(Text(File()), error));
  twin->SetTwin(yumi);
  EXPECT_TRUE(twin->SetJoint(TEXT("yumi_joint_1_r"), 10.0));
  twin->SetTwin(yumi);
  EXPECT_EQ(twin->GetJoint(TEXT("yumi_joint_1_r")), 0.0) << "it is built anew";
  EXPECT_EQ(twin->GetOwner()->shim_components_.size(), 1 + 2 * Yumi().joints.size());
  twin->SetTwin(nullptr);
  EXPECT_EQ(twin->GetOwner()->shim_components_.size(), 1u);
  EXPECT_EQ(twin->GetJointNames().Num(), 0);
}

TEST_F(Twin, MeshesHangOnTheirLinks) {
  FConsacTwinMesh hand, lost, nobody;
  UStaticMesh* mesh = NewObject<UStaticMesh>(&game_.world());
  hand.Link = TEXT("gripper_r_base"), hand.Mesh = mesh;
  hand.Place.SetLocation(FVector(1.0, 2.0, 3.0));
  lost.Link = TEXT("gripper_l_base");
  nobody.Link = TEXT("tail"), nobody.Mesh = mesh;
  const AConsacTwinActor* actor = game_.SpawnWith<AConsacTwinActor>([&](AConsacTwinActor& made) {
    made.Robot->Path = Text(File());
    made.Robot->Meshes = {hand, lost, nobody};
  });
  TArray<UStaticMeshComponent*> shown;
  actor->GetComponents(shown);
  ASSERT_EQ(shown.Num(), 1);
  EXPECT_EQ(shown[0]->shim_mesh_, mesh);
  EXPECT_EQ(shown[0]->shim_parent_, actor->Robot->GetLinkComponent(TEXT("gripper_r_base")));
  EXPECT_EQ(RelativeOf(*shown[0]).position, (robot::Vector3{1, 2, 3}));
  ASSERT_EQ(Shim::Log().size(), 2u);
  EXPECT_NE(Shim::Log()[0].find("the mesh of link 'gripper_l_base' is missing"), std::string::npos);
  EXPECT_NE(Shim::Log()[1].find("no link 'tail'"), std::string::npos);
}

TEST_F(Twin, ALevelThatIsHiddenAndShownBuildsItAnewAndLeavesNothing) {
  UConsacTwinComponent* twin = SpawnTwin(game_, File());
  AActor* actor = twin->GetOwner();
  const std::size_t built = actor->shim_components_.size();
  EXPECT_EQ(built, 1 + 2 * Yumi().joints.size());
  ASSERT_TRUE(twin->SetJoint(TEXT("yumi_joint_1_r"), 10.0));
  for (int k = 0; k < 3; ++k) {
    Shim::Hide(*actor);
    EXPECT_EQ(actor->shim_components_.size(), 1u);
    EXPECT_FALSE(twin->SetJoint(TEXT("yumi_joint_1_r"), 10.0)) << "it does not play";
    Shim::BeginPlay(*actor);
    EXPECT_EQ(actor->shim_components_.size(), built);
    EXPECT_EQ(twin->GetJoint(TEXT("yumi_joint_1_r")), 0.0);
  }
  Shim::Collect();
  EXPECT_TRUE(twin->SetJoint(TEXT("yumi_joint_1_r"), 10.0));
  // Another of the same robot on the same actor.
  UConsacTwinComponent* second = NewObject<UConsacTwinComponent>(actor);
  second->Path = Text(File());
  second->RegisterComponent();
  EXPECT_EQ(actor->shim_components_.size(), 2 * built);
  EXPECT_EQ(second->GetJoint(TEXT("yumi_joint_1_r")), 0.0);
}

TEST_F(Twin, AComponentThatSomebodyDestroyedIsPassedOver) {
  UConsacTwinComponent* twin = SpawnTwin(game_, File());
  twin->GetLinkComponent(TEXT("yumi_link_7_r"))->DestroyComponent();
  Shim::Collect();
  EXPECT_EQ(twin->GetLinkComponent(TEXT("yumi_link_7_r")), nullptr);
  EXPECT_TRUE(twin->SetJoint(TEXT("yumi_joint_6_r"), 10.0));
  EXPECT_NEAR(twin->GetJoint(TEXT("yumi_joint_6_r")), 10.0, 1e-12);
}

}  // namespace
}  // namespace consac::testing
