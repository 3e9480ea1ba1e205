// The joint table as a file: it comes back the same bit for bit, and what is wrong in one is named.
#include "consac/robot/table.h"

#include <gtest/gtest.h>

#include "consac/robot/kinematics.h"
#include "core/test/robot/small_robot.h"

namespace consac::robot {
namespace {

Robot FullArm() {
  RobotDescription description = SmallArm();
  description.links[1].inertial = Inertial{2.0, {0.1, 0.2, 0.3}, {1, 0.1, 0.2, 2, 0.3, 3}};
  Robot robot = MustMake(description);
  robot.capsules.push_back({2, {0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}, 0.07});
  robot.allowed_collisions.emplace_back(1, 5);
  return robot;
}

TEST(TwinTable, ComesBackBitForBit) {
  const Robot robot = FullArm();
  const std::string text = WriteTable(robot, {"arm.urdf", "urdf", "00", "MIT"});
  const Result<Robot> again = ReadTable(text);
  ASSERT_TRUE(again.ok()) << again.status().message();
  EXPECT_EQ(WriteTable(*again, {"arm.urdf", "urdf", "00", "MIT"}), text);
  Kinematics first(robot), second(*again);
  Rng rng(1, 1);
  const std::vector<double> positions = SomePositions(robot, rng);
  first.Forward(positions);
  second.Forward(positions);
  for (std::size_t link = 0; link < robot.links.size(); ++link) EXPECT_EQ(first.links()[link], second.links()[link]);
}

TEST(TwinTable, NodesHaveNamesOfTheirOwn) {
  RobotDescription description = SmallArm();
  description.joints[1].name = "yaw_frame";
  description.joints[2].name = "base";
  const NodeNames nodes = NodeNamesOf(MustMake(description));
  EXPECT_EQ(nodes.base, "base");
  EXPECT_EQ(nodes.joints[1], "yaw_frame");
  EXPECT_EQ(nodes.frames[0], "yaw_frame_2");
  EXPECT_EQ(nodes.joints[2], "base_2");
}

TEST(TwinTable, RefusesWhatIsNone) {
  const std::string text = WriteTable(FullArm(), {"arm.urdf", "urdf", "00", ""});
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& part) {
    std::string changed = text;
    const std::size_t at = changed.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    const Result<Robot> robot = ReadTable(changed.replace(at, from.size(), to));
    ASSERT_FALSE(robot.ok()) << part;
    EXPECT_NE(robot.status().message().find(part), std::string::npos) << robot.status().message();
  };
  refused("consac-twin", "other", "this is no joint table");
  refused("\"version\": 1", "\"version\": 2", "is of format 2, this program reads 1");
  refused("\"joints\": [", "\"joint\": [", "'joints' must be something, and is missing");
  refused("\"continuous\"", "\"ball\"", "joint 'yaw' of the table is of no known type: 'ball'");
  refused("\"rest\"", "\"peace\"", "joint 0 of the table: 'rest'");
  refused("\"radius\": 0.07", "\"radius\": -1", "capsule 0 of the table");
  refused("\"capsules\": [", "\"capsules\": 3, \"c\": [", "capsule");
  refused("\"lower\": -1.5", "\"lower\": \"low\"", "'lower' must be a number");
  refused("\"parent\": \"turret\"", "\"parent\": \"tool\"", "loop");
  EXPECT_FALSE(ReadTable("").ok());
  EXPECT_FALSE(ReadTable("[1]").ok());
  EXPECT_FALSE(ReadTable(text.substr(0, text.size() / 2)).ok());
  EXPECT_FALSE(ReadTable("{\"format\":\"consac-twin\",\"version\":1,\"name\":\"a\",\"links\":[1],\"joints\":[]}").ok());
}

}  // namespace
}  // namespace consac::robot
