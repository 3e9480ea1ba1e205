// consac-cad on files that OpenCASCADE itself writes here (units, nesting, sharing, mirrors, colours), on a real arm,
// and on what is no file at all.
#include <sys/resource.h>
#include <sys/wait.h>

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <IGESControl_Writer.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Quantity_Color.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <STEPControl_Controller.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <gp_Ax2.hxx>
#include <gp_Quaternion.hxx>
#include <gp_Trsf.hxx>
#include <map>
#include <nlohmann/json.hpp>

#include "consac/robot/kinematics.h"
#include "consac/twin/import.h"
#include "tests/support.h"
#include "twin/test/twin_files.h"

namespace consac::twin {
namespace {

namespace fs = std::filesystem;
using robot::Vector3;

gp_Trsf Shift(double x, double y, double z) {
  gp_Trsf out;
  out.SetTranslation(gp_Vec(x, y, z));
  return out;
}

// An assembly that is written as STEP; lengths in the unit that is asked for.
class Drawing {
 public:
  Drawing() {
    Message::DefaultMessenger()->ChangePrinters().Clear();
    XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document_);
    shapes_ = XCAFDoc_DocumentTool::ShapeTool(document_->Main());
    colours_ = XCAFDoc_DocumentTool::ColorTool(document_->Main());
  }
  TDF_Label Part(const TopoDS_Shape& shape, const char* name) {
    const TDF_Label label = shapes_->AddShape(shape, false);
    TDataStd_Name::Set(label, name);
    return label;
  }
  TDF_Label Assembly(const char* name) {
    const TDF_Label label = shapes_->NewShape();
    TDataStd_Name::Set(label, name);
    return label;
  }
  TDF_Label Put(const TDF_Label& assembly, const TDF_Label& what, const gp_Trsf& at, const char* name) {
    const TDF_Label label = shapes_->AddComponent(assembly, what, TopLoc_Location(at));
    TDataStd_Name::Set(label, name);
    return label;
  }
  void Colour(const TDF_Label& label, double r, double g, double b) {
    colours_->SetColor(label, Quantity_Color(r, g, b, Quantity_TOC_sRGB), XCAFDoc_ColorSurf);
  }
  void Write(const std::string& path, const char* unit = "MM", const char* schema = "AP214IS") {
    shapes_->UpdateAssemblies();
    STEPControl_Controller::Init();
    Interface_Static::SetCVal("write.step.unit", unit);
    Interface_Static::SetCVal("write.step.schema", schema);
    STEPCAFControl_Writer writer;
    writer.SetColorMode(true);
    writer.SetNameMode(true);
    ASSERT_TRUE(writer.Transfer(document_, STEPControl_AsIs));
    ASSERT_EQ(writer.Write(path.c_str()), IFSelect_RetDone);
    Interface_Static::SetCVal("write.step.unit", "MM");
    Interface_Static::SetCVal("write.step.schema", "AP214IS");
  }

 private:
  Handle(TDocStd_Document) document_;
  Handle(XCAFDoc_ShapeTool) shapes_;
  Handle(XCAFDoc_ColorTool) colours_;
};

class Cad : public ::testing::Test {
 protected:
  Cad() : scratch_("cad") { options_.cad.program = CONSAC_CAD_PROGRAM; }
  std::string At(const std::string& name) const { return scratch_.path() + "/" + name; }
  Result<ImportReport> Run(const std::string& file, const std::string& out = "out") {
    options_.output = At(out);
    return Import(file.starts_with("/") ? file : At(file), options_);
  }
  void ExpectRefused(const std::string& file, const std::string& part) {
    const Result<ImportReport> report = Run(file);
    ASSERT_FALSE(report.ok()) << file;
    EXPECT_NE(report.status().message().find(part), std::string::npos) << report.status().message();
    EXPECT_EQ(report.status().message().find('\n'), std::string::npos);
    EXPECT_FALSE(fs::exists(At("out")));
    EXPECT_FALSE(fs::exists(At("out.importing")));
  }
  // The box of all vertices, where the nodes put them, of a GLB; in the robot's axes.
  static std::pair<Vector3, Vector3> BoxOf(const Glb& glb, const std::string& part) {
    for (const auto& node : glb.json["nodes"]) {
      if (!node.contains("extras") || node["extras"].value("part", "") != part) continue;
      const auto& primitive = glb.json["meshes"][node["mesh"].get<std::size_t>()]["primitives"][0];
      const auto& accessor = glb.json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
      const std::vector<double> low = accessor["min"], high = accessor["max"];
      const std::vector<double> t = node.value("translation", std::vector<double>{0, 0, 0});
      return {{low[0] + t[0], -high[2] - t[2], low[1] + t[1]}, {high[0] + t[0], -low[2] - t[2], high[1] + t[1]}};
    }
    ADD_FAILURE() << "no part " << part;
    return {};
  }

  testing::ScratchFolder scratch_;
  ImportOptions options_;
};

// What is expected of arm.step, by its maker's own numbers: examples/robots/low_cost_robot_arm/README.md.
const std::string kArm = std::string(CONSAC_SOURCE_DIR) + "/examples/robots/low_cost_robot_arm";

// Seconds of processor that this process and its children took.
double ProcessorSeconds() {
  double seconds = 0.0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used{};
    getrusage(who, &used);
    for (const timeval& part : {used.ru_utime, used.ru_stime})
      seconds += static_cast<double>(part.tv_sec) + 1e-6 * static_cast<double>(part.tv_usec);
  }
  return seconds;
}

TEST_F(Cad, TheSmallArmTakesLessThanTenSeconds) {
  const double before = ProcessorSeconds();
  ASSERT_TRUE(Run(kArm + "/arm.step").ok());
  const double took = ProcessorSeconds() - before;
  RecordProperty("processor_seconds", std::to_string(took));
  EXPECT_LT(took, 10.0) << "s of a core";
}

TEST_F(Cad, TheSmallArmsAxesAreFoundWhereTheyAre) {
  Put(At("hints.json"),
      R"({"joints": [{"name": "elbow", "parent": "XL,XC-330 v1:7", "child": "servo connector angle*",
      "axis": "component:XL,XC-330 v1:7#Z", "limit": [-1.5, 1.5]}]})");
  options_.cad.hints = At("hints.json");
  options_.density = 1000.0;
  const Result<ImportReport> report = Run(kArm + "/arm.step");
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(std::count(report->warnings.begin(), report->warnings.end(),
                       "1 face of part 'moving side' could not be made triangles and is missing"),
            1);
  const Glb glb = TakeApart(TextOf(At("out/twin.glb")));
  std::size_t parts = 0;
  for (const auto& node : glb.json["nodes"]) parts += node.contains("mesh") ? 1 : 0;
  EXPECT_EQ(parts, 161u);
  EXPECT_LT(glb.json["accessors"].size(), 161u) << "what is the same is there once";
  bool steel = false;
  for (const auto& material : glb.json["materials"])
    steel = steel || std::abs(material["pbrMetallicRoughness"]["baseColorFactor"][0].get<double>() - 0.3515) < 1e-4;
  EXPECT_TRUE(steel) << "0.62745 of the file is linear here";
  ASSERT_EQ(report->robot.joints.size(), 3u) << "screws are no joints";
  robot::Kinematics kinematics(report->robot);
  kinematics.Forward(std::vector<double>(3, 0.0));
  const Vector3 one = kinematics.links()[1].position, two = kinematics.links()[2].position,
                three = kinematics.links()[3].position;
  constexpr double kHundredth = 0.01e-3;
  EXPECT_NEAR(one.x, 0.005450, kHundredth);
  EXPECT_NEAR(one.y, 0.116604, kHundredth);
  EXPECT_NEAR(two.y, 0.116604, kHundredth);
  EXPECT_NEAR(two.z, -0.046637, kHundredth);
  EXPECT_NEAR(three.y - two.y, 0.014800, kHundredth);
  EXPECT_NEAR(three.z - two.z, 0.108300, kHundredth);
  const auto axis = [&](std::size_t link) { return Rotate(kinematics.links()[link].rotation, {1, 0, 0}); };
  EXPECT_NEAR(std::abs(axis(1).z), 1.0, 1e-9);
  EXPECT_NEAR(std::abs(axis(2).x), 1.0, 1e-9);
  EXPECT_NEAR(std::abs(axis(3).x), 1.0, 1e-9);
  EXPECT_EQ(report->robot.joints[0].drive.upper, robot::kNoLimit) << "what the file does not say is not made up";
  EXPECT_EQ(report->robot.joints[2].drive.upper, 1.5);
  for (std::size_t link = 1; link < 4; ++link) EXPECT_TRUE(report->robot.links[link].inertial.has_value()) << link;
  const nlohmann::json table = nlohmann::json::parse(TextOf(At("out/twin.json")));
  EXPECT_EQ(table["source"]["format"], "step");
}

TEST_F(Cad, TheSameFileGivesTheSameBytes) {
  ASSERT_TRUE(Run(kArm + "/arm.step", "a").ok());
  ASSERT_TRUE(Run(kArm + "/arm.step", "b").ok());
  for (const auto& entry : fs::recursive_directory_iterator(At("a"))) {
    if (!entry.is_regular_file()) continue;
    const std::string name = fs::relative(entry.path(), At("a")).string();
    EXPECT_EQ(TextOf(At("a/" + name)), TextOf(At("b/" + name))) << name;
  }
}

TEST_F(Cad, InchesNestingAndSharingComeOutInMetres) {
  Drawing drawing;
  const TDF_Label block = drawing.Part(BRepPrimAPI_MakeBox(25.4, 50.8, 76.2).Shape(), "block");
  const TDF_Label top = drawing.Assembly("machine"), inner = drawing.Assembly("inner");
  gp_Trsf turned = Shift(100, 0, 0);
  turned.SetRotationPart(gp_Quaternion(gp_Vec(0, 0, 1), std::acos(-1.0) / 2));
  drawing.Put(inner, block, Shift(0, 0, 10), "left");
  drawing.Put(inner, block, Shift(0, 0, 200), "right");
  drawing.Put(top, inner, turned, "pair");
  const TDF_Label lone = drawing.Put(top, block, Shift(-254, 0, 0), "base");
  drawing.Colour(block, 0.2, 0.4, 0.6);
  drawing.Colour(lone, 0.9, 0.1, 0.1);
  for (const char* unit : {"MM", "INCH"}) {
    drawing.Write(At("machine.step"), unit);
    if (std::string(unit) == "INCH") {
      EXPECT_NE(TextOf(At("machine.step")).find("INCH"), std::string::npos);
    }
    const Result<ImportReport> report = Run("machine.step", unit);
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_EQ(report->meshes, 1u) << "one product";
    EXPECT_EQ(report->robot.name, "machine");
    const Glb glb = TakeApart(TextOf(At(std::string(unit) + "/twin.glb")));
    const auto [low, high] = BoxOf(glb, "base");
    EXPECT_NEAR(Norm(low - Vector3{-0.254, 0, 0}), 0.0, 1e-7);
    EXPECT_NEAR(Norm(high - Vector3{-0.2286, 0.0508, 0.0762}), 0.0, 1e-7);
    Result<CadRobot> found = FindCandidates(At("machine.step"), options_.cad, {});
    ASSERT_TRUE(found.ok());
    ASSERT_EQ(found->groups.size(), 2u);
    const CadGroup& pair = found->groups[0].name == "pair" ? found->groups[0] : found->groups[1];
    EXPECT_NEAR(Norm(pair.low - Vector3{0.1 - 0.0508, 0, 0.01}), 0.0, 1e-7) << "turned by a right angle";
    EXPECT_NEAR(Norm(pair.high - Vector3{0.1, 0.0254, 0.2762}), 0.0, 1e-7);
    std::vector<double> reds;
    for (const auto& material : glb.json["materials"])
      reds.push_back(material["pbrMetallicRoughness"]["baseColorFactor"][0]);
    std::sort(reds.begin(), reds.end());
    ASSERT_EQ(reds.size(), 2u) << "the product's and the one occurrence's";
    EXPECT_NEAR(reds[0], std::pow((0.2 + 0.055) / 1.055, 2.4), 1e-4);
    EXPECT_NEAR(reds[1], std::pow((0.9 + 0.055) / 1.055, 2.4), 1e-4);
  }
}

// Three plates, each turning on a pin of the one before.
void DrawHinges(const std::string& path, int count, const char* schema = "AP214IS") {
  Drawing drawing;
  const TDF_Label top = drawing.Assembly("chain");
  const auto cylinder = [](double x, double radius, double low, double high) {
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, 15, low), gp_Dir(0, 0, 1)), radius, high - low).Shape();
  };
  const TopoDS_Shape plate = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), 110, 30, 10).Shape();
  const TDF_Label link = drawing.Part(BRepAlgoAPI_Cut(plate, cylinder(15, 5.0, -1, 11)).Shape(), "plate");
  const TDF_Label pin = drawing.Part(cylinder(95, 4.9, 0, 20), "pin");
  for (int i = 0; i < count; ++i) {
    const TDF_Label unit = drawing.Assembly(("unit " + std::to_string(i)).c_str());
    drawing.Put(unit, link, gp_Trsf(), "plate");
    if (i + 1 < count) drawing.Put(unit, pin, gp_Trsf(), "pin");
    drawing.Put(top, unit, Shift(80.0 * i, 0, 10.0 * i), i == 0 ? "base" : ("unit " + std::to_string(i)).c_str());
  }
  drawing.Write(path, "MM", schema);
}

TEST_F(Cad, EverySchemaOfStepIsTheSameRobot) {
  for (const auto& [schema, name] :
       {std::pair("AP203", "CONFIG_CONTROL_DESIGN"), std::pair("AP214IS", "AUTOMOTIVE_DESIGN"),
        std::pair("AP242DIS", "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING")}) {
    DrawHinges(At("chain.step"), 3, schema);
    EXPECT_NE(TextOf(At("chain.step")).find(name), std::string::npos) << schema;
    const Result<ImportReport> report = Run("chain.step", schema);
    ASSERT_TRUE(report.ok()) << schema << ": " << report.status().message();
    ASSERT_EQ(report->robot.joints.size(), 2u) << schema;
    robot::Kinematics kinematics(report->robot);
    kinematics.Forward(std::vector<double>(2, 0.0));
    EXPECT_NEAR(kinematics.links()[2].position.x, 0.175, 1e-9) << schema;
    EXPECT_EQ(report->robot.links[0].name, "base") << schema;
  }
}

// Three blocks that share no axis, and the kinematics of AP242 as text behind what OpenCASCADE writes; lengths in the
// file's unit. Source of the entities: ISO 10303-105.
TEST_F(Cad, JointsOfTheFilesOwnAreRead) {
  for (const auto& [unit, of_metre] : {std::pair("MM", 1000.0), std::pair("INCH", 1.0 / 0.0254)}) {
    Drawing drawing;
    const TDF_Label top = drawing.Assembly("machine"),
                    block = drawing.Part(BRepPrimAPI_MakeBox(100, 40, 20).Shape(), "block");
    drawing.Put(top, block, Shift(0, -100, 0), "base");
    drawing.Put(top, block, Shift(200, 0, 0), "arm");
    gp_Trsf turned = Shift(400, 0, 0);
    turned.SetRotationPart(gp_Quaternion(gp_Vec(1, 0, 0), std::acos(-1.0) / 2));
    drawing.Put(top, block, turned, "slide");
    drawing.Write(At("own.step"), unit, "AP242DIS");
    std::string text = TextOf(At("own.step"));
    const auto number = [&](const std::string& entity, const std::string& with) {  // of the entity, as "#12"
      std::size_t at = text.find(entity);
      while (at != std::string::npos && text.substr(at, text.find(';', at) - at).find(with) == std::string::npos)
        at = text.find(entity, at + 1);
      EXPECT_NE(at, std::string::npos) << entity << " " << with;
      const std::size_t hash = text.rfind('#', at);
      return text.substr(hash, text.find_first_of(" =", hash) - hash);
    };
    std::string own;
    const std::string context = number("GEOMETRIC_REPRESENTATION_CONTEXT(3)", "");
    const std::string shape = number("SHAPE_REPRESENTATION(", "");
    int next = 900000;
    const auto add = [&](const std::string& entity) {
      own += "#" + std::to_string(++next) + "=" + entity + ";\n";
      return "#" + std::to_string(next);
    };
    const auto frame = [&](double x, double y, double z) {
      const auto real = [&](double metres) { return std::to_string(metres * of_metre); };
      const std::string point = add("CARTESIAN_POINT('',(" + real(x) + "," + real(y) + "," + real(z) + "))");
      return add("AXIS2_PLACEMENT_3D(''," + point + ",$,$)");
    };
    std::map<std::string, std::string> links;
    for (const char* name : {"base", "arm", "slide"}) {
      links[name] = add("KINEMATIC_LINK('" + std::string(name) + "')");
      const std::string seen = add("RIGID_LINK_REPRESENTATION('" + std::string(name) + "',(" + frame(0, 0, 0) + ")," +
                                   context + "," + links[name] + ")");
      const std::string meant = add("KINEMATIC_LINK_REPRESENTATION_ASSOCIATION('',$," + seen + "," + shape + ")");
      const std::string place = add("PRODUCT_DEFINITION_RELATIONSHIP_KINEMATICS('',$," +
                                    number("NEXT_ASSEMBLY_USAGE_OCCURRENCE", "'" + std::string(name) + "'") + ")");
      add("CONTEXT_DEPENDENT_KINEMATIC_LINK_REPRESENTATION(" + meant + "," + place + ")");
    }
    const auto joint = [&](const std::string& name, const char* first, const char* second) {
      return add("KINEMATIC_JOINT('" + name + "'," + links[first] + "," + links[second] + ")");
    };
    const std::string turn =
        add("REVOLUTE_PAIR_WITH_RANGE('turn','','$'," + frame(0.15, 0.02, 0) + "," + frame(0, 0, 0) + "," +
            joint("turn", "base", "arm") + ",.F.,.F.,.F.,.F.,.F.,.T.,-1.5,2.)");
    add("REVOLUTE_PAIR_VALUE(''," + turn + ",0.25)");
    add("PRISMATIC_PAIR_WITH_RANGE('lift','','$'," + frame(0, 0, 0) + "," + frame(0, 0, 0) + "," +
        joint("lift", "arm", "slide") + ",.F.,.F.,.T.,.F.,.F.,.F.,0.," + std::to_string(0.05 * of_metre) + ")");
    add("SPHERICAL_PAIR('ball','','$'," + frame(0, 0, 0) + "," + frame(0, 0, 0) + "," + joint("ball", "base", "slide") +
        ",.F.,.F.,.F.,.T.,.T.,.T.)");
    const std::size_t end = text.rfind("ENDSEC;");
    Put(At("own.step"), text.substr(0, end) + own + text.substr(end));
    const Result<ImportReport> report = Run("own.step", unit);
    ASSERT_TRUE(report.ok()) << report.status().message();
    ASSERT_EQ(report->robot.joints.size(), 2u) << TextOf(At(std::string(unit) + "/report.json"));
    const robot::Joint &first = report->robot.joints[0], &second = report->robot.joints[1];
    EXPECT_EQ(first.name, "turn");
    EXPECT_EQ(first.type, robot::JointType::kRevolute);
    EXPECT_EQ(first.source, "step");
    EXPECT_NEAR(first.drive.lower, -1.5, 1e-9);
    EXPECT_NEAR(first.drive.upper, 2.0, 1e-9);
    EXPECT_EQ(second.name, "lift");
    EXPECT_EQ(second.type, robot::JointType::kPrismatic);
    EXPECT_NEAR(second.drive.upper, 0.05, 1e-7);
    robot::Kinematics kinematics(report->robot);
    kinematics.Forward(std::vector<double>{0.25, 0.0});
    const robot::Transform arm = kinematics.links()[1];
    EXPECT_NEAR(Norm(arm.position - Vector3{0.15, -0.08, 0}), 0.0, 1e-7);
    EXPECT_NEAR(Norm(Rotate(arm.rotation, {1, 0, 0}) - Vector3{0, 0, 1}), 0.0, 1e-9);
    const Vector3 before = kinematics.links()[2].position;
    kinematics.Forward(std::vector<double>{0.25, 0.03});
    EXPECT_NEAR(Norm(kinematics.links()[2].position - before - Vector3{0, 0, 0.03}), 0.0, 1e-9)
        << "along z, as its flag says";
    EXPECT_NE(TextOf(At(std::string(unit) + "/report.json")).find("its own joint 'ball' neither turns nor slides"),
              std::string::npos);
  }
}

TEST_F(Cad, PinsInBoresAreJointsWithExactAxesAndMasses) {
  DrawHinges(At("chain.step"), 3);
  options_.density = 2700.0;
  options_.cad.angle = 0.1;
  const Result<ImportReport> report = Run("chain.step");
  ASSERT_TRUE(report.ok()) << report.status().message();
  ASSERT_EQ(report->robot.joints.size(), 2u);
  robot::Kinematics kinematics(report->robot);
  kinematics.Forward(std::vector<double>(2, 0.0));
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_NEAR(kinematics.links()[i].position.x, 0.015 + 0.080 * static_cast<double>(i), 1e-9);
    EXPECT_NEAR(kinematics.links()[i].position.y, 0.015, 1e-9);
  }
  const double pi = std::acos(-1.0);
  const double plate = (0.110 * 0.030 - pi * 0.005 * 0.005) * 0.010, pin = pi * 0.0049 * 0.0049 * 0.020;
  ASSERT_TRUE(report->robot.links[2].inertial.has_value());
  EXPECT_NEAR(report->robot.links[2].inertial->mass, 2700.0 * plate, 2700.0 * plate * 1e-3);
  EXPECT_NEAR(report->robot.links[1].inertial->mass, 2700.0 * (plate + pin), 2700.0 * plate * 2e-3);
  options_.density = 0.0;
  options_.replace = true;
  const Result<ImportReport> weightless = Run("chain.step");
  ASSERT_TRUE(weightless.ok());
  EXPECT_FALSE(weightless->robot.links[1].inertial.has_value()) << "nothing is made up";
  EXPECT_NE(TextOf(At("out/report.json")).find("without a mass"), std::string::npos);
}

void Replace(std::string* text, const std::string& what, const std::string& by) {
  const std::size_t at = text->find(what);
  ASSERT_NE(at, std::string::npos) << what;
  text->replace(at, what.size(), by);
}

TEST_F(Cad, AMirroredPartIsReadAndAMirroredPlaceRefused) {
  gp_Trsf mirror;
  mirror.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)));
  Drawing drawing;
  const TDF_Label top = drawing.Assembly("machine");
  const TopoDS_Shape block = BRepPrimAPI_MakeBox(10, 20, 30).Shape();
  drawing.Put(top, drawing.Part(block, "block"), Shift(100, 0, 0), "right");
  drawing.Put(top, drawing.Part(BRepBuilderAPI_Transform(block, mirror, true).Shape(), "mirrored"), Shift(-100, 0, 0),
              "left");
  drawing.Write(At("machine.step"));
  options_.density = 1000.0;
  const Result<ImportReport> report = Run("machine.step", "mirrored part");
  ASSERT_TRUE(report.ok()) << report.status().message();
  const auto [low, high] = BoxOf(TakeApart(TextOf(At("mirrored part/twin.glb"))), "left");
  EXPECT_NEAR(Norm(low - Vector3{-0.110, 0, 0}), 0.0, 1e-7);
  EXPECT_NEAR(Norm(high - Vector3{-0.100, 0.020, 0.030}), 0.0, 1e-7);
  EXPECT_NEAR(report->robot.links[0].inertial->mass, 2 * 1000.0 * 6e-6, 1e-8) << "its triangles face outwards";

  const std::string written = TextOf(At("machine.step"));
  const std::size_t at = written.find("ITEM_DEFINED_TRANSFORMATION("), end = written.find(");", at);
  ASSERT_NE(at, std::string::npos);
  const std::string plain = written.substr(at, end + 2 - at);
  const auto write = [&](const std::string& names, const std::string& scale, const std::string& third) {
    std::string text = written;
    Replace(&text, plain,
            "CARTESIAN_TRANSFORMATION_OPERATOR_3D(" + names + ",#900001,#900002,#900003," + scale +
                ",#900004);\n#900001=DIRECTION('',(1.,0.,0.));\n#900002=DIRECTION('',(0.,1.,0.));\n"
                "#900003=CARTESIAN_POINT('',(9.,0.,0.));\n#900004=DIRECTION('',(0.,0.," +
                third + "));");
    Put(At("machine.step"), text);
  };
  write("'','',''", "1.", "-1.");
  ExpectRefused("machine.step", "places a part as a mirror image");
  write("'','',''", "2.", "1.");
  ExpectRefused("machine.step", "places a part with a scale of 2");
  write("''", "1.", "-1.");  // too few members: OpenCASCADE 7.6 reads through a null pointer
  ExpectRefused("machine.step", "machine.step': ");
}

TEST_F(Cad, IgesIsGeometryOnlyAndSaysSo) {
  IGESControl_Writer writer("MM", 1);
  ASSERT_TRUE(writer.AddShape(BRepPrimAPI_MakeBox(10, 20, 30).Shape()));
  writer.ComputeModel();
  ASSERT_TRUE(writer.Write(At("box.igs").c_str()));
  const Result<ImportReport> report = Run("box.igs");
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(report->robot.joints.size(), 0u);
  EXPECT_NE(TextOf(At("out/report.json")).find("IGES holds geometry only"), std::string::npos);
  const nlohmann::json table = nlohmann::json::parse(TextOf(At("out/twin.json")));
  EXPECT_EQ(table["source"]["format"], "iges");
}

TEST_F(Cad, CutRandomAndTooLargeIsOneLine) {
  const std::string whole = TextOf(kArm + "/arm.step");
  for (const double share : {0.0, 0.001, 0.3, 0.9, 0.9999}) {
    Put(At("cut.step"), whole.substr(0, static_cast<std::size_t>(static_cast<double>(whole.size()) * share)));
    ExpectRefused("cut.step", "cut.step': it is");
  }
  Put(At("cut.step"), whole.substr(0, 20000) + "\nENDSEC;\nEND-ISO-10303-21;\n");
  ExpectRefused("cut.step", "cut.step': ");
  std::string noise = whole.substr(0, 300000);
  for (std::size_t i = 2000; i < noise.size(); i += 37) noise[i] = static_cast<char>(i * 7919 >> 3);
  Put(At("noise.stp"), noise + "\nENDSEC;\nEND-ISO-10303-21;\n");
  ExpectRefused("noise.stp", "noise.stp': ");
  Put(At("no.igs"), "hello\n");
  ExpectRefused("no.igs", "it is no IGES file, or is cut");
  ExpectRefused("nowhere.step", "nowhere.step");
  options_.cad.mebibytes = 100.0;
  ExpectRefused(kArm + "/arm.step", "--cad-mebibytes");
  options_.cad.mebibytes = 4096.0;
  options_.cad.seconds = 0.05;
  ExpectRefused(kArm + "/arm.step", "took more than 0.05 s");
}

// Its processor time ends by the signal that says so, not by the one that may mean memory.
TEST_F(Cad, TheLimitOfProcessorTimeIsTold) {
  const std::string fine = " 0.0001 0.0005 1 4096 >/dev/null 2>&1";
  const int status = std::system(("exec '" CONSAC_CAD_PROGRAM "' '" + kArm + "/arm.step'" + fine).c_str());
  ASSERT_TRUE(WIFSIGNALED(status)) << status;
  EXPECT_EQ(WTERMSIG(status), SIGXCPU);
}

// 5,000 parts in 1,000 components, 100 of the parts unlike each other; four of every five are screws.
TEST_F(Cad, FiveThousandPartsFitIntoTimeAndMemory) {
  {
    Drawing drawing;
    const TDF_Label top = drawing.Assembly("large");
    const TDF_Label screw = drawing.Part(BRepPrimAPI_MakeCylinder(1.5, 8).Shape(), "screw M3x8");
    std::vector<TDF_Label> plates;
    for (int i = 0; i < 99; ++i) {
      const TopoDS_Shape hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(10, 10, -1), gp_Dir(0, 0, 1)), 4, 12).Shape();
      const TopoDS_Shape plate = BRepPrimAPI_MakeBox(40.0 + 0.1 * i, 30, 10).Shape();
      plates.push_back(drawing.Part(BRepAlgoAPI_Cut(plate, hole).Shape(), ("plate " + std::to_string(i)).c_str()));
    }
    for (int i = 0; i < 1000; ++i) {
      const TDF_Label unit = drawing.Assembly(("unit " + std::to_string(i)).c_str());
      drawing.Put(unit, plates[static_cast<std::size_t>(i) % plates.size()], Shift(0, 0, 1), "plate");
      for (int k = 0; k < 4; ++k) drawing.Put(unit, screw, Shift(5 + 8 * k, 25, 3), "screw");
      drawing.Put(top, unit, Shift(110 * (i % 40), 60 * (i / 40), 0), ("unit " + std::to_string(i)).c_str());
    }
    drawing.Write(At("large.step"));
  }
  options_.cad.mebibytes = 4096.0;
  options_.cad.seconds = 1e6;  // of a clock; a machine under test does other things too
  const double before = ProcessorSeconds();
  const Result<ImportReport> report = Run("large.step");
  const double took = ProcessorSeconds() - before;
  ASSERT_TRUE(report.ok()) << report.status().message();
  RecordProperty("processor_seconds", std::to_string(took));
  EXPECT_LT(took, 120.0) << "s of a core";
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  EXPECT_LT(used.ru_maxrss, 4096L * 1024) << "KiB of this process; consac-cad is held to as much";
  EXPECT_EQ(report->meshes, 100u);
  EXPECT_EQ(report->robot.joints.size(), 0u) << "screws are no joints";
}

}  // namespace
}  // namespace consac::twin
