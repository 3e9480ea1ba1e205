// What is worked out for a robot, what a file may say instead, and what is refused.
#include "worlds/twin_reach/twin_reach.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <span>

#include "consac/base/file.h"
#include "consac/robot/table.h"
#include "worlds/registry.h"
#include "worlds/yumi_reach/yumi_arm.h"

namespace consac::worlds {
namespace {

// Base, shoulder, upper arm, forearm and a hand with two fingers that slide, 0.4 m long; and a short arm beside it.
robot::Robot Arm() {
  robot::RobotDescription description{"arm", {{"base", std::nullopt}}, {}};
  const auto add = [&](const char* name, const char* parent, const char* child, robot::JointType type,
                       robot::Vector3 at, robot::Vector3 axis) {
    robot::JointDescription joint;
    joint.name = name, joint.type = type, joint.parent = parent, joint.child = child;
    joint.origin.position = at, joint.axis = axis;
    joint.drive = {-2.0, 2.0, 3.0};
    if (type == robot::JointType::kPrismatic) joint.drive = {0.0, 0.02, 1.0};
    description.links.push_back({child, std::nullopt});
    description.joints.push_back(joint);
  };
  add("turn", "base", "shoulder", robot::JointType::kRevolute, {0, 0, 0.1}, {0, 0, 1});
  add("lift", "shoulder", "upper", robot::JointType::kRevolute, {0, 0, 0.05}, {0, 1, 0});
  add("bend", "upper", "fore", robot::JointType::kRevolute, {0.2, 0, 0}, {0, 1, 0});
  add("finger_a", "fore", "left", robot::JointType::kPrismatic, {0.15, 0.01, 0}, {0, 1, 0});
  add("finger_b", "fore", "right", robot::JointType::kPrismatic, {0.15, -0.01, 0}, {0, -1, 0});
  add("pointer", "base", "stick", robot::JointType::kRevolute, {0, 0.5, 0}, {0, 0, 1});
  robot::Robot robot = *robot::MakeRobot(description);
  robot::Capsule fore{robot.FindLink("fore"), {}, {}, 0.02};
  const robot::Quaternion back = robot::Inverse(robot.joints[static_cast<std::size_t>(fore.link) - 1].axis_turn);
  fore.to = robot::Rotate(back, {0.18, 0, 0});
  robot.capsules.push_back(fore);
  return robot;
}

class TwinReachFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("consac-twin-reach-" + std::to_string(std::random_device()()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "arm");
    Write("arm/twin.json", robot::WriteTable(Arm(), {}));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  void Write(const std::string& name, const std::string& text) {
    ASSERT_TRUE(WriteFileAtomically(At(name), std::as_bytes(std::span(text))).ok());
  }
  std::string At(const std::string& name) const { return (folder_ / name).string(); }
  std::string Refusal(const std::string& text) {
    Write("task.json", text);
    const auto task = ReadTwinReach(At("task.json"));
    return task.ok() ? "" : task.status().message();
  }

  std::filesystem::path folder_;
};

// How many of so many goals the tool comes to that goes straight to them.
int ArrivalsGoingStraight(const std::shared_ptr<const ReachTask>& task, int episodes) {
  RobotReach world(task);
  Rng rng(7, 1);
  std::vector<float> row(6 + 2 * world.moving().size() + 6);
  int arrived = 0;
  for (int episode = 0; episode < episodes; ++episode) {
    world.Reset(rng, row.data());
    StepResult result;
    for (std::int64_t step = 0; step < RobotReach::kSteps; ++step) {
      float action[3];
      for (std::size_t i = 0; i < 3; ++i)
        action[i] = static_cast<float>((world.goals()[i] - world.tools()[i]) / task->tool_reach);
      result = world.Step(action, rng, row.data());
    }
    arrived += result.reward > -0.5f ? 1 : 0;
  }
  return arrived;
}

TEST(TwinReach, TheToolIsTheEndOfTheLongestChainWithoutItsFingers) {
  const auto task = TwinReachTask(Arm(), {}, "twin-reach-v0:arm");
  ASSERT_TRUE(task.ok()) << task.status().message();
  const robot::Frame& tool = (*task)->tools[0].frame;
  EXPECT_EQ((*task)->robot.links[static_cast<std::size_t>(tool.link)].name, "fore");
  EXPECT_NEAR(Norm(tool.offset.position), 0.20, 1e-9) << "the far end of its capsule";
  EXPECT_EQ(RobotReach(*task).moving().size(), 3u);
  EXPECT_EQ(RobotReach::Spec(**task, 1).id, "twin-reach-v0:arm");
}

TEST(TwinReach, EveryGoalOfTheCubeIsReached) {
  const auto task = TwinReachTask(Arm(), {}, "twin-reach-v0:arm");
  ASSERT_TRUE(task.ok()) << task.status().message();
  const ReachTool& tool = (*task)->tools[0];
  const double edge = tool.high[0] - tool.low[0];
  EXPECT_GT(edge, 0.1);
  EXPECT_LE(edge, 0.3 + 1e-9);
  EXPECT_NEAR((*task)->threshold, edge / 6, 1e-12);
  EXPECT_GE(tool.low[2], 0.0) << "above the base";
  const RobotReach world(*task);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(world.tools()[i], 0.5 * (tool.low[i] + tool.high[i]), 1e-9);
  EXPECT_GE(ArrivalsGoingStraight(*task, 200), 198);
}

TEST(TwinReach, WhatIsWorkedOutForYumisArmsIsReachedToo) {
  TwinReachChoice choice;
  choice.tool = "yumi_link_7_l";
  for (const auto& robot : {YumiRightArm(), YumiBothArms()}) {
    const auto task = TwinReachTask(robot, robot.FindLink(choice.tool) < 0 ? TwinReachChoice{} : choice, "twin");
    ASSERT_TRUE(task.ok()) << task.status().message();
    EXPECT_NEAR((*task)->threshold, 0.05, 1e-9) << "as FetchReach";
    EXPECT_GE(ArrivalsGoingStraight(*task, 100), 99);
  }
}

TEST(TwinReach, TheSameRobotIsTheSameTask) {
  const auto a = TwinReachTask(Arm(), {}, "x"), b = TwinReachTask(Arm(), {}, "x");
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ((*a)->ready, (*b)->ready);
  EXPECT_EQ((*a)->tools[0].low, (*b)->tools[0].low);
}

TEST_F(TwinReachFiles, AFolderATableAndAFileAreTheSameTwin) {
  const auto folder = ReadTwinReach(At("arm")), table = ReadTwinReach(At("arm/twin.json"));
  ASSERT_TRUE(folder.ok() && table.ok()) << folder.status().message() << table.status().message();
  EXPECT_EQ((*folder)->id, "twin-reach-v0:" + At("arm"));
  EXPECT_EQ((*folder)->ready, (*table)->ready);
  Write("task.json", TwinReachText(**folder, "arm"));
  const auto file = ReadTwinReach(At("task.json"));
  ASSERT_TRUE(file.ok()) << file.status().message();
  EXPECT_EQ((*file)->ready, (*folder)->ready);
  EXPECT_EQ((*file)->tools[0].low, (*folder)->tools[0].low);
  EXPECT_EQ((*file)->tools[0].frame.offset, (*folder)->tools[0].frame.offset);
  EXPECT_DOUBLE_EQ((*file)->threshold, (*folder)->threshold);
}

TEST_F(TwinReachFiles, AFileSaysWhatItLikesOfTheTask) {
  Write("task.json",
        R"({"twin": "arm", "tool": "left", "tool_point": [0, 0, 0.01], "ready": {"lift": -0.4, "bend": 0.9},
            "goals": {"low": [0.2, -0.05, 0.1], "high": [0.3, 0.05, 0.2]}, "near": 0.02})");
  const auto task = ReadTwinReach(At("task.json"));
  ASSERT_TRUE(task.ok()) << task.status().message();
  EXPECT_EQ((*task)->robot.links[static_cast<std::size_t>((*task)->tools[0].frame.link)].name, "left");
  EXPECT_EQ((*task)->tools[0].frame.offset.position, (robot::Vector3{0, 0, 0.01}));
  EXPECT_EQ((*task)->ready[1], -0.4);
  EXPECT_EQ((*task)->ready[2], 0.9);
  EXPECT_EQ((*task)->tools[0].high[0], 0.3);
  EXPECT_EQ((*task)->threshold, 0.02);
}

TEST_F(TwinReachFiles, RefusesInOneLine) {
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  };
  has(ReadTwinReach(At("nowhere")).status().message(), "make it with `consac twin import`");
  has(Refusal("{}"), "'twin' is not");
  has(Refusal("no json"), "task.json");
  has(Refusal(R"({"twin": "arms"})"), "no twin is at");
  has(Refusal(R"({"twin": "arm", "tol": "fore"})"), "unknown member 'tol' (did you mean 'tool'?)");
  has(Refusal(R"({"twin": "arm", "tool": "for"})"), "'fore'");
  has(Refusal(R"({"twin": "arm", "tool": "base"})"), "no joint of 'arm' moves the link 'base'");
  has(Refusal(R"({"twin": "arm", "tool_point": [1, 2]})"), "'tool_point' is not");
  has(Refusal(R"({"twin": "arm", "ready": {"lfit": 1}})"), "'lift'");
  has(Refusal(R"({"twin": "arm", "ready": {"lift": 3}})"), "beyond its limits -2 to 2");
  has(Refusal(R"({"twin": "arm", "ready": {"lift": "up"}})"), "'ready/lift' is not a number");
  has(Refusal(R"({"twin": "arm", "goals": {"low": [0, 0, 0], "high": [0, 0, 0]}})"), "'goals' is not");
  has(Refusal(R"({"twin": "arm", "near": 0})"), "'near' is not");
  has(Refusal(R"({"twin": "arm", "tool": "stick"})"), "no cube of goals was found");
  has(Refusal(R"({"twin": "arm", "goals": {"low": [5, 5, 5], "high": [6, 6, 6]}})"), "no cube of goals was found");
}

TEST_F(TwinReachFiles, IsAWorldByItsName) {
  const std::string name = "twin-reach-v0:" + At("arm");
  const auto world = MakeWorld(name, 3);
  ASSERT_TRUE(world.ok()) << world.status().message();
  EXPECT_EQ((*world)->spec().id, name);
  EXPECT_TRUE((*world)->prices_goals());
  EXPECT_EQ((*FindWorld(name))->robot(**world).moving().size(), 3u);
}

}  // namespace
}  // namespace consac::worlds
