// Joints found by geometry, in assemblies made by hand: what is a hinge, what is screwed together, what is no joint.
#include "consac/twin/cad_joints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cad_groups.h"
#include "cad_kinematics.h"
#include "consac/twin/import.h"
#include "twin/test/cad_assembly.h"

namespace consac::twin {
namespace {

using robot::JointType;
using robot::Vector3;

CadRobot Found(const HandMade& made, const std::string& hints = "{}") {
  const Result<JointHints> read = ReadHints(hints);
  EXPECT_TRUE(read.ok()) << read.status().message();
  Result<CadRobot> found = FindJoints(made.assembly, *read);
  EXPECT_TRUE(found.ok()) << found.status().message();
  return found.ok() ? std::move(*found) : CadRobot{};
}

std::string Refused(const HandMade& made, const std::string& hints) {
  const Result<JointHints> read = ReadHints(hints);
  if (!read.ok()) return read.status().message();
  const Result<CadRobot> found = FindJoints(made.assembly, *read);
  return found.ok() ? "" : found.status().message();
}

// A base with a bore, an arm with a pin in it.
HandMade Hinge() {
  HandMade made;
  made.Add("base", {HandMade::Along(10, 20, 8.1, 0, 30, true)}, 200);
  made.Add("arm", {HandMade::Along(10, 20, 8.0, -5, 25, false)}, 100, {{}, {0, 0, 0}});
  return made;
}

TEST(CadJoints, APinInABoreTurns) {
  const CadRobot found = Found(Hinge());
  ASSERT_EQ(found.robot.joints.size(), 1u);
  const robot::JointDescription& joint = found.robot.joints[0];
  EXPECT_EQ(joint.type, JointType::kContinuous) << "no limit is made up";
  EXPECT_EQ(joint.parent, "base");
  EXPECT_EQ(joint.child, "arm");
  EXPECT_NEAR(joint.origin.position.x, 0.010, 1e-12);
  EXPECT_NEAR(joint.origin.position.y, 0.020, 1e-12);
  EXPECT_NEAR(joint.origin.position.z, 0.0125, 1e-12) << "the middle of what pin and bore share";
  EXPECT_NEAR(std::abs(joint.axis.z), 1.0, 1e-12);
  ASSERT_EQ(found.candidates.size(), 1u);
  EXPECT_GE(found.candidates[0].score, kTakenFrom);
  EXPECT_EQ(found.candidates[0].verdict, "joint_1");
  const auto asks = [&](const std::string& what) {
    return std::any_of(found.asked.begin(), found.asked.end(),
                       [&](const std::string& line) { return line.find(what) != std::string::npos; });
  };
  EXPECT_TRUE(asks("'joint_1': its limits and its zero are not in the file"));
  EXPECT_TRUE(asks("'base' is taken for what stands still, by its name"));
}

TEST(CadJoints, TooLooseApartOrAsideIsNoHinge) {
  for (const CadCylinder& pin :
       {HandMade::Along(10, 20, 7.5, -5, 25, false), HandMade::Along(10.2, 20, 8.0, -5, 25, false),
        HandMade::Along(10, 20, 8.0, -40, -20, false), HandMade::Along(10, 20, 8.1, -5, 25, true)}) {
    HandMade made;
    made.Add("base", {HandMade::Along(10, 20, 8.1, 0, 30, true)}, 200);
    made.Add("arm", {pin});
    EXPECT_EQ(Found(made).robot.joints.size(), 0u) << pin.radius;
  }
}

TEST(CadJoints, APlainPinThroughTwoPlatesIsTheirHinge) {
  HandMade made;
  made.Add("base plate", {HandMade::Along(0, 0, 5.05, 0, 10, true)}, 200);
  made.Add("moving plate", {HandMade::Along(0, 0, 5.05, 10, 20, true)});
  made.Add("dowel", {HandMade::Along(0, 0, 5.0, 0, 20, false)}, 10);
  const CadRobot found = Found(made);
  ASSERT_EQ(found.robot.joints.size(), 1u);
  EXPECT_EQ(found.robot.joints[0].child, "moving plate");
  EXPECT_EQ(found.robot.links.size(), 2u) << "a pin is no link";
}

TEST(CadJoints, ScrewsAreNoJoints) {
  HandMade one;  // a screw through two plates: by its shape, a shank with a head
  one.Add("base plate", {HandMade::Along(0, 0, 3.3, 0, 10, true)}, 200);
  one.Add("cover", {HandMade::Along(0, 0, 3.3, 10, 14, true)});
  one.Add("part 7", {HandMade::Along(0, 0, 3.2, 0, 14, false), HandMade::Along(0, 0, 5.5, 14, 18, false)}, 10);
  const CadRobot with_one = Found(one);
  EXPECT_EQ(with_one.robot.joints.size(), 0u);
  EXPECT_NE(CandidatesText(with_one).find("a screw on it"), std::string::npos);

  HandMade two;
  two.Add("base plate", {HandMade::Along(0, 0, 3.3, 0, 10, true), HandMade::Along(40, 0, 3.3, 0, 10, true)}, 200);
  two.Add("bracket", {HandMade::Along(0, 0, 3.0, 0, 10, false), HandMade::Along(40, 0, 3.3, 10, 14, true)});
  const CadRobot with_two = Found(two);
  EXPECT_EQ(with_two.robot.joints.size(), 0u);
  ASSERT_EQ(with_two.candidates.size(), 1u);
  EXPECT_FALSE(with_two.candidates[0].turns);
  EXPECT_EQ(with_two.candidates[0].verdict, "fixed");
  EXPECT_EQ(with_two.robot.links.size(), 1u);
}

TEST(CadJoints, AScrewsNameIsWholeWordsOfSomethingSmall) {
  const auto joints = [](const std::string& name, bool assembly) {  // a plain pin through two plates
    HandMade made;
    made.Add("base plate", {HandMade::Along(0, 0, 5.05, 0, 10, true)}, 200);
    made.Add("moving plate", {HandMade::Along(0, 0, 5.05, 10, 20, true)});
    if (assembly)
      made.AddTo(name, "shank", {HandMade::Along(0, 0, 5.0, 0, 20, false)});
    else
      made.Add(name, {HandMade::Along(0, 0, 5.0, 0, 20, false)});
    made.assembly.parts.back().low = {-0.005, -0.005, 0.0}, made.assembly.parts.back().high = {0.005, 0.005, 0.02};
    return Found(made).robot.joints.size();
  };
  for (const bool assembly : {false, true}) {
    for (const char* name : {"Zylinderschraube_M6x20", "CapScrew-2", "ISO4762 M10", "DIN 912", "FHS_M3x8", "screws",
                             "bolt", "M10bolt:3", "Sechskantmuttern", "lock_nut"})
      EXPECT_EQ(joints(name, assembly), 0u) << name;
    for (const char* name : {"thunderbolt", "dowel", "unscrewed", "Riemenscheibe", "ISO 47620", "Mutterhorn"})
      EXPECT_EQ(joints(name, assembly), 1u) << name;
  }
}

TEST(CadJoints, ARobotOrAnAssemblyCalledBoltHasItsJoints) {
  HandMade robot = Hinge();
  robot.assembly.nodes.front().name = "Bolt";
  EXPECT_EQ(Found(robot).robot.joints.size(), 1u) << "the root's name";
  robot.assembly.nodes.insert(robot.assembly.nodes.begin(), {"Screw v3", -1, -1, {}, std::nullopt});
  for (std::size_t n = 1; n < robot.assembly.nodes.size(); ++n) ++robot.assembly.nodes[n].parent;
  for (CadPart& part : robot.assembly.parts) part.low = 0.1 * part.low, part.high = 0.1 * part.high;
  EXPECT_EQ(Found(robot).robot.joints.size(), 1u) << "nor that of what holds the root's components alone";

  HandMade axis;
  axis.Add("base", {HandMade::Along(10, 20, 8.1, 0, 30, true)}, 200);
  axis.AddTo("ball screw axis", "carriage", {HandMade::Along(10, 20, 8.0, -5, 25, false)});
  EXPECT_EQ(Found(axis).robot.joints.size(), 1u) << "an assembly wider than any screw";
  HandMade arm;
  arm.Add("base", {HandMade::Along(10, 20, 8.1, 0, 30, true)}, 200);
  arm.Add("bolt plate", {HandMade::Along(10, 20, 8.0, -5, 25, false)});
  EXPECT_EQ(Found(arm).robot.joints.size(), 1u) << "a part wider than any screw";
}

std::vector<CadCylinder> Circle(double radius, double low, double high) {
  std::vector<CadCylinder> out;
  for (int i = 0; i < 4; ++i)
    out.push_back(HandMade::Along(8 * std::cos(1.5707963267948966 * i), 8 * std::sin(1.5707963267948966 * i), radius,
                                  low, high, true));
  return out;
}

TEST(CadJoints, ACircleOfScrewsIsAFlangeUnlessSomethingTurnsOnItsAxis) {
  for (const bool servo : {false, true}) {
    HandMade made;
    std::vector<CadCylinder> horn = Circle(1.0, 10, 14);
    horn.push_back(HandMade::Along(0, 0, 10.0, 6, 10, false));
    std::vector<CadCylinder> body = {HandMade::Along(0, 0, servo ? 10.1 : 14.0, 0, 10, true)};
    made.AddTo("base servo", "body", body);
    made.AddTo("base servo", "horn", horn);
    std::vector<CadCylinder> bracket = Circle(1.2, 14, 18);
    bracket.push_back(HandMade::Along(0, 0, 5.0, 14, 18, true));
    made.Add("bracket", bracket);
    const CadRobot found = Found(made);
    ASSERT_EQ(found.robot.joints.size(), servo ? 1u : 0u);
    EXPECT_EQ(found.candidates[0].turns, servo) << found.candidates[0].reason;
    EXPECT_NEAR(Norm(Cross(found.candidates[0].direction, {0, 0, 1})), 0.0, 1e-12);
    EXPECT_NEAR(found.candidates[0].origin.x, 0.0, 1e-12) << "the centre, not a screw";
  }
}

TEST(CadJoints, AxesOfTwoDirectionsHoldEachOther) {
  HandMade made;
  CadCylinder across{{0, 0, 0.05}, {1, 0, 0}, 0.0081, -0.02, 0.02, 6.3, true};
  CadCylinder pin = across;
  pin.radius = 0.008, pin.concave = false;
  made.Add("base", {HandMade::Along(10, 20, 8.1, 0, 30, true), across}, 200);
  made.Add("arm", {HandMade::Along(10, 20, 8.0, -5, 25, false), pin});
  EXPECT_EQ(Found(made).robot.joints.size(), 0u);
}

// Three plates, each on a pin of the one before; the chain's axes are found and hang under each other.
HandMade Chain(int count) {
  HandMade made;
  for (int i = 0; i < count; ++i) {
    std::vector<CadCylinder> faces;
    if (i > 0) faces.push_back(HandMade::Along(50.0 * i, 0, 8.1, 10.0 * i, 10.0 * i + 10, true));
    faces.push_back(HandMade::Along(50.0 * (i + 1), 0, 8.0, 10.0 * i + 10, 10.0 * i + 20, false));
    made.Add(i == 0 ? "base" : "plate " + std::to_string(i), faces);
  }
  return made;
}

TEST(CadJoints, AChainHangsInOrder) {
  const CadRobot found = Found(Chain(4));
  ASSERT_EQ(found.robot.joints.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(found.robot.joints[i].parent, i == 0 ? "base" : "plate " + std::to_string(i));
    EXPECT_EQ(found.robot.joints[i].child, "plate " + std::to_string(i + 1));
    EXPECT_NEAR(found.link_place[i + 1].position.x, 0.05 * static_cast<double>(i + 1), 1e-12);
  }
  EXPECT_TRUE(MakeRobot(found.robot).ok());
}

TEST(CadJoints, ManyComponentsTakeTimeInProportion) {
  const CadRobot found = Found(Chain(1500));
  EXPECT_EQ(found.robot.joints.size(), 1499u);
}

TEST(CadJoints, HintsSayWhatGeometryCannot) {
  HandMade made = Hinge();
  made.Add("tool:1", {}, 20, {robot::RotationAboutX(robot::kPiRadians / 2), {0.3, 0.1, 0.2}});
  const CadRobot found = Found(made, R"({"base": "arm", "links": {"hand": {"parts": ["tool*"], "mass": 0.25}},
      "joints": [{"name": "shoulder", "parent": "arm", "child": "base", "limit": [-1, 2], "velocity": 3, "drawn_at": 0.5},
                 {"name": "wrist", "type": "prismatic", "parent": "base", "child": "hand", "axis": "component:tool:1#Z",
                  "limit": [0, 0.1]}]})");
  ASSERT_EQ(found.robot.joints.size(), 2u);
  const robot::JointDescription &shoulder = found.robot.joints[0], &wrist = found.robot.joints[1];
  EXPECT_EQ(shoulder.name, "shoulder");
  EXPECT_EQ(shoulder.type, JointType::kRevolute);
  EXPECT_EQ(shoulder.parent, "arm");
  EXPECT_EQ(shoulder.drive.upper, 2.0);
  EXPECT_NEAR(AngleBetween(shoulder.origin.rotation, robot::RotationAbout(shoulder.axis, -0.5)), 0.0, 1e-12)
      << "at 0.5 it is where the file draws it";
  EXPECT_EQ(wrist.child, "hand");
  EXPECT_NEAR(Norm(wrist.axis - Vector3{0, -1, 0}), 0.0, 1e-9);
  EXPECT_NEAR(Norm(found.link_place[2].position - Vector3{0.3, 0.1, 0.2}), 0.0, 1e-12);
  EXPECT_EQ(found.masses[2], 0.25);
  for (const std::string& line : found.asked) EXPECT_EQ(line.find("limits"), std::string::npos) << line;
  EXPECT_EQ(Found(made, R"({"automatic": false})").robot.joints.size(), 0u);
}

// Three plates that share no axis, with joints of the file's own.
TEST(CadJoints, TheFilesOwnJointsComeBeforeGeometryAndAfterHints) {
  HandMade made;
  made.Add("base", {}), made.Add("arm", {}, 100.0, {{}, {0.2, 0, 0}});
  made.Add("slide", {}, 100.0, {robot::RotationAboutX(robot::kPiRadians / 2), {0.4, 0, 0}});
  CadJoint turn{"turn", robot::JointType::kRevolute, 1, 2, {0.1, 0, 0}, {0, 0, 1}, -1.0, 2.0, 0.5};
  CadJoint lift{"lift", robot::JointType::kPrismatic, 3, 2, {0, 0, 0.01}, {0, 0, 1}, 0.0, 0.05, 0.0};
  CadJoint again = turn, inside = turn;
  again.name = "again", inside.second = 1, inside.name = "inside";
  made.assembly.joints = {turn, lift, again, inside};
  const Result<CadRobot> found = FindJoints(made.assembly, {});
  ASSERT_TRUE(found.ok()) << found.status().message();
  ASSERT_EQ(found->robot.joints.size(), 2u);
  const robot::JointDescription &first = found->robot.joints[0], &second = found->robot.joints[1];
  EXPECT_EQ(first.name, "turn");
  EXPECT_EQ(first.type, robot::JointType::kRevolute);
  EXPECT_EQ(first.source, "step");
  EXPECT_EQ(first.drive.lower, -1.0);
  EXPECT_EQ(first.drive.upper, 2.0);
  EXPECT_NEAR(Norm(first.origin.position - robot::Vector3{0.1, 0, 0}), 0.0, 1e-12);
  EXPECT_NEAR(Norm(Rotate(first.origin.rotation, {1, 0, 0}) - robot::Vector3{std::cos(0.5), -std::sin(0.5), 0}), 0.0,
              1e-12)
      << "drawn at 0.5 rad";
  EXPECT_EQ(second.type, robot::JointType::kPrismatic);
  EXPECT_EQ(second.child, "slide");
  // The slide's frame is turned, and it is the first side: it moves the other way, along +y of the world.
  EXPECT_NEAR(Norm(Rotate(found->link_place[2].rotation, second.axis) - robot::Vector3{0, 1, 0}), 0.0, 1e-12);
  ASSERT_EQ(found->warnings.size(), 1u);
  EXPECT_NE(found->warnings[0].find("'inside' is within the component 'base'"), std::string::npos)
      << found->warnings[0];
  JointHints hints;
  JointHint& mine = hints.joints.emplace_back();
  mine.name = "mine", mine.type = robot::JointType::kContinuous, mine.parent = "base", mine.child = "arm";
  mine.axis.clear(), mine.direction = {1, 0, 0};
  const Result<CadRobot> overruled = FindJoints(made.assembly, hints);
  ASSERT_TRUE(overruled.ok()) << overruled.status().message();
  ASSERT_EQ(overruled->robot.joints.size(), 2u);
  EXPECT_EQ(overruled->robot.joints[0].name, "mine");
  EXPECT_EQ(overruled->robot.joints[0].source, "hint");
  EXPECT_EQ(overruled->robot.joints[1].name, "lift");
}

TEST(CadJoints, WhatHintsGetWrongIsNamed) {
  HandMade made = Hinge();
  made.Add("tool", {}, 20);
  const auto joint = [](const std::string& rest) { return R"({"joints": [{"name": "j", )" + rest + "}]}"; };
  const std::pair<std::string, std::string> wrong[] = {
      {"{", "hints: "},
      {"[]", "is to be a JSON object"},
      {R"({"jonts": []})", "did you mean 'joints'"},
      {R"({"base": "sockel"})", "no link or component is 'sockel'"},
      {R"({"links": {"hand": ["hnd*"]}})", "link 'hand': no part is 'hnd*'"},
      {R"({"links": {"hand": {"parts": ["tool"], "mass": -1}}})", "\"mass\" is to be above 0"},
      {joint(R"("parent": "base", "child": "arn")"), "no link or component is 'arn'"},
      {joint(R"("parent": "base")"), "needs a \"parent\" and a \"child\""},
      {joint(R"("parent": "base", "child": "tool")"), "share no axis"},
      {joint(R"("parent": "base", "child": "tool", "axis": "candidate:9")"), "there is no 'candidate:9'"},
      {joint(R"("parent": "base", "child": "tool", "axis": "component:arm")"), "PATH#X, #Y or #Z is expected"},
      {joint(R"("parent": "base", "child": "tool", "axis": "component:leg#Z")"), "no part or component is 'leg'"},
      {joint(R"("parent": "base", "child": "tool", "axis": "sideways")"), "'sideways' is no axis"},
      {joint(R"("parent": "base", "child": "tool", "axis": {"origin": [0, 0, 0], "direction": [0, 0, 0]})"),
       "no length"},
      {joint(R"("parent": "base", "child": "tool", "axis": {"origin": [0, 0]})"), "3 numbers"},
      {joint(R"("parent": "base", "child": "arm", "type": "hinge")"), "'hinge' is no type"},
      {joint(R"("parent": "base", "child": "arm", "limit": [1, 0])"), "above its upper"},
      {joint(R"("parent": "base", "child": "base")"), "fixed to each other"},
      {R"({"joints": [{"name": "j", "parent": "base", "child": "arm"}, {"name": "j", "parent": "base", "child": "arm"}]})",
       "two joints are called 'j'"},
      {R"({"joints": [{"name": "i", "parent": "base", "child": "arm"}, {"name": "j", "parent": "arm", "child": "base"}]})",
       "a loop"},
  };
  for (const auto& [hints, part] : wrong)
    EXPECT_NE(Refused(made, hints).find(part), std::string::npos) << hints << ": " << Refused(made, hints);
}

// A base, and two components that turn about z and about x.
HandMade TwoAxes(const std::string& turret, const std::string& arm) {
  HandMade made;
  const CadCylinder bore{{0, 0, 0.1}, {1, 0, 0}, 0.0081, -0.02, 0.02, 6.3, true};
  CadCylinder pin = bore;
  pin.radius = 0.008, pin.concave = false;
  made.Add("base", {HandMade::Along(10, 20, 8.1, 0, 30, true)}, 200);
  made.Add(turret, {HandMade::Along(10, 20, 8.0, -5, 25, false), bore});
  made.Add(arm, {pin});
  return made;
}

// Its URDF: about z at the origin, about x a little above, in a frame of its own; and an axis that is not there.
robot::RobotDescription TwoAxesUrdf() {
  robot::RobotDescription urdf;
  urdf.links = {{"b", std::nullopt}, {"t", std::nullopt}, {"a", std::nullopt}, {"h", std::nullopt}};
  const auto joint = [](const char* name, const char* parent, const char* child, Vector3 at, Vector3 axis) {
    robot::JointDescription out;
    out.name = name, out.type = JointType::kRevolute, out.parent = parent, out.child = child;
    out.origin.position = at, out.axis = axis;
    out.drive.lower = -1.0, out.drive.upper = 2.0;
    return out;
  };
  // In the CAD file the axes are 20 mm apart: z through (10, 20), x through y = 0 at 100 mm.
  urdf.joints = {joint("yaw", "b", "t", {0.5, 0.02, 0}, {0, 0, 1}),
                 joint("pitch", "t", "a", {0, -0.02, 0.3}, {-1, 0, 0}),
                 joint("roll", "a", "h", {0, 0.4, 0}, {0, 1, 0})};
  urdf.name = "arm";
  return urdf;
}

TEST(CadJoints, AUrdfLaidOverSaysNamesLimitsAndSenses) {
  const HandMade made = TwoAxes("turret", "arm");
  robot::RobotDescription urdf = TwoAxesUrdf();
  const Result<robot::Robot> known = MakeRobot(urdf);
  ASSERT_TRUE(known.ok()) << known.status().message();
  const Result<CadRobot> found = FindJoints(made.assembly, {});
  ASSERT_TRUE(found.ok());
  JointHints hints;
  std::vector<std::string> said;
  const Status laid = LayOver(*known, *found, &hints, &said);
  ASSERT_TRUE(laid.ok()) << laid.message();
  const Result<CadRobot> again = FindJoints(made.assembly, hints);
  ASSERT_TRUE(again.ok()) << again.status().message();
  ASSERT_EQ(again->robot.joints.size(), 2u);
  EXPECT_EQ(again->robot.joints[0].name, "yaw");
  EXPECT_EQ(again->robot.joints[1].name, "pitch");
  for (const JointCandidate& each : again->candidates)
    EXPECT_TRUE(each.verdict == "yaw" || each.verdict == "pitch") << each.verdict;
  EXPECT_EQ(again->robot.joints[1].drive.upper, 2.0);
  EXPECT_NEAR(again->robot.joints[0].axis.z, 1.0, 1e-9);
  EXPECT_NEAR(again->robot.joints[1].axis.x, -1.0, 1e-9) << "the URDF's sense";
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("'roll' of --kinematics is at (0.01, 0.4, 0.1) m along (0, 1, 0)"), std::string::npos)
      << said[0];
  urdf.joints[1].origin.position.y = -0.08;
  JointHints none;
  EXPECT_FALSE(LayOver(*MakeRobot(urdf), *found, &none, &said).ok());
}

// Names that say nothing of which component is meant: the axes do.
TEST(CadJoints, AUrdfIsLaidOverComponentsOfOneNameAndOfPatterns) {
  const std::pair<std::string, std::string> names[] = {{"servo", "servo"}, {"base", "base"}, {"*", "s?rvo"}};
  for (const auto& [turret, arm] : names) {
    const HandMade made = TwoAxes(turret, arm);
    const CadRobot found = Found(made);
    JointHints hints;
    std::vector<std::string> said;
    ASSERT_TRUE(LayOver(*MakeRobot(TwoAxesUrdf()), found, &hints, &said).ok());
    const Result<CadRobot> again = FindJoints(made.assembly, hints);
    ASSERT_TRUE(again.ok()) << again.status().message();
    ASSERT_EQ(again->robot.joints.size(), 2u) << turret;
    EXPECT_EQ(again->robot.joints[0].name, "yaw");
    EXPECT_EQ(again->robot.joints[1].name, "pitch");
    EXPECT_EQ(again->link_of_node, (std::vector<std::int32_t>{-1, 0, 1, 2})) << "each is a link of its own";
  }
}

TEST(CadJoints, PatternsAreOfWholePaths) {
  EXPECT_TRUE(Matches("Base*", "Base v9:1"));
  EXPECT_TRUE(Matches("*/horn:?", "servo:1/horn:2"));
  EXPECT_FALSE(Matches("Base", "Base v9:1"));
  EXPECT_FALSE(Matches("?", ""));
  EXPECT_TRUE(Matches("*", ""));
}

}  // namespace
}  // namespace consac::twin
