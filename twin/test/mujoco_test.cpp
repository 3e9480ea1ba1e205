// Our MJCF in MuJoCo: where it has the robot, and the world that it moves. Without MuJoCo in the build what is said
// then.
#include "worlds/mujoco/mujoco.h"

#include <cmath>
#include <filesystem>
#include <memory>

#include "consac/env/buffer.h"
#include "tests/support.h"
#include "twin/test/twin_files.h"
#include "worlds/registry.h"
#include "worlds/twin_reach/twin_reach.h"
#include "worlds/yumi_reach/yumi_reach.h"

namespace consac::twin {
namespace {

using robot::Transform;
using worlds::LoadMujoco;
using worlds::ReachDynamics;
using worlds::ReachTask;
using worlds::RobotReach;
using worlds::TwinReachPhysics;

const std::string kRobots = std::string(CONSAC_SOURCE_DIR) + "/examples/robots";
const std::string kYumiHere = kRobots + "/yumi";

// Base, shoulder, upper arm and forearm, 0.4 m long, of boxes that weigh something; a finger and one that follows it.
constexpr const char* kArm = R"(<robot name="arm">
  <link name="base"/>
  <link name="shoulder">MASS</link>
  <link name="upper">MASS<collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.04 0.04"/></geometry></collision></link>
  <link name="fore">MASS<collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.03 0.03"/></geometry></collision></link>
  <link name="left">MASS</link><link name="right">MASS</link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="shoulder"/><origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="3" effort="50"/></joint>
  <joint name="lift" type="revolute"><parent link="shoulder"/><child link="upper"/><origin xyz="0 0 0.05"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="50"/></joint>
  <joint name="bend" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="50"/></joint>
  <joint name="open" type="prismatic"><parent link="fore"/><child link="left"/><origin xyz="0.2 0.01 0"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.02" velocity="1" effort="20"/></joint>
  <joint name="follow" type="prismatic"><parent link="fore"/><child link="right"/><origin xyz="0.2 -0.01 0"/><axis xyz="0 -1 0"/>
    <limit lower="0" upper="0.02" velocity="1" effort="20"/><mimic joint="open"/></joint>
</robot>)";

std::string ArmText(bool with_masses) {
  constexpr const char* kMass =
      R"(<inertial><origin xyz="0.05 0 0"/><mass value="0.5"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.002"/></inertial>)";
  std::string text = kArm;
  for (std::size_t at; (at = text.find("MASS")) != std::string::npos;) text.replace(at, 4, with_masses ? kMass : "");
  return text;
}

class InMujoco : public ::testing::Test {
 protected:
  InMujoco() : scratch_("mujoco") {}
  std::string At(const std::string& name) const { return scratch_.path() + "/" + name; }
  void ImportArm(bool with_masses = true) {
    Put(At("arm.urdf"), ArmText(with_masses));
    Import(At("arm.urdf"), "arm");
  }
  void Import(const std::string& from, const std::string& to) {
    ImportOptions options;
    options.output = At(to);
    if (to == "yumi") options.srdf = kYumiHere + "/yumi_description/urdf/yumi.srdf";
    const Result<ImportReport> report = twin::Import(from, options);
    ASSERT_TRUE(report.ok()) << report.status().message();
  }
  std::shared_ptr<const ReachTask> Task(TwinReachPhysics physics, const std::string& name = "arm") {
    const auto task = worlds::ReadTwinReach(At(name), physics);
    EXPECT_TRUE(task.ok()) << task.status().message();
    return task.ok() ? *task : nullptr;
  }

  testing::ScratchFolder scratch_;
};

#ifdef CONSAC_WITH_MUJOCO

void ExpectPart(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
}

// Ten poses of both arms, by MuJoCo's own kinematics of the MJCF that we wrote.
TEST_F(InMujoco, OurMjcfIsWhereRobotStudioSays) {
  Import(kYumiHere + "/yumi_description/urdf/yumi_calibrated.urdf", "yumi");
  const Result<robot::Robot> robot = LoadRobot(At("yumi"));
  ASSERT_TRUE(robot.ok()) << robot.status().message();
  const Result<std::shared_ptr<const ReachDynamics>> loaded = LoadMujoco(At("yumi/twin.xml"), *robot);
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  const std::unique_ptr<ReachDynamics> body = (*loaded)->Clone();
  const Deviation off =
      OffReference(*robot, ReferencePoses(kYumiHere), [&](const std::vector<double>& positions, std::int32_t link) {
        body->Place(positions);
        const robot::Quaternion turn = robot->joints[static_cast<std::size_t>(link) - 1].axis_turn;
        return body->LinkPose(link).value_or(Transform{}) * Transform{Inverse(turn), {}};
      });
  EXPECT_LT(off.position, 1e-5);
  EXPECT_LT(off.orientation, 0.01 * robot::kPiRadians / 180.0);
  EXPECT_GT(off.position, 1e-7) << "RobotStudio's numbers are rounded to 0.01 mm";
}

TEST_F(InMujoco, TheWorldIsTheKinematicOnesButForWhatMovesIt) {
  ImportArm();
  const auto plain = Task(TwinReachPhysics::kKinematic), moved = Task(TwinReachPhysics::kMujoco);
  ASSERT_TRUE(plain && moved);
  EXPECT_EQ(moved->id, "twin-reach-mujoco-v0:" + At("arm"));
  EXPECT_EQ(moved->ready, plain->ready);
  EXPECT_EQ(moved->tools[0].low, plain->tools[0].low);
  RobotReach a(plain), b(moved);
  Rng first(3, 1), second(3, 1);
  std::vector<float> row(6 + 2 * a.moving().size() + 6), other(row.size());
  a.Reset(first, row.data());
  b.Reset(second, other.data());
  EXPECT_EQ(row, other) << "the same reset is the same observation";
  EXPECT_EQ(a.Price(row.data()), b.Price(other.data()));
  const float action[3] = {1.0f, -0.5f, 0.5f};
  const worlds::StepResult kinematic = a.Step(action, first, row.data()),
                           dynamic = b.Step(action, second, other.data());
  EXPECT_EQ(kinematic.terminated, dynamic.terminated);
  double apart = 0.0;
  for (std::size_t i = 0; i < 3; ++i) apart += std::abs(static_cast<double>(row[i]) - static_cast<double>(other[i]));
  EXPECT_GT(apart, 1e-4) << "what has a mass is not there at once";
  const float hold[3] = {};
  for (int step = 0; step < 12; ++step) (void)b.Step(hold, second, other.data());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(row[i], other[i], 1e-3) << "but gets there";
}

// How many goals the tool comes to that goes straight to them.
double ShareReached(const std::shared_ptr<const ReachTask>& task, int episodes) {
  RobotReach world(task);
  Rng rng(7, 1);
  std::vector<float> row(12 + 2 * world.moving().size());
  int reached = 0;
  for (int episode = 0; episode < episodes; ++episode) {
    world.Reset(rng, row.data());
    for (std::int64_t step = 0; step < RobotReach::kSteps; ++step) {
      float action[3];
      for (std::size_t i = 0; i < 3; ++i)
        action[i] = static_cast<float>(0.3 * (world.goals()[i] - world.tools()[i]) / task->tool_reach);
      (void)world.Step(action, rng, row.data());
    }
    reached += world.Succeeds(row.data()) ? 1 : 0;
  }
  return static_cast<double>(reached) / episodes;
}

TEST_F(InMujoco, TheStraightWayArrivesAndHeavyArmsDoNotSink) {
  ImportArm();
  const auto task = Task(TwinReachPhysics::kMujoco);
  ASSERT_TRUE(task);
  EXPECT_GE(ShareReached(task, 40), 0.95);
  RobotReach world(task);
  world.Begin(std::vector<double>{0, 0, 0});
  const std::vector<double> before(world.tools().begin(), world.tools().end());
  Rng rng;
  std::vector<float> row(12 + 2 * world.moving().size());
  const float hold[3] = {};
  for (int step = 0; step < 100; ++step) (void)world.Step(hold, rng, row.data());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(world.tools()[i], before[i], 1e-4) << "m after 4 s";
}

TEST_F(InMujoco, LimitsAndFollowersAreThePhysics) {
  ImportArm();
  const Result<robot::Robot> robot = LoadRobot(At("arm"));
  ASSERT_TRUE(robot.ok());
  const auto loaded = LoadMujoco(At("arm/twin.xml"), *robot);
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  const std::unique_ptr<ReachDynamics> body = (*loaded)->Clone();
  std::vector<double> joints = {0.0, 0.0, 0.5, 0.0};
  body->Place(joints);
  body->Follow(std::vector<double>{9.0, 0.0, 0.5, 0.015}, 3.0, joints);
  EXPECT_NEAR(joints[0], 2.0, 0.02) << "its upper limit, whatever it is told";
  EXPECT_NEAR(joints[1], 0.0, 1e-3);
  EXPECT_NEAR(joints[3], 0.015, 1e-3);
  const std::int32_t left = robot->FindLink("left"), right = robot->FindLink("right"), fore = robot->FindLink("fore");
  const Transform at = Inverse(*body->LinkPose(fore));
  const double apart = Norm((at * *body->LinkPose(left)).position - (at * *body->LinkPose(right)).position);
  EXPECT_NEAR(apart, 0.02 + 2 * 0.015, 2e-3) << "the other finger follows";
  body->Place(std::vector<double>{0.1, 0.2, 0.3, 0.01});
  body->Follow(std::vector<double>{0.1, 0.2, 0.3, 0.01}, 0.0, joints);
  EXPECT_EQ(joints, (std::vector<double>{0.1, 0.2, 0.3, 0.01})) << "placed anew it is as it was told, and at once";
}

TEST_F(InMujoco, ItsStateComesBackToTheBit) {
  ImportArm();
  const std::string name = "twin-reach-mujoco-v0:" + At("arm");
  const auto play = [](VectorEnv& env, BatchBuffer& buffer, int steps, std::uint64_t seed) {
    Rng rng(seed, 1);
    std::vector<float> seen;
    for (int step = 0; step < steps; ++step) {
      auto* actions = reinterpret_cast<float*>(buffer.batch().actions);
      for (std::size_t i = 0; i < 6; ++i) actions[i] = static_cast<float>(rng.Between(-1, 1));
      env.Step({&buffer.batch(), 1});
      const auto* row = reinterpret_cast<const float*>(buffer.batch().next_observations);
      seen.insert(seen.end(), row, row + 2 * 18);
    }
    return seen;
  };
  auto first = worlds::MakeWorld(name, 2);
  ASSERT_TRUE(first.ok()) << first.status().message();
  BatchBuffer buffer((*first)->spec().behaviours[0]);
  (*first)->Reset(5, {&buffer.batch(), 1});
  (void)play(**first, buffer, 70, 1);
  StateWriter saved;
  (*first)->Visit(saved);
  const std::vector<float> on = play(**first, buffer, 70, 2);
  auto second = worlds::MakeWorld(name, 2);
  ASSERT_TRUE(second.ok());
  (*second)->Reset(99, {&buffer.batch(), 1});
  StateReader back(saved.fields());
  (*second)->Visit(back);
  ASSERT_TRUE(back.status().ok()) << back.status().message();
  EXPECT_EQ(play(**second, buffer, 70, 2), on);
}

TEST_F(InMujoco, WhatDoesNotFitIsOneLine) {
  ImportArm();
  const auto refusal = [&] {
    const auto task = worlds::ReadTwinReach(At("arm"), TwinReachPhysics::kMujoco);
    return task.ok() ? "" : task.status().message();
  };
  const std::string good = TextOf(At("arm/twin.xml"));
  std::string text = good;
  text.replace(text.find("name=\"bend\""), 11, "name=\"band\"");
  Put(At("arm/twin.xml"), text);
  ExpectPart(refusal(), "twin.xml': MuJoCo " + worlds::MujocoVersion() + " cannot take it: ");
  EXPECT_EQ(refusal().find("x0a"), std::string::npos) << "MuJoCo writes several lines: " << refusal();
  for (std::size_t at; (at = text.find("\"bend\"")) != std::string::npos;) text.replace(at, 6, "\"band\"");
  Put(At("arm/twin.xml"), text);
  ExpectPart(refusal(),
             "twin.xml': it has no joint with a motor of the name 'bend', which twin.json has; import the robot again");
  text = good;
  const std::size_t place = text.find("pos=\"", text.find("name=\"fore\"")) + 5;
  text.replace(place, text.find('"', place) - place, "0.1 0.1 0.1");
  Put(At("arm/twin.xml"), text);
  ExpectPart(refusal(), "twin.xml': its link 'fore' is not where twin.json has it; import the robot again");
  Put(At("arm/twin.xml"), good.substr(0, good.size() / 2));
  ExpectPart(refusal(), "cannot take it: ");
  std::filesystem::remove(At("arm/twin.xml"));
  ExpectPart(refusal(), "twin.xml");
  std::filesystem::remove_all(At("arm"));
  ImportArm(false);
  ExpectPart(refusal(), "with masses (--density) where it has none");
}

// Two hands that are sent into each other.
TEST_F(InMujoco, ArmsStopEachOther) {
  Import(kYumiHere + "/yumi_description/urdf/yumi_calibrated.urdf", "yumi");
  const Result<robot::Robot> robot = LoadRobot(At("yumi"));
  ASSERT_TRUE(robot.ok());
  const auto loaded = LoadMujoco(At("yumi/twin.xml"), *robot);
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  const std::unique_ptr<ReachDynamics> body = (*loaded)->Clone();
  std::vector<double> joints(static_cast<std::size_t>(robot->positions()), 0.0), told;
  const auto set = [&](std::vector<double>& positions, const std::string& name, double position) {
    positions[static_cast<std::size_t>(
        robot->joints[static_cast<std::size_t>(robot->FindJoint(name))].position_index)] = position;
  };
  const auto left = worlds::YumiLeftReadyPose();
  for (std::size_t j = 0; j < left.size(); ++j) {
    std::string name = worlds::YumiRightArm().joints[j].name;
    set(joints, name, worlds::YumiReadyPose()[j]);
    name.back() = 'l';
    set(joints, name, left[j]);
  }
  body->Place(joints);
  told = joints;
  set(told, "yumi_joint_1_r", worlds::YumiReadyPose()[0] + 0.8);
  set(told, "yumi_joint_1_l", left[0] - 0.8);
  const auto apart = [&] {
    const auto hand = [&](const char* link) { return body->LinkPose(robot->FindLink(link))->position; };
    return Norm(hand("yumi_link_7_r") - hand("yumi_link_7_l"));
  };
  const double before = apart();
  robot::Kinematics kinematics(*robot);
  kinematics.Forward(told);
  const double wanted = Norm(kinematics.links()[static_cast<std::size_t>(robot->FindLink("yumi_link_7_r"))].position -
                             kinematics.links()[static_cast<std::size_t>(robot->FindLink("yumi_link_7_l"))].position);
  body->Follow(told, 2.0, joints);
  EXPECT_LT(apart(), before - 0.05) << "they came near each other";
  EXPECT_GT(std::abs(apart() - wanted), 0.02)
      << "and not to where they were told to be: " << apart() << " m, " << wanted;
}

#else

TEST_F(InMujoco, ABuildWithoutItSaysSoInOneLine) {
  ImportArm();
  const auto world = worlds::MakeWorld("twin-reach-mujoco-v0:" + At("arm"), 1);
  ASSERT_FALSE(world.ok());
  EXPECT_NE(world.status().message().find("this build has no MuJoCo"), std::string::npos) << world.status().message();
  EXPECT_EQ(world.status().message().find('\n'), std::string::npos);
  EXPECT_EQ(worlds::MujocoVersion(), "");
  EXPECT_TRUE(worlds::MakeWorld("twin-reach-v0:" + At("arm"), 1).ok()) << "the kinematic one is there";
}

#endif

}  // namespace
}  // namespace consac::twin
