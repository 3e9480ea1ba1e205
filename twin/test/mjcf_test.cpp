// The reader of MJCF: a maker's own file, our own files read back, every way to turn a body, and one line for what is
// wrong.
#include "consac/twin/mjcf.h"

#include <cmath>

#include "consac/twin/import.h"
#include "tests/support.h"
#include "twin/test/twin_files.h"

namespace consac::twin {
namespace {

using robot::Vector3;

Result<robot::Robot> RobotOf(const std::string& body) {
  const Result<Model> model = ReadMjcf("<mujoco>" + body + "</mujoco>");
  if (!model.ok()) return model.status();
  return MakeRobot(model->robot);
}

// Where `link` of a robot is when every position is `q`.
robot::Transform At(const Result<robot::Robot>& robot, const std::string& link, double q) {
  EXPECT_TRUE(robot.ok()) << robot.status().message();
  if (!robot.ok()) return {};
  robot::Kinematics kinematics(*robot);
  const std::vector<double> positions(robot->position_joints.size(), q);
  return FileFrame(kinematics, positions, robot->FindLink(link));
}

TEST(Mjcf, TheSmallArmsElbowIsWhereItsMakerSays) {
  const Result<robot::Robot> robot =
      LoadRobot(std::string(CONSAC_SOURCE_DIR) + "/twin/test/data/low_cost_robot_arm/low_cost_robot.xml");
  ASSERT_TRUE(robot.ok()) << robot.status().message();
  EXPECT_EQ(robot->positions(), 5);
  const Vector3 way = At(robot, "joint3", 0.0).position - At(robot, "joint2", 0.0).position;
  EXPECT_NEAR(way.y, 0.0148, 1e-5);
  EXPECT_NEAR(way.z, 0.1083, 1e-5);
  const robot::Joint& fifth = robot->joints[static_cast<std::size_t>(robot->FindJoint("joint5"))];
  EXPECT_EQ(fifth.drive.lower, -2.45) << "radians, by its class";
  EXPECT_EQ(fifth.drive.damping, 0.1);
  EXPECT_EQ(fifth.file_axis, (Vector3{0, 0, -1}));
}

TEST(Mjcf, ABodyTurnsAboutItsJointsPlace) {
  const Result<robot::Robot> robot = RobotOf(
      "<compiler angle='radian'/><worldbody><body name='b' pos='1 0 0'><joint name='j' axis='0 0 1' pos='0 1 0'/>"
      "<body name='c' pos='0 0 2'/></body></worldbody>");
  const double q = 0.5;
  const Vector3 tip = At(robot, "c", q).position;  // (0, 0) in the body is (0, -1) from its joint at (1, 1)
  EXPECT_NEAR(tip.x, 1.0 + std::sin(q), 1e-15);
  EXPECT_NEAR(tip.y, 1.0 - std::cos(q), 1e-15);
  EXPECT_NEAR(tip.z, 2.0, 1e-15);
}

TEST(Mjcf, SeveralJointsInABodyAreAChain) {
  const Result<robot::Robot> robot = RobotOf(
      "<worldbody><body name='b'><joint name='x' axis='1 0 0'/><joint name='z' axis='0 0 1' pos='0 1 0'/>"
      "<joint name='s' type='slide' axis='0 1 0'/></body></worldbody>");
  ASSERT_TRUE(robot.ok()) << robot.status().message();
  EXPECT_EQ(robot->positions(), 3);
  const double q = 0.3;
  const robot::Transform expected = robot::Transform{robot::RotationAboutX(q), {}} *
                                    robot::Transform{robot::RotationAbout({0, 0, 1}, q), {0, 1, 0}} *
                                    robot::Transform{{}, {0, -1 + q, 0}};
  const robot::Transform off = Inverse(expected) * At(robot, "b", q);
  EXPECT_LT(Norm(off.position), 1e-15);
  EXPECT_LT(Norm(RotationVector(off.rotation)), 1e-15);
}

TEST(Mjcf, EveryWayToTurnABodyIsTheSameTurn) {
  for (const char* turn : {"quat='0.70710678118654757 0 0 0.70710678118654757'", "euler='0 0 90'",
                           "axisangle='0 0 2 90'", "xyaxes='0 1 0 -1 0 0'"}) {
    const Result<robot::Robot> robot = RobotOf("<worldbody><body name='b' " + std::string(turn) + "/></worldbody>");
    EXPECT_LT(AngleBetween(At(robot, "b", 0).rotation, robot::RotationAbout({0, 0, 1}, robot::kPiRadians / 2)), 1e-15)
        << turn;
  }
  const Result<robot::Robot> z =
      RobotOf("<worldbody><frame pos='1 0 0'><body name='b' zaxis='1 0 0'/></frame></worldbody>");
  EXPECT_LT(Norm(Rotate(At(z, "b", 0).rotation, {0, 0, 1}) - Vector3{1, 0, 0}), 1e-15);
  EXPECT_EQ(At(z, "b", 0).position, (Vector3{1, 0, 0}));
  const std::string euler = "<worldbody><body name='b' euler='10 20 30'/></worldbody>";
  const double d = robot::kPiRadians / 180;
  const robot::Quaternion fixed = robot::FromRollPitchYaw({10 * d, 20 * d, 30 * d});
  EXPECT_LT(AngleBetween(At(RobotOf("<compiler eulerseq='XYZ'/>" + euler), "b", 0).rotation, fixed), 1e-15)
      << "upper case is about fixed axes";
  EXPECT_GT(AngleBetween(At(RobotOf(euler), "b", 0).rotation, fixed), 0.05);
}

TEST(Mjcf, ClassesSayWhatElementsDoNot) {
  const Result<Model> model = ReadMjcf(
      "<mujoco><default><geom rgba='1 0 0 1'/><default class='small'><geom size='0.1'/><default class='tiny'><geom "
      "size='0.01'/>"
      "</default></default></default><worldbody><body childclass='small'><geom/><geom class='tiny' contype='0' "
      "conaffinity='0'/>"
      "<geom type='capsule' size='0.2' fromto='0 0 0 0 2 0' group='3'/></body></worldbody></mujoco>");
  ASSERT_TRUE(model.ok()) << model.status().message();
  ASSERT_EQ(model->visuals.size(), 2u) << "the third is of a group that is not shown";
  ASSERT_EQ(model->collisions.size(), 2u) << "the second touches nothing";
  EXPECT_EQ(model->visuals[0].size.x, 0.1);
  EXPECT_EQ(model->visuals[1].size.x, 0.01);
  EXPECT_EQ(model->visuals[1].colour, (Colour{1, 0, 0, 1}));
  EXPECT_EQ(model->collisions[1].size.z, 2.0);
  EXPECT_EQ(model->collisions[1].origin.position, (Vector3{0, 1, 0}));
}

TEST(Mjcf, WhatWeWriteReadsBackWhereItWas) {
  const testing::ScratchFolder scratch("mjcf");
  ImportOptions options;
  options.output = scratch.path() + "/twin";
  const Result<ImportReport> report =
      Import(std::string(CONSAC_SOURCE_DIR) + "/examples/robots/yumi/yumi_description/urdf/yumi.urdf", options);
  ASSERT_TRUE(report.ok()) << report.status().message();
  const Result<robot::Robot> again = LoadRobot(options.output + "/twin.xml");
  ASSERT_TRUE(again.ok()) << again.status().message();
  ASSERT_EQ(again->positions(), report->robot.positions());
  robot::Kinematics first(report->robot), second(*again);
  std::vector<double> positions;
  for (std::int32_t i = 0; i < again->positions(); ++i) positions.push_back(0.02 * (i + 1));
  first.Forward(positions);
  second.Forward(positions);
  for (std::size_t link = 1; link < again->links.size(); ++link) {
    const std::int32_t same = report->robot.FindLink(again->links[link].name);
    ASSERT_GE(same, 0) << again->links[link].name;
    const robot::Transform off = Inverse(first.links()[static_cast<std::size_t>(same)]) * second.links()[link];
    EXPECT_LT(Norm(off.position) + Norm(RotationVector(off.rotation)), 1e-12);
  }
  options.output = scratch.path() + "/second";
  EXPECT_TRUE(Import(scratch.path() + "/twin/twin.xml", options).ok()) << "its meshes are beside it";
}

// The files of an import of `text`, an MJCF or a URDF.
class WrittenFiles {
 public:
  explicit WrittenFiles(const std::string& text) : scratch_("written") {
    Put(scratch_.path() + "/in.xml", text);
    ImportOptions options;
    options.output = scratch_.path() + "/twin";
    Result<ImportReport> report = Import(scratch_.path() + "/in.xml", options);
    EXPECT_TRUE(report.ok()) << report.status().message();
    if (report.ok()) warnings = report->warnings;
    mjcf = LoadRobot(options.output + "/twin.xml");
    urdf = LoadRobot(options.output + "/twin.urdf");
    text_of_mjcf = TextOf(options.output + "/twin.xml");
    text_of_urdf = TextOf(options.output + "/twin.urdf");
    EXPECT_TRUE(mjcf.ok()) << mjcf.status().message();
    EXPECT_TRUE(urdf.ok()) << urdf.status().message();
  }
  std::vector<std::string> warnings;
  Result<robot::Robot> mjcf = robot::Robot{}, urdf = robot::Robot{};
  std::string text_of_mjcf, text_of_urdf;

 private:
  testing::ScratchFolder scratch_;
};

std::string UrdfChain(const std::string& limit, const std::string& more = "") {
  return "<robot name='r'><link name='a'/><link name='b'/><link name='c'/><link name='d'/>"
         "<joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/>" +
         limit +
         "</joint><joint name='k' type='revolute'><parent link='b'/><child link='c'/><origin xyz='1 0 0'/>"
         "<axis xyz='0 1 0'/><limit lower='-3' upper='3' effort='1' velocity='1'/>" +
         more +
         "</joint><joint name='f' type='fixed'><parent link='c'/><child link='d'/><origin xyz='1 0 "
         "0'/></joint></robot>";
}

TEST(Mjcf, AJointThatIsHeldIsWrittenWhereItIsHeld) {
  const std::string held = "<limit lower='0.5' upper='0.5' effort='1' velocity='1'/>";
  const WrittenFiles one(UrdfChain(held));
  EXPECT_EQ(one.mjcf->positions(), 1);
  EXPECT_LT(robot::Norm(At(one.mjcf, "c", 0).position - Vector3{std::cos(0.5), std::sin(0.5), 0}), 1e-12);
  EXPECT_EQ(one.text_of_mjcf.find("name=\"j\""), std::string::npos)
      << "neither joint nor actuator: " << one.text_of_mjcf;
  const WrittenFiles follower(UrdfChain(held, "<mimic joint='j' multiplier='2' offset='0.1'/>"));
  EXPECT_EQ(follower.mjcf->positions(), 0) << "what follows is held too";
  EXPECT_EQ(follower.text_of_mjcf.find("joint1"), std::string::npos);
  const Vector3 tip = Rotate(robot::RotationAbout({0, 0, 1}, 0.5),
                             Vector3{1, 0, 0} + Rotate(robot::RotationAbout({0, 1, 0}, 1.1), {1, 0, 0}));
  EXPECT_LT(Norm(At(follower.mjcf, "d", 0).position - tip), 1e-12);
}

TEST(Mjcf, WhatHasNoLimitHasNoneInTheUrdf) {
  const WrittenFiles files(
      "<mujoco model='m'><worldbody><body name='b'><joint name='s' type='slide' axis='1 0 0' actuatorfrcrange='-5 5'/>"
      "<body name='c'><joint name='h' axis='0 0 1' range='-10 20'/><body name='d'><joint name='w' axis='0 1 0'/>"
      "</body></body></body></worldbody></mujoco>");
  const auto drive = [&](const char* joint) {
    return files.urdf->joints[static_cast<std::size_t>(files.urdf->FindJoint(joint))].drive;
  };
  EXPECT_EQ(drive("s").lower, -1e6) << "a limit that only says its effort would be one of 0";
  EXPECT_EQ(drive("s").upper, 1e6);
  EXPECT_EQ(drive("s").effort, 5.0);
  EXPECT_EQ(drive("s").velocity, 1e6) << "urdfdom refuses a <limit> without one";
  EXPECT_NEAR(drive("h").upper, 20 * robot::kPiRadians / 180, 1e-15);
  EXPECT_EQ(drive("h").effort, 1e6);
  EXPECT_EQ(files.urdf->joints[static_cast<std::size_t>(files.urdf->FindJoint("w"))].type,
            robot::JointType::kContinuous);
  EXPECT_EQ(files.text_of_urdf.find("inf"), std::string::npos);
}

TEST(Mjcf, SeveralJointsInABodyStayInOne) {
  const std::string body =
      "<joint name='x' axis='1 0 0'/><joint name='z' axis='0 0 1' pos='0 1 0'/>"
      "<joint name='s' type='slide' axis='0 1 0'/><geom type='sphere' size='0.1'/>";
  const WrittenFiles files("<mujoco model='m'><worldbody><body name='b' pos='1 2 3' euler='10 20 30'>" + body +
                           "</body></worldbody></mujoco>");
  EXPECT_EQ(files.text_of_mjcf.find("_before_"), std::string::npos) << "a body without a mass, which MuJoCo refuses";
  ASSERT_EQ(files.mjcf->positions(), 3);
  const Result<robot::Robot> first =
      RobotOf("<worldbody><body name='b' pos='1 2 3' euler='10 20 30'>" + body + "</body></worldbody>");
  // The frame of `b` in the written file is turned, but about the same points.
  for (const double q : {0.0, 0.3}) {
    EXPECT_LT(Norm(At(files.mjcf, "b", q).position - At(first, "b", q).position), 1e-12) << q;
    EXPECT_LT(AngleBetween(At(files.mjcf, "b", q).rotation * Inverse(At(files.mjcf, "b", 0).rotation),
                           At(first, "b", q).rotation * Inverse(At(first, "b", 0).rotation)),
              1e-12);
  }
  EXPECT_TRUE(files.warnings.empty() || files.warnings.back().find("MuJoCo refuses") == std::string::npos);
}

TEST(Mjcf, WhatMuJoCoRefusesIsNamed) {
  const std::string end = "</worldbody></mujoco>";
  const std::string light =
      "<mujoco model='m'><worldbody><body name='a'><joint/><geom size='1' contype='0' conaffinity='0'/>";
  const auto warned = [](const WrittenFiles& files) {
    return !files.warnings.empty() &&
           files.warnings.back().find("MuJoCo refuses twin.xml, for these links move and weigh nothing: 'a'") == 0;
  };
  EXPECT_TRUE(warned(WrittenFiles(light + "</body>" + end)));
  EXPECT_FALSE(warned(WrittenFiles(light + "<geom size='1'/></body>" + end))) << "a shape that collides weighs";
  EXPECT_FALSE(warned(WrittenFiles(light + "<body name='c'><geom size='1'/></body></body>" + end))) << "fixed to it";
  EXPECT_TRUE(warned(WrittenFiles(light + "<body name='c'><joint/><geom size='1'/></body></body>" + end)));
}

TEST(Mjcf, JointsInAFrameAreTheBodys) {
  const Result<robot::Robot> framed = RobotOf(
      "<worldbody><body name='b' pos='1 0 0'><frame pos='0 1 0' euler='0 90 0'><frame pos='0 0 1'>"
      "<joint name='j' axis='0 0 1' pos='0.5 0 0'/></frame></frame></body></worldbody>");
  const Result<robot::Robot> plain =
      RobotOf("<worldbody><body name='b' pos='1 0 0'><joint name='j' axis='1 0 0' pos='1 1 -0.5'/></body></worldbody>");
  ASSERT_TRUE(framed.ok()) << framed.status().message();
  ASSERT_EQ(framed->positions(), 1);
  const robot::Transform off = Inverse(At(framed, "b", 0.4)) * At(plain, "b", 0.4);
  EXPECT_LT(Norm(off.position) + Norm(RotationVector(off.rotation)), 1e-12);
}

TEST(Mjcf, SeveralDefaultsAreOne) {
  const Result<Model> model = ReadMjcf(
      "<mujoco><default><geom size='0.1'/></default><default class='all'><geom rgba='1 0 0 1'/></default>"
      "<worldbody><geom/><geom class='all' size='0.2'/></worldbody></mujoco>");
  ASSERT_TRUE(model.ok()) << model.status().message();
  EXPECT_EQ(model->visuals[0].size.x, 0.1);
  for (const Shape& shape : model->visuals) EXPECT_EQ(shape.colour, (Colour{1, 0, 0, 1}));
}

TEST(Mjcf, RefusesWithTheLine) {
  const auto refused = [](const std::string& body, const std::string& part) {
    const Result<robot::Robot> robot = RobotOf(body);
    ASSERT_FALSE(robot.ok()) << body;
    EXPECT_NE(robot.status().message().find(part), std::string::npos) << robot.status().message();
  };
  refused("\n<include file='x'/>", "line 2: <include> is not read");
  refused("<compiler eulerseq='xyq'/>", "eulerseq 'xyq'");
  refused("<compiler coordinate='global'/>", "global coordinates");
  refused("<worldbody><body><joint type='ball'/></body></worldbody>", "has a ball joint");
  refused("<worldbody><body pos='1 2'/></worldbody>", "3 numbers are needed");
  refused("<worldbody><geom type='mesh' mesh='m'/></worldbody>", "the geom's mesh 'm' is not among the assets");
  refused("<worldbody><geom type='box' size='1 1'/></worldbody>", "needs 3 sizes above 0");
  refused("<worldbody><body name='b'/><body name='b'/></worldbody>", "two links are named 'b'");
  refused("<worldbody><body name='b'><joint name='j' axis='0 0 0'/></body></worldbody>", "its axis is (0, 0, 0)");
  std::string classes = "<default>";
  for (int i = 0; i < 600; ++i) classes += "<default class='c" + std::to_string(i) + "'/>";
  refused(classes + "</default>", "more than 500 classes");
  refused("<worldbody>\n<geom class='none'/></worldbody>", "line 2: <geom class='none'>: no <default> has that class");
  refused("<worldbody><body childclass='none'/></worldbody>", "<body childclass='none'>");
  std::string bodies = "<worldbody>", geoms = bodies;
  for (int i = 0; i < 2000; ++i) bodies += "<body/>";
  refused(bodies + "</worldbody>", "more than 2000 bodies and joints");
  for (int i = 0; i < 10'001; ++i) geoms += "<geom size='1'/>";
  refused(geoms + "</worldbody>", "more than 10000 geoms");
  EXPECT_FALSE(ReadMjcf("<robot/>").ok());
}

TEST(Mjcf, SaysWhatItLeavesOut) {
  const Result<Model> model = ReadMjcf(
      "<mujoco><worldbody><body name='b'><freejoint/><geom type='ellipsoid' size='1 1 1'/></body></worldbody>"
      "<equality><joint joint1='x'/></equality></mujoco>");
  ASSERT_TRUE(model.ok());
  ASSERT_EQ(model->warnings.size(), 3u);
  EXPECT_EQ(model->warnings[0], "body 'b' is free; it is fixed here");
}

}  // namespace
}  // namespace consac::twin
