// The reader of URDF: what it takes, its traps, and one line with the number for everything that is wrong.
#include "consac/twin/urdf.h"

#include <cmath>

#include "twin/test/twin_files.h"

namespace consac::twin {
namespace {

const std::string kTwoLinks = "<link name='a'/>\n<link name='b'/>\n";

Result<robot::Robot> RobotOf(const std::string& body) {
  const Result<Model> model = ReadUrdf("<robot name='r'>\n" + body + "</robot>");
  if (!model.ok()) return model.status();
  return MakeRobot(model->robot);
}

void ExpectRefused(const std::string& text, const std::string& part) {
  const Result<Model> model = ReadUrdf(text);
  ASSERT_FALSE(model.ok()) << text;
  EXPECT_NE(model.status().message().find(part), std::string::npos) << model.status().message();
  EXPECT_EQ(model.status().message().find('\n'), std::string::npos);
}

void ExpectRefusedBody(const std::string& body, const std::string& part) {
  ExpectRefused("<robot name='r'>\n" + kTwoLinks + body + "</robot>", part);
}

TEST(Urdf, ReadsAJointAsTheFormatSays) {
  const Result<Model> model = ReadUrdf(
      "<?xml version='1.0'?><robot name='r'>" + kTwoLinks +
      "<joint name='j' type='prismatic'><parent link='a'/><child link='b'/><origin xyz='1 +2 3e-1' rpy='0.1 0.2 0.3'/>"
      "<axis xyz='0 0 2'/><limit lower='-1' upper='2' effort='3' velocity='4'/><dynamics damping='0.5' friction='0.6'/>"
      "</joint></robot>");
  ASSERT_TRUE(model.ok()) << model.status().message();
  const robot::JointDescription& joint = model->robot.joints[0];
  EXPECT_EQ(joint.type, robot::JointType::kPrismatic);
  EXPECT_EQ(joint.origin.position, (robot::Vector3{1, 2, 0.3}));
  EXPECT_EQ(joint.origin.rotation, robot::FromRollPitchYaw({0.1, 0.2, 0.3}));
  EXPECT_EQ(joint.axis, (robot::Vector3{0, 0, 2}));
  EXPECT_EQ(joint.drive.upper, 2.0);
  EXPECT_EQ(joint.drive.effort, 3.0);
  EXPECT_EQ(joint.drive.friction, 0.6);
  EXPECT_TRUE(model->warnings.empty());
}

TEST(Urdf, JointsInsideTransmissionsAreNone) {
  const Result<robot::Robot> robot =
      RobotOf(kTwoLinks +
              "<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>"
              "<transmission name='t'><joint name='j'><x/></joint></transmission><gazebo><joint>j</joint></gazebo>");
  ASSERT_TRUE(robot.ok()) << robot.status().message();
  EXPECT_EQ(robot->joints.size(), 1u);
}

TEST(Urdf, AMissingAxisIsXAndIsSaid) {
  const Result<Model> model =
      ReadUrdf("<robot name='r'>" + kTwoLinks +
               "<joint name='j' type='revolute'><parent link='a'/><child link='b'/></joint></robot>");
  ASSERT_TRUE(model.ok());
  EXPECT_EQ(model->robot.joints[0].axis, (robot::Vector3{1, 0, 0}));
  ASSERT_EQ(model->warnings.size(), 2u);
  EXPECT_EQ(model->warnings[0], "joint 'j': it has no <axis>; URDF then takes (1, 0, 0)");
  EXPECT_EQ(model->warnings[1], "joint 'j': it has no <limit>, so it has no limits here");
}

TEST(Urdf, LimitsInDegreesAreNoticed) {
  const auto lines = [](const std::string& type, const std::string& limit) {
    const Result<robot::Robot> robot =
        RobotOf(kTwoLinks + "<joint name='j' type='" + type +
                "'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/><limit " + limit + "/></joint>");
    EXPECT_TRUE(robot.ok());
    return robot.ok() ? WideLimits(*robot) : std::vector<std::string>();
  };
  EXPECT_EQ(lines("revolute", "lower='-180' upper='180'"),
            std::vector<std::string>{"joint 'j': its limits of -180 to 180 rad are 57 turns apart; URDF is in radians: "
                                     "if these are degrees, write -3.1416 and 3.1416"});
  EXPECT_TRUE(lines("revolute", "lower='-12.5' upper='12.5'").empty()) << "just below four turns";
  EXPECT_TRUE(lines("prismatic", "lower='-180' upper='180'").empty());
  EXPECT_TRUE(lines("revolute", "lower='-1e6' upper='1e6'").empty()) << "twin.urdf says so that there is no limit";
}

TEST(Urdf, InertiaIsTurnedIntoTheLinksFrame) {
  const Result<Model> model = ReadUrdf(
      "<robot name='r'><link name='a'><inertial><origin xyz='1 2 3' rpy='0 0 1.5707963267948966'/><mass value='2'/>"
      "<inertia ixx='1' iyy='2' izz='3' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>");
  ASSERT_TRUE(model.ok());
  const robot::Inertial& body = *model->robot.links[0].inertial;
  EXPECT_NEAR(body.inertia[0], 2.0, 1e-15);
  EXPECT_NEAR(body.inertia[3], 1.0, 1e-15);
  EXPECT_EQ(body.centre, (robot::Vector3{1, 2, 3}));
}

TEST(Urdf, ColoursAreNamedOnceAndUsedElsewhere) {
  const Result<Model> model = ReadUrdf(
      "<robot name='r'><material name='red'><color rgba='1 0 0 1'/></material><link name='a'>"
      "<visual><geometry><box size='1 2 3'/></geometry><material name='red'/></visual>"
      "<visual><geometry><sphere radius='1'/></geometry><material name='own'><color rgba='0 2 0 "
      "0.5'/></material></visual>"
      "<visual><geometry><cylinder radius='1' length='2'/></geometry></visual></link></robot>");
  ASSERT_TRUE(model.ok()) << model.status().message();
  ASSERT_EQ(model->visuals.size(), 3u);
  EXPECT_EQ(model->visuals[0].colour, (Colour{1, 0, 0, 1}));
  EXPECT_EQ(model->visuals[1].colour, (Colour{0, 1, 0, 0.5})) << "within 0 and 1";
  EXPECT_FALSE(model->visuals[2].has_colour);
}

TEST(Urdf, RefusesWithTheLine) {
  const std::string ends = "<parent link='a'/><child link='b'/></joint>";
  ExpectRefused("", "this is no XML");
  ExpectRefused("<robot name='r'>\n<link name='a'>\n", "this is no XML");
  ExpectRefused("<sdf/>", "line 1: a URDF begins with <robot>, this with <sdf>");
  ExpectRefused("<mujocoinclude/>", "line 1: <mujocoinclude> is a piece of an MJCF; import the file that includes it");
  ExpectRefused("<robot name='r' xmlns:xacro='x'>\n<xacro:include filename='x'/></robot>",
                "line 2: <xacro:include> is xacro");
  ExpectRefusedBody("<joint name='j' type='ball'>" + ends, "line 4: joint 'j': its type is 'ball'");
  ExpectRefusedBody("<joint name='j' type='fixed'><parent link='a'/></joint>",
                    "it needs <parent link=...> and <child link=...>");
  ExpectRefusedBody("<joint type='fixed'>" + ends, "<joint> has no name");
  ExpectRefusedBody("<joint name='j' type='fixed'><origin xyz='1 2'/>" + ends,
                    "line 4: <origin xyz='1 2'>: 3 numbers are needed");
  ExpectRefusedBody("<joint name='j' type='fixed'><origin xyz='1 2 nan'/>" + ends, "'nan' is no number");
  ExpectRefusedBody("<joint name='j' type='revolute'><axis xyz='0,0,1'/>" + ends,
                    "'0,0,1' is no number; numbers stand with blanks between, without commas");
  ExpectRefusedBody("<joint name='j' type='revolute'>\n<parent link='a'/>\n<child link='bb'/></joint>",
                    "line 6: joint 'j' names the link 'bb', which is not there (did you mean 'b'?)");
  ExpectRefusedBody("<joint name='j' type='revolute'>\n<limit lower='2' upper='1'/>" + ends,
                    "line 5: joint 'j': its lower limit 2 is above its upper limit 1");
  ExpectRefusedBody("<joint name='j' type='revolute'>\n<axis xyz='0 0 0'/>" + ends,
                    "line 5: joint 'j': its axis is (0, 0, 0), which is no direction");
  ExpectRefusedBody("<joint name='j' type='fixed'><origin xyz='1 2 3 4'/>" + ends, "more numbers than 3");
  ExpectRefusedBody("<joint name='j' type='revolute'><limit lower='low'/>" + ends, "'low' is no number");
  ExpectRefusedBody("<link name='c'><visual><geometry/></visual></link>", "has no geometry that is read");
  ExpectRefusedBody("<link name='c'><visual><geometry><box size='1 0 1'/></geometry></visual></link>",
                    "three lengths are needed");
  ExpectRefusedBody("<link name='c'><visual><geometry><sphere radius='-1'/></geometry></visual></link>",
                    "has no usable radius");
  ExpectRefusedBody("<link name='c'><visual><geometry><mesh filename=''/></geometry></visual></link>",
                    "<mesh> has no filename");
  ExpectRefusedBody("<link name='c'><visual><geometry><mesh filename='x' scale='1 0 1'/></geometry></visual></link>",
                    "the mesh's scale is 1 0 1");
}

TEST(Urdf, RefusesWhatIsNoTree) {
  const auto part = [](const std::string& body) {
    const Result<robot::Robot> robot = RobotOf(kTwoLinks + body);
    return robot.ok() ? std::string() : robot.status().message();
  };
  EXPECT_NE(part("").find("both hang on nothing: two roots"), std::string::npos);
  EXPECT_NE(part("<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>"
                 "<joint name='k' type='fixed'><parent link='b'/><child link='a'/></joint>")
                .find("are a loop"),
            std::string::npos);
}

TEST(Urdf, RefusesTooMuch) {
  std::string deep = "<robot name='r'>";
  for (int i = 0; i < 300; ++i) deep += "<a b='/>'>";
  for (int i = 0; i < 300; ++i) deep += "</a>";
  ExpectRefused(deep + "</robot>", "elements within each other");
  std::string many = "<robot name='r'>";
  for (int i = 0; i < 1'000'000; ++i) many += "<a/>";
  ExpectRefused(many + "</robot>", "more than 1000000 tags");
  std::string shapes = "<robot name='r'><link name='a'>";
  for (int i = 0; i < 10'001; ++i) shapes += "<visual><geometry><sphere radius='1'/></geometry></visual>";
  ExpectRefused(shapes + "</link></robot>", "more than 10000 <visual>");
}

TEST(Urdf, CutAnywhereItIsRefusedOrRead) {
  const std::string text =
      TextOf(std::string(CONSAC_SOURCE_DIR) + "/examples/robots/yumi/yumi_description/urdf/yumi.urdf");
  for (std::size_t length = 0; length < text.size(); length += 97) {
    const Result<Model> model = ReadUrdf(std::string_view(text).substr(0, length));
    EXPECT_FALSE(model.ok()) << length;
  }
}

TEST(Urdf, TheSmallArmsElbowIsWhereItsMakerSays) {
  const Result<robot::Robot> robot =
      LoadRobot(std::string(CONSAC_SOURCE_DIR) + "/twin/test/data/low_cost_robot_arm/low-cost-arm.urdf");
  ASSERT_TRUE(robot.ok()) << robot.status().message();
  const robot::Kinematics kinematics(*robot);
  std::vector<std::int32_t> joints;
  for (std::size_t j = 0; j < robot->joints.size(); ++j)
    if (robot->joints[j].type != robot::JointType::kFixed) joints.push_back(static_cast<std::int32_t>(j) + 1);
  ASSERT_EQ(joints.size(), 5u);
  const robot::Vector3 way = kinematics.links()[static_cast<std::size_t>(joints[2])].position -
                             kinematics.links()[static_cast<std::size_t>(joints[1])].position;
  EXPECT_NEAR(way.y, 0.0148, 1e-5);
  EXPECT_NEAR(way.z, 0.1083, 1e-5);
}

}  // namespace
}  // namespace consac::twin
