// USD text from outside: what stands in it, in which unit, under which name. That OpenUSD opens it and finds nothing
// wrong is looked at by tests/slow/twin_judges.py.
#include <algorithm>

#include "tests/support.h"
#include "twin/src/principal.h"
#include "twin/src/usd_text.h"
#include "twin/test/twin_files.h"

namespace consac::twin {
namespace {

std::string Link(const std::string& name, const std::string& shape, const std::string& more = "") {
  const std::string at = "<origin xyz='1 2 3'/><geometry>" + shape + "</geometry>";
  return "<link name='" + name + "'>" + more + "<visual>" + at + "</visual><collision>" + at + "</collision></link>";
}
std::string Joint(const std::string& name, const std::string& type, const std::string& ends, const std::string& more) {
  const std::size_t comma = ends.find(',');
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + ends.substr(0, comma) + "'/><child link='" +
         ends.substr(comma + 1) + "'/><origin xyz='0 0 0.5'/><axis xyz='1 0 0'/>" + more + "</joint>";
}

class Usd : public ::testing::Test {
 protected:
  Usd() : scratch_("usd") {}
  std::string Import(const std::string& urdf, const std::string& srdf = "") {
    Put(scratch_.path() + "/robot.urdf", "<robot name='an arm'>" + urdf + "</robot>");
    ImportOptions options;
    options.output = scratch_.path() + "/out";
    options.replace = true;
    if (!srdf.empty()) {
      options.srdf = scratch_.path() + "/pairs.srdf";
      Put(options.srdf, srdf);
    }
    const Result<ImportReport> report = twin::Import(scratch_.path() + "/robot.urdf", options);
    EXPECT_TRUE(report.ok()) << report.status().message();
    return TextOf(options.output + "/twin.usda");
  }
  testing::ScratchFolder scratch_;
};

// The lines of a prim's block, without what is within prims of it.
std::string Prim(const std::string& text, const std::string& head) {
  const std::size_t at = text.find(head);
  EXPECT_NE(at, std::string::npos) << head;
  if (at == std::string::npos) return "";
  const std::size_t indent = at - (text.rfind('\n', at) + 1);
  return text.substr(at, text.find("\n" + std::string(indent, ' ') + "}\n", at) + 1 - at);
}
void ExpectHolds(const std::string& text, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) EXPECT_NE(text.find(line), std::string::npos) << line << " in\n" << text;
}

TEST_F(Usd, AJointHasItsFrameItsLimitsInDegreesAndADrive) {
  const std::string text =
      Import(Link("base", "<box size='1 2 3'/>") + Link("tip", "<sphere radius='0.5'/>") +
             Joint("turn", "revolute", "base,tip",
                   "<limit lower='-1' upper='2' effort='5' velocity='3'/><dynamics damping='2' friction='0.25'/>"));
  EXPECT_EQ(text.rfind("#usda 1.0\n", 0), 0u);
  ExpectHolds(text, {"defaultPrim = \"an_arm\"", "metersPerUnit = 1\n", "upAxis = \"Z\"", "displayName = \"an arm\""});
  ExpectHolds(Prim(text, "def PhysicsRevoluteJoint \"turn\""),
              {"[\"NewtonJointAPI\", \"PhysicsDriveAPI:angular\"]", "physics:axis = \"X\"",
               "physics:body0 = </an_arm/links/base>", "physics:body1 = </an_arm/links/tip>",
               "physics:localPos0 = (0, 0, 0.5)", "physics:localRot0 = (1, 0, 0, 0)",
               "physics:lowerLimit = -57.29577951308232", "physics:upperLimit = 114.59155902616465",
               "newton:damping = 0.0349065850", "newton:friction = 0.25", "newton:velocityLimit = 171.887338539",
               "drive:angular:physics:maxForce = 5\n", "drive:angular:physics:stiffness = 1.74532925"});
  ExpectHolds(Prim(text, "def PhysicsFixedJoint \"root_joint\""), {"physics:body1 = </an_arm/links/base>"});
  EXPECT_EQ(Prim(text, "def PhysicsFixedJoint \"root_joint\"").find("body0"), std::string::npos) << "the world";
}

TEST_F(Usd, SlidesFollowersAndWhatLimitsHold) {
  const std::string limit = "<limit lower='0' upper='0.5' effort='1' velocity='1'/>";
  const std::string text =
      Import(Link("base", "<box size='1 2 3'/>") + Link("a", "<box size='1 2 3'/>") + Link("b", "<box size='1 2 3'/>") +
             Link("c", "<box size='1 2 3'/>") + Joint("slide", "prismatic", "base,a", limit) +
             Joint("also", "prismatic", "base,b", limit + "<mimic joint='slide' multiplier='-2' offset='0.125'/>") +
             Joint("held", "prismatic", "base,c", "<limit lower='0.25' upper='0.25' effort='1' velocity='1'/>"));
  ExpectHolds(Prim(text, "def PhysicsPrismaticJoint \"slide\""),
              {"physics:lowerLimit = 0\n", "physics:upperLimit = 0.5\n", "PhysicsDriveAPI:linear",
               "drive:linear:physics:stiffness = 100\n"});
  const std::string also = Prim(text, "def PhysicsPrismaticJoint \"also\"");
  ExpectHolds(also, {"NewtonMimicAPI", "newton:mimicJoint = </an_arm/joints/slide>", "newton:mimicCoef0 = 0.125\n",
                     "newton:mimicCoef1 = -2\n"});
  EXPECT_EQ(also.find("DriveAPI"), std::string::npos) << "what follows has no motor";
  ExpectHolds(Prim(text, "def PhysicsFixedJoint \"held\""), {"physics:localPos0 = (0.25, 0, 0.5)"});
  ExpectHolds(Prim(text, "def Xform \"b\""), {"xformOp:translate = (0.125, 0, 0.5)"});
  ExpectHolds(Prim(text, "def Xform \"c\""), {"xformOp:translate = (0.25, 0, 0.5)"});
}

TEST_F(Usd, ShapesCollideAndMeshesStandOnce) {
  const std::string text = Import(
      Link("base", "<box size='1 2 3'/>") + Link("ball", "<sphere radius='0.5'/>") +
      Link("rod", "<cylinder radius='0.5' length='2'/>") + Link("pill", "<capsule radius='0.5' length='2'/>") +
      Link("box", "<box size='1 2 3'/>") + Joint("1", "fixed", "base,ball", "") + Joint("2", "fixed", "base,rod", "") +
      Joint("3", "fixed", "base,pill", "") + Joint("4", "fixed", "base,box", ""));
  ExpectHolds(Prim(text, "def Cube \"collision\""),
              {"PhysicsCollisionAPI", "double size = 1", "xformOp:scale = (1, 2, 3)", "purpose = \"guide\"",
               "xformOp:translate = (1, 2, 3)"});
  ExpectHolds(Prim(text, "def Sphere \"collision\""), {"double radius = 0.5", "extent = [(-0.5, -0.5, -0.5)"});
  ExpectHolds(Prim(text, "def Cylinder \"collision\""), {"axis = \"Z\"", "height = 2\n", "(0.5, 0.5, 1)]"});
  ExpectHolds(Prim(text, "def Capsule \"collision\""), {"height = 2\n", "(0.5, 0.5, 1.5)]"});
  const auto count = [&](const std::string& word) {
    std::size_t found = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("def Mesh \"visual\""), 5u);
  EXPECT_EQ(count("point3f[] points"), 4u) << "two boxes of one size are one mesh";
  EXPECT_EQ(count("prepend references = </an_arm/meshes/shape>"), 2u);
  ExpectHolds(Prim(text, "def Mesh \"shape\""), {"extent = [(-0.5, -1, -1.5), (0.5, 1, 1.5)]",
                                                 "faceVertexCounts = [3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3]"});
}

TEST_F(Usd, MassesAndPairsThatMayTouch) {
  const std::string mass =
      "<inertial><origin xyz='0 0 1'/><mass value='2'/><inertia ixx='3' ixy='0' ixz='0' iyy='2' iyz='0' "
      "izz='4'/></inertial>";
  const std::string text = Import(Link("base", "<box size='1 2 3'/>") + Link("tip", "<box size='1 2 3'/>", mass) +
                                      Joint("j", "fixed", "base,tip", ""),
                                  "<robot><disable_collisions link1='tip' link2='base'/></robot>");
  ExpectHolds(Prim(text, "def Xform \"tip\""), {"PhysicsMassAPI", "centerOfMass = (0, 0, 1)", "mass = 2\n",
                                                "diagonalInertia = (3, 2, 4)", "principalAxes = (1, 0, 0, 0)"});
  const std::string base = Prim(text, "def Xform \"base\"");
  ExpectHolds(base, {"PhysicsFilteredPairsAPI", "physics:filteredPairs = [</an_arm/links/tip>]"});
  EXPECT_EQ(base.find("MassAPI"), std::string::npos) << "nobody said its mass";
}

TEST(UsdText, NamesAreIdentifiersAndDiffer) {
  UsdNames names;
  EXPECT_EQ(names.Make("servo v1:2"), "servo_v1_2");
  EXPECT_EQ(names.Make("servo v1-2"), "servo_v1_2_2");
  EXPECT_EQ(names.Make("3rd"), "_3rd");
  EXPECT_EQ(names.Make(""), "_");
  EXPECT_EQ(names.Make("é"), "__");
}

TEST(UsdText, StringsEndWhereTheyEnd) {
  EXPECT_EQ(UsdQuoted("a \"b\" \\"), "\"a \\\"b\\\" \\\\\"");
  EXPECT_EQ(UsdQuoted("two\nlines").find('\n'), std::string::npos);
}

TEST(Inertia, ItsPrincipalAxesMakeItAgain) {
  const std::array<double, 6> cases[] = {{2, 0.1, 0.2, 3, -0.1, 4},
                                         {1, 0, 0, 1, 0, 1},
                                         {3, 1, 1, 3, 1, 3},
                                         {4, 0, 2, 1, 0, 4},
                                         {1e-9, 2e-10, 0, 2e-9, 0, 3e-9}};
  for (const std::array<double, 6>& inertia : cases) {
    const PrincipalInertia found = PrincipalOf(inertia);
    const std::array<double, 6> diagonal = {found.moments.x, 0, 0, found.moments.y, 0, found.moments.z};
    const std::array<double, 6> again = robot::TurnedInertia(diagonal, Inverse(found.axes));
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(again[i], inertia[i], 1e-12 * std::abs(inertia[0]) + 1e-24) << i;
  }
}

}  // namespace
}  // namespace consac::twin
