// A twin that physics moves: what its constraints are told, in Unreal's units, and that its joints are read from where
// its bodies are. The stand-in simulates nothing: the test puts the bodies where they would be.
#include "Components/StaticMeshComponent.h"
#include "Engine/StaticMesh.h"
#include "PhysicsEngine/PhysicsConstraintComponent.h"
#include "consac/robot/kinematics.h"
#include "twin.h"

namespace consac::testing {
namespace {

using robot::Convention;
using robot::Transform;

class TwinPhysics : public ::testing::Test {
 protected:
  TwinPhysics() {
    Put(File(), TableOf(Yumi()));
    Shim::ForgetLog();
  }
  std::string File() const { return scratch_.path() + "/twin.json"; }
  /// YuMi with a mesh on every link that a joint moves, but `without`.
  UConsacTwinComponent* Spawn(const std::string& without = "") {
    place_.SetLocation(FVector(1.0, -2.0, 3.0));
    place_.SetRotation(FQuat(0.0, 0.6, 0.0, 0.8));
    return game_
        .SpawnWith<AConsacTwinActor>([&](AConsacTwinActor& actor) {
          actor.Robot->Path = Text(File());
          actor.Robot->Motion = EConsacTwinMotion::Physics;
          for (std::size_t j = 0; j < Yumi().joints.size(); ++j) {
            const std::string& link = Yumi().links[j + 1].name;
            if (Yumi().joints[j].position_index < 0 || link == without) continue;
            FConsacTwinMesh row;
            row.Link = *Text(link), row.Mesh = NewObject<UStaticMesh>(&game_.world()), row.Place = place_;
            actor.Robot->Meshes.Add(row);
          }
        })
        ->Robot;
  }
  template <class T>
  static std::vector<T*> All(const UConsacTwinComponent& twin) {
    TArray<T*> found;
    twin.GetOwner()->GetComponents(found);
    return {found.begin(), found.end()};
  }
  static std::size_t Joint(const char* name) { return static_cast<std::size_t>(Yumi().FindJoint(name)); }
  /// The constraint of the how manieth moved joint that is.
  static const UPhysicsConstraintComponent& Holding(const UConsacTwinComponent& twin, const char* name) {
    std::size_t at = 0;
    for (std::size_t j = 0; j < Joint(name); ++j) at += Yumi().joints[j].position_index >= 0 ? 1 : 0;
    return *All<UPhysicsConstraintComponent>(twin)[at];
  }

  const ScratchFolder scratch_{"unreal_twin_physics"};
  Shim::Game game_;
  FTransform place_;
};

TEST_F(TwinPhysics, ConstraintsHaveTheTablesLimitsAndDrivesInUnrealsUnits) {
  UConsacTwinComponent* twin = Spawn();
  EXPECT_EQ(All<UPhysicsConstraintComponent>(*twin).size(), 18u) << "14 of the arms, 4 of the fingers";
  const robot::JointDrive& drive = Yumi().joints[Joint("yumi_joint_2_r")].drive;
  const UPhysicsConstraintComponent& turns = Holding(*twin, "yumi_joint_2_r");
  EXPECT_EQ(turns.shim_linear_[0], LCM_Locked);
  EXPECT_EQ(turns.shim_swing_[0], ACM_Locked);
  EXPECT_EQ(turns.shim_swing_[1], ACM_Locked);
  EXPECT_EQ(turns.shim_twist_, ACM_Limited);
  EXPECT_NEAR(turns.shim_degrees_, 0.5f * (143.5f + 43.5f), 1e-3f) << "half the range: limits lie evenly";
  EXPECT_EQ(turns.shim_mode_, EAngularDriveMode::TwistAndSwing);
  EXPECT_TRUE(turns.shim_drives_ && turns.shim_damps_ && !turns.shim_collides_);
  EXPECT_FLOAT_EQ(turns.shim_stiffness_, 1000.0f * 1e4f) << "N m are 1e4 kg cm^2/s^2";
  EXPECT_FLOAT_EQ(turns.shim_damping_, static_cast<float>((100.0 + drive.damping) * 1e4));
  EXPECT_FLOAT_EQ(turns.shim_force_, static_cast<float>(drive.effort * 1e4));
  EXPECT_NEAR(turns.shim_roll_, 0.5 * (143.5 - 43.5), 1e-6) << "it is to go from its middle, -50 degrees, to 0";
  const UPhysicsConstraintComponent& far = Holding(*twin, "yumi_joint_4_r");
  EXPECT_EQ(far.shim_twist_, ACM_Free) << "290 degrees are no twist";
  const UPhysicsConstraintComponent& slides = Holding(*twin, "gripper_r_joint");
  EXPECT_EQ(slides.shim_linear_[0], LCM_Limited);
  EXPECT_NEAR(slides.shim_shift_, 1.25f, 1e-5f) << "cm";
  EXPECT_EQ(slides.shim_twist_, ACM_Locked);
  EXPECT_NEAR(slides.shim_x_, -1.25, 1e-9);
  EXPECT_FLOAT_EQ(slides.shim_stiffness_, 1000.0f);
  // Each holds its link's body and the body before it; the arm's first the world.
  EXPECT_EQ(turns.shim_second_->shim_parent_, nullptr) << "a body is where physics puts it";
  EXPECT_TRUE(turns.shim_second_->IsSimulatingPhysics());
  EXPECT_EQ(turns.shim_first_, Holding(*twin, "yumi_joint_1_r").shim_second_);
  EXPECT_EQ(Holding(*twin, "yumi_joint_1_r").shim_first_, nullptr);
  EXPECT_EQ(Holding(*twin, "gripper_r_joint").shim_first_, Holding(*twin, "yumi_joint_6_r").shim_second_)
      << "what is fixed to the last link is held by it";
  const auto& inertial = Yumi().links[Joint("yumi_joint_2_r") + 1].inertial;
  ASSERT_TRUE(inertial.has_value());
  EXPECT_FLOAT_EQ(turns.shim_second_->shim_mass_, static_cast<float>(inertial->mass));
  EXPECT_TRUE(Shim::Log().empty());
}

TEST_F(TwinPhysics, ANodeSetsADrivesTargetAndMovesNothingItself) {
  UConsacTwinComponent* twin = Spawn();
  const double before = twin->GetJoint(TEXT("yumi_joint_2_r"));
  EXPECT_NEAR(before, -50.0, 1e-6) << "where it was built: in the middle";
  ASSERT_TRUE(twin->SetJoint(TEXT("yumi_joint_2_r"), -20.0));
  EXPECT_NEAR(Holding(*twin, "yumi_joint_2_r").shim_roll_, 30.0, 1e-6);
  EXPECT_EQ(twin->GetJoint(TEXT("yumi_joint_2_r")), before);
  ASSERT_TRUE(twin->SetJoint(TEXT("yumi_joint_2_r"), 1000.0));
  EXPECT_NEAR(Holding(*twin, "yumi_joint_2_r").shim_roll_, 93.5, 1e-6) << "limits are kept";
  twin->bReverseDrives = true;
  ASSERT_TRUE(twin->SetJoint(TEXT("gripper_r_joint"), 2.0));
  EXPECT_NEAR(Holding(*twin, "yumi_joint_2_r").shim_roll_, -93.5, 1e-6);
  EXPECT_NEAR(Holding(*twin, "gripper_r_joint").shim_x_, -0.75, 1e-9);
  EXPECT_NEAR(Holding(*twin, "gripper_r_joint_m").shim_x_, -0.75, 1e-9) << "what follows is driven along";
  EXPECT_GT(Holding(*twin, "yumi_joint_2_r").shim_second_->shim_woken_, 0);
}

TEST_F(TwinPhysics, JointsAreReadFromWhereTheBodiesAre) {
  UConsacTwinComponent* twin = Spawn();
  robot::Kinematics kinematics(Yumi());
  const robot::PositionLimits limits = robot::LimitsOf(Yumi());
  std::vector<double> positions(limits.lower.size());
  const auto put = [&](double share) {
    for (std::size_t i = 0; i < positions.size(); ++i)
      positions[i] = limits.lower[i] + share * (limits.upper[i] - limits.lower[i]);
    kinematics.Forward(positions);
    for (std::size_t j = 0; j < Yumi().joints.size(); ++j) {
      if (Yumi().joints[j].position_index < 0) continue;
      const Transform at = TransformIn(Convention::kUnreal, kinematics.links()[j + 1]) *
                           Transform{{0.0, 0.6, 0.0, 0.8}, {1.0, -2.0, 3.0}};
      UPrimitiveComponent* body = Holding(*twin, Yumi().joints[j].name.c_str()).shim_second_;
      body->SetRelativeLocationAndRotation(FVector(at.position.x, at.position.y, at.position.z),
                                           FQuat(at.rotation.x, at.rotation.y, at.rotation.z, at.rotation.w));
    }
    game_.Tick();
  };
  for (const double share : {0.5, 0.6, 0.7, 0.8, 0.9, 0.97}) put(share);  // joint 4 turns beyond half a turn
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const robot::Joint& joint = Yumi().joints[static_cast<std::size_t>(Yumi().position_joints[i])];
    EXPECT_NEAR(twin->GetJoint(*Text(joint.name)), AsNodesTakeIt(joint, positions[i]), 1e-6) << joint.name;
  }
  FTransform hand;
  ASSERT_TRUE(twin->GetEndEffector(TEXT("gripper_r_base"), hand));
  const Transform expected =
      TransformIn(Convention::kUnreal, kinematics.links()[static_cast<std::size_t>(Yumi().FindLink("gripper_r_base"))]);
  EXPECT_LT(Norm(robot::Vector3{hand.GetLocation().X, hand.GetLocation().Y, hand.GetLocation().Z} - expected.position),
            1e-6);
  const Transform follows = FrameIn(*twin, twin->GetLinkComponent(TEXT("gripper_r_base")));
  EXPECT_LT(Norm(follows.position - expected.position), 1e-6) << "what hangs on a link goes along";
  EXPECT_TRUE(Shim::Log().empty());
  // A body that has flown off is one line, and no place that is no number.
  Holding(*twin, "yumi_joint_6_r")
      .shim_second_->SetRelativeLocationAndRotation(FVector(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0),
                                                    FQuat(std::nan(""), 0.0, 0.0, 1.0));
  game_.Tick();
  EXPECT_EQ(Shim::Log().size(), 1u);
}

TEST_F(TwinPhysics, ALinkWithoutAMeshLeavesItKinematicAndSaysSo) {
  UConsacTwinComponent* twin = Spawn("yumi_link_3_l");
  ASSERT_EQ(Shim::Log().size(), 1u);
  EXPECT_NE(Shim::Log()[0].find("link 'yumi_link_3_l' has no mesh"), std::string::npos) << Shim::Log()[0];
  EXPECT_TRUE(All<UPhysicsConstraintComponent>(*twin).empty());
  ASSERT_TRUE(twin->SetJoint(TEXT("yumi_joint_1_r"), 10.0));
  game_.Tick();
  EXPECT_NEAR(twin->GetJoint(TEXT("yumi_joint_1_r")), 10.0, 1e-9);
}

TEST_F(TwinPhysics, EndsWithItsLevelAndBeginsAnew) {
  UConsacTwinComponent* twin = Spawn();
  AActor* actor = twin->GetOwner();
  const std::size_t built = actor->shim_components_.size();
  Shim::Hide(*actor);
  EXPECT_EQ(actor->shim_components_.size(), 1u);
  game_.Tick();
  Shim::BeginPlay(*actor);
  Shim::Collect();
  game_.Tick();
  EXPECT_EQ(actor->shim_components_.size(), built);
}

}  // namespace
}  // namespace consac::testing
