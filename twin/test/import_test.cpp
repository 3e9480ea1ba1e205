// An import from outside: what is found, what is refused in one line, and that nothing half written is left.
#include "consac/twin/import.h"

#include <filesystem>

#include "consac/robot/kinematics.h"
#include "consac/twin/mesh.h"
#include "tests/support.h"
#include "twin/test/twin_files.h"

namespace consac::twin {
namespace {

namespace fs = std::filesystem;

// A robot's folder: robot/urdf/arm.urdf and robot/meshes, of a box that is 20 cm high.
class ImportTest : public ::testing::Test {
 protected:
  ImportTest() : scratch_("import") {
    fs::create_directories(At("robot/urdf"));
    fs::create_directories(At("robot/meshes/coarse"));
    const std::vector<std::byte> box = WriteStl(TrianglesOf(ShapeKind::kBox, {0.1, 0.1, 0.2}));
    const std::string text(reinterpret_cast<const char*>(box.data()), box.size());
    PutFile(At("robot/meshes/box.stl"), text);
    PutFile(At("robot/meshes/coarse/box.stl"), text);
    PutFile(At("outside.stl"), text);
    PutFile(At("robot/package.xml"), "<package><name>arm</name><license>MIT</license></package>");
  }
  std::string At(const std::string& name) const { return scratch_.path() + "/" + name; }
  std::string Urdf(const std::string& mesh, const std::string& more = "") const {
    const std::string shape = "<geometry><mesh filename='" + mesh + "' scale='1 1 1'/></geometry>";
    return "<robot name='arm'><link name='base'><visual>" + shape + "</visual></link><link name='tip'><visual>" +
           shape + "</visual><collision>" + shape +
           "</collision></link><joint name='j' type='revolute'><parent link='base'/>"
           "<child link='tip'/><origin xyz='0 0 0.2'/><axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='1' "
           "velocity='1'/>"
           "</joint>" +
           more + "</robot>";
  }
  Result<ImportReport> Run(const std::string& urdf) {
    PutFile(At("robot/urdf/arm.urdf"), urdf);
    options_.output = At("out");
    return Import(At("robot/urdf/arm.urdf"), options_);
  }
  void ExpectRefused(const std::string& urdf, const std::string& part) {
    const Result<ImportReport> report = Run(urdf);
    ASSERT_FALSE(report.ok()) << part;
    EXPECT_NE(report.status().message().find(part), std::string::npos) << report.status().message();
    EXPECT_FALSE(fs::exists(At("out")));
    EXPECT_FALSE(fs::exists(At("out.importing"))) << "nothing half written is left";
  }

  testing::ScratchFolder scratch_;
  ImportOptions options_;
};

TEST_F(ImportTest, MeshesAreFoundByPackageRelativePathAndFile) {
  for (const std::string& mesh :
       {std::string("package://arm/meshes/box.stl"), std::string("package://robot/meshes/box.stl"),
        std::string("../meshes/box.stl"), "file://" + At("robot/meshes/box.stl")}) {
    const Result<ImportReport> report = Run(Urdf(mesh));
    ASSERT_TRUE(report.ok()) << report.status().message();
    EXPECT_EQ(report->meshes, 1u);
    EXPECT_TRUE(fs::exists(At("out/meshes/box.stl")));
    EXPECT_NE(FileText(At("out/twin.json")).find("\"licence\": \"MIT\""), std::string::npos);
    options_.replace = true;
  }
}

TEST_F(ImportTest, WhatIsNotThereOrOutsideIsNamed) {
  ExpectRefused(Urdf("../meshes/bax.stl"), "link 'base': mesh '../meshes/bax.stl' is not there");
  ExpectRefused(Urdf("../../outside.stl"), "leads out of");
  ExpectRefused(Urdf("package://arm/../outside.stl"), "leads out of");
  ExpectRefused(Urdf("package://arm/%2e%2e/outside.stl"), "leads out of");
  ExpectRefused(Urdf("/etc/passwd"), "leads out of");
  ExpectRefused(Urdf("file:///etc/passwd"), "leads out of");
  ExpectRefused(Urdf("https://example.com/a.stl"), "copy it beside the description");
  fs::create_symlink(At("outside.stl"), At("robot/meshes/link.stl"));
  ExpectRefused(Urdf("../meshes/link.stl"), "leads out of");
  fs::remove(At("robot/package.xml"));
  ExpectRefused(Urdf("../meshes/box.stl"), "say which folder may be read: --root FOLDER");
  ExpectRefused(Urdf("package://other/meshes/box.stl"), "--package other=FOLDER");
  options_.root = At("robot");
  options_.packages = {{"other", At("robot")}};
  EXPECT_TRUE(Run(Urdf("package://other/meshes/box.stl")).ok());
}

TEST_F(ImportTest, DamagedMeshesAndDescriptionsLeaveNothing) {
  PutFile(At("robot/meshes/cut.stl"), FileText(At("robot/meshes/box.stl")).substr(0, 300));
  ExpectRefused(Urdf("../meshes/cut.stl"), "it is no STL, or is cut");
  ExpectRefused("<robot", "this is no XML");
  ExpectRefused(Urdf("../meshes/box.stl", "<link name='x'/>"), "two roots");
  options_.progress = [](std::size_t done, std::size_t) { return done < 2; };
  ExpectRefused(Urdf("../meshes/box.stl"), "interrupted");
}

TEST_F(ImportTest, WhatIsThereIsReplacedOnlyIfItIsAnImport) {
  ASSERT_TRUE(Run(Urdf("../meshes/box.stl")).ok());
  EXPECT_NE(Run(Urdf("../meshes/box.stl")).status().message().find("--force to replace it"), std::string::npos);
  options_.replace = true;
  ASSERT_TRUE(Run(Urdf("../meshes/coarse/box.stl")).ok());
  PutFile(At("out/notes.txt"), "mine");
  EXPECT_NE(Run(Urdf("../meshes/box.stl")).status().message().find("holds what is no import's ('notes.txt')"),
            std::string::npos);
  EXPECT_EQ(FileText(At("out/notes.txt")), "mine");
}

TEST_F(ImportTest, EqualNamesStayApart) {
  const std::string more =
      "<link name='l'><visual><geometry><mesh filename='../meshes/coarse/box.stl'/></geometry></visual></link>"
      "<joint name='k' type='fixed'><parent link='tip'/><child link='l'/></joint>";
  const Result<ImportReport> report = Run(Urdf("../meshes/box.stl", more));
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(report->meshes, 2u);
  EXPECT_TRUE(fs::exists(At("out/meshes/coarse_box.stl")));
}

TEST_F(ImportTest, MassesComeFromClosedMeshesAndOnlyWhenAsked) {
  const Result<ImportReport> without = Run(Urdf("../meshes/box.stl"));
  ASSERT_TRUE(without.ok());
  EXPECT_FALSE(without->robot.links[1].inertial.has_value());
  ASSERT_EQ(without->warnings.size(), 1u);
  EXPECT_NE(without->warnings[0].find("without a mass, since the file says none: 'tip'; --density"), std::string::npos);
  options_.density = 1000.0;
  options_.replace = true;
  const Result<ImportReport> with = Run(Urdf("../meshes/box.stl"));
  ASSERT_TRUE(with.ok());
  const robot::Inertial& body = *with->robot.links[1].inertial;
  EXPECT_NEAR(body.mass, 2.0, 1e-6);
  EXPECT_NEAR(body.inertia[0], 2.0 * (0.01 + 0.04) / 12.0, 1e-8) << "x, which was y";
  EXPECT_NEAR(body.inertia[3] + body.inertia[5], 2.0 * (0.02 + 0.05) / 12.0, 1e-8);
  PutFile(At("robot/meshes/open.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const Result<ImportReport> open = Run(Urdf("../meshes/open.obj"));
  ASSERT_TRUE(open.ok());
  EXPECT_NE(open->warnings[0].find("its meshes are not closed, so it has no mass"), std::string::npos)
      << open->warnings[0];
}

TEST_F(ImportTest, AMeshInMillimetresIsNoticed) {
  PutFile(At("robot/meshes/large.obj"), "v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n");
  const Result<ImportReport> report = Run(Urdf("../meshes/large.obj"));
  ASSERT_TRUE(report.ok());
  EXPECT_NE(report->warnings[0].find("is 100 m long; if that is a wrong unit"), std::string::npos)
      << report->warnings[0];
}

TEST_F(ImportTest, ARobotWithoutLooksIsAGlbToo) {
  const Result<ImportReport> report = Run("<robot name='r'><link name='only'/></robot>");
  ASSERT_TRUE(report.ok()) << report.status().message();
  const Glb glb = TakeApart(FileText(At("out/twin.glb")));
  EXPECT_EQ(glb.json["nodes"].size(), 1u);
  EXPECT_FALSE(glb.json.contains("meshes")) << "an empty list would be no glTF";
}

TEST_F(ImportTest, ACapsuleHoldsEachLink) {
  const Result<ImportReport> report = Run(Urdf("../meshes/box.stl"));
  ASSERT_TRUE(report.ok());
  ASSERT_EQ(report->robot.capsules.size(), 1u) << "collisions are there, so they count";
  const robot::Capsule& capsule = report->robot.capsules[0];
  EXPECT_NEAR(capsule.radius, 0.05 * std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(Norm(capsule.to - capsule.from), 0.2, 1e-6) << "the corners are at its balls' equators";
}

TEST_F(ImportTest, OtherFormatsSayWhatToDo) {
  for (const char* name : {"/a.step", "/a.igs", "/a.xacro"}) EXPECT_FALSE(ReadModel(At(name)).ok());
  EXPECT_NE(ReadModel(At("a.xacro")).status().message().find("xacro FILE > robot.urdf"), std::string::npos);
}

}  // namespace
}  // namespace consac::twin
