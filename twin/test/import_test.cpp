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
    Put(At("robot/meshes/box.stl"), text);
    Put(At("robot/meshes/coarse/box.stl"), text);
    Put(At("outside.stl"), text);
    Put(At("robot/package.xml"), "<package><name>arm</name><license>MIT</license></package>");
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
    Put(At("robot/urdf/arm.urdf"), urdf);
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
    EXPECT_NE(TextOf(At("out/twin.json")).find("\"licence\": \"MIT\""), std::string::npos);
    options_.replace = true;
  }
}

TEST_F(ImportTest, APackageMayLieBesideTheDescription) {
  fs::create_directories(At("robot/urdf/looks/meshes"));
  fs::copy(At("robot/meshes/box.stl"), At("robot/urdf/looks/meshes/box.stl"));
  fs::remove(At("robot/package.xml"));
  options_.root = At("robot");
  const Result<ImportReport> report = Run(Urdf("package://looks/meshes/box.stl"));
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(report->meshes, 1u);
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
  Put(At("robot/meshes/cut.stl"), TextOf(At("robot/meshes/box.stl")).substr(0, 300));
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
  Put(At("out/notes.txt"), "mine");
  EXPECT_NE(Run(Urdf("../meshes/box.stl")).status().message().find("holds what is no import's ('notes.txt')"),
            std::string::npos);
  EXPECT_EQ(TextOf(At("out/notes.txt")), "mine");
}

// A CAD file takes its time, and what is wrong with it does not matter before.
TEST_F(ImportTest, TheFolderIsLookedAtBeforeTheFile) {
  ASSERT_TRUE(Run(Urdf("../meshes/box.stl")).ok());
  EXPECT_NE(Run("<robot").status().message().find("--force to replace it"), std::string::npos);
  EXPECT_NE(Import(At("arm.step"), options_).status().message().find("--force to replace it"), std::string::npos);
  options_.output = At("new/out");
  EXPECT_FALSE(Import(At("arm.step"), options_).ok());
  EXPECT_FALSE(fs::exists(At("new"))) << "nothing is made for a file that is not there";
}

// What the user has put there, by every way that looks like an import's folder.
TEST_F(ImportTest, AFolderThatIsNoImportsIsNeverReplaced) {
  const std::string mine = At("out/meshes/mine.stl"), urdf = Urdf("../meshes/box.stl");
  options_.replace = true;
  const auto expect_kept = [&](const std::string& part) {
    const Result<ImportReport> report = Run(urdf);
    ASSERT_FALSE(report.ok()) << part;
    EXPECT_NE(report.status().message().find(part), std::string::npos) << report.status().message();
    EXPECT_EQ(TextOf(mine), "mine");
  };
  fs::create_directories(At("out/meshes"));
  Put(mine, "mine");
  expect_kept("no twin.json that an import wrote");
  Put(At("out/twin.json"), "{\"format\": \"another\"}");
  expect_kept("no twin.json that an import wrote");
  Put(At("out/twin.json"), "{\"format\": \"consac-twin\"}");
  expect_kept("no report.json that an import wrote");
  fs::remove_all(At("out"));
  ASSERT_TRUE(Run(urdf).ok());
  Put(mine, "mine");
  expect_kept("'meshes/mine.stl'");
  fs::remove(mine);
  EXPECT_TRUE(Run(urdf).ok());
}

TEST_F(ImportTest, WhatStandsBesideThePlaceIsLeftAlone) {
  for (const char* beside : {"out.replaced", "out.importing", "out.importing-2"}) {
    fs::create_directories(At(beside));
    Put(At(beside) + std::string("/twin.glb"), "mine");
  }
  for (int time = 0; time < 2; ++time) {
    const Result<ImportReport> report = Run(Urdf("../meshes/box.stl"));
    ASSERT_TRUE(report.ok()) << report.status().message();
    options_.replace = true;
  }
  for (const char* beside : {"out.replaced", "out.importing", "out.importing-2"})
    EXPECT_EQ(TextOf(At(beside) + std::string("/twin.glb")), "mine");
  EXPECT_FALSE(fs::exists(At("out.importing-3")));
}

// Two imports to one place, and other things that come while one is under way.
TEST_F(ImportTest, WhatAppearsWhileAnImportRunsIsKept) {
  const std::string urdf = Urdf("../meshes/box.stl");
  options_.progress = [&](std::size_t done, std::size_t) {
    if (done == 0) fs::create_directories(At("out"));
    Put(At("out/notes.txt"), "mine");
    return true;
  };
  for (const bool replace : {false, true}) {
    fs::remove_all(At("out"));
    options_.replace = replace;
    EXPECT_NE(Run(urdf).status().message().find("holds what is no import's"), std::string::npos);
    EXPECT_EQ(TextOf(At("out/notes.txt")), "mine");
  }
  fs::remove_all(At("out"));
  options_.replace = false;
  options_.progress = [&](std::size_t done, std::size_t) {
    ImportOptions other;
    other.output = At("out");
    return done > 0 || Import(At("robot/urdf/arm.urdf"), other).ok();
  };
  EXPECT_NE(Run(urdf).status().message().find("holds an import already"), std::string::npos);
  EXPECT_TRUE(LoadRobot(At("out")).ok());
  EXPECT_FALSE(fs::exists(At("out.importing")));
}

TEST_F(ImportTest, ALinkMeansTheFolderItLeadsTo) {
  fs::create_directories(At("real"));
  fs::create_directory_symlink(At("real"), At("out"));
  options_.replace = true;
  for (int time = 0; time < 2; ++time) {
    const Result<ImportReport> report = Run(Urdf("../meshes/box.stl"));
    ASSERT_TRUE(report.ok()) << report.status().message();
  }
  EXPECT_TRUE(fs::is_symlink(At("out")));
  EXPECT_TRUE(fs::is_regular_file(At("real/twin.glb")));
}

TEST_F(ImportTest, EqualNamesStayApart) {
  const auto also = [](const std::string& mesh, const std::string& link) {
    return "<link name='" + link + "'><visual><geometry><mesh filename='" + mesh +
           "'/></geometry></visual></link><joint name='to_" + link +
           "' type='fixed'><parent link='tip'/><child link='" + link + "'/></joint>";
  };
  Put(At("robot/meshes/coarse/BOX.stl"), TextOf(At("robot/meshes/box.stl")));
  const Result<ImportReport> report =
      Run(Urdf("../meshes/box.stl", also("../meshes/coarse/box.stl", "l") + also("../meshes/coarse/BOX.stl", "m")));
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(report->meshes, 3u);
  EXPECT_TRUE(fs::exists(At("out/meshes/coarse_box.stl")));
  EXPECT_TRUE(fs::exists(At("out/meshes/coarse_BOX_2.stl"))) << "where capitals do not count it is another file too";
}

TEST_F(ImportTest, AGltfsBuffersStandBesideIt) {
  const auto gltf = [](const std::string& buffer) {
    return R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
      "buffers": [{"byteLength": 36, "uri": ")" +
           buffer + R"("}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}]})";
  };
  const float points[] = {0, 0, 0, 1, 0, 0, 0, 2, 0};
  const std::string numbers(reinterpret_cast<const char*>(points), sizeof points);
  Put(At("robot/meshes/plate.gltf"), gltf("plate.bin"));
  ExpectRefused(Urdf("../meshes/plate.gltf"), "plate.bin");
  Put(At("robot/meshes/plate.bin"), numbers);
  const Result<ImportReport> report = Run(Urdf("../meshes/plate.gltf"));
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(report->triangles, 1u);
  fs::remove_all(At("out"));
  Put(At("outside.bin"), numbers);
  Put(At("robot/meshes/plate.gltf"), gltf("../../outside.bin"));
  ExpectRefused(Urdf("../meshes/plate.gltf"), "a buffer's file");
  fs::create_symlink(At("outside.bin"), At("robot/meshes/link.bin"));
  Put(At("robot/meshes/plate.gltf"), gltf("link.bin"));
  ExpectRefused(Urdf("../meshes/plate.gltf"), "is a link");
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
  Put(At("robot/meshes/open.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const Result<ImportReport> open = Run(Urdf("../meshes/open.obj"));
  ASSERT_TRUE(open.ok());
  EXPECT_NE(open->warnings[0].find("its meshes are not closed, or are inside out, so it has no mass"),
            std::string::npos)
      << open->warnings[0];
}

TEST_F(ImportTest, AMeshInMillimetresIsNoticed) {
  Put(At("robot/meshes/large.obj"), "v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n");
  const Result<ImportReport> report = Run(Urdf("../meshes/large.obj"));
  ASSERT_TRUE(report.ok());
  EXPECT_NE(report->warnings[0].find("is 100 m long; if that is a wrong unit"), std::string::npos)
      << report->warnings[0];
}

TEST_F(ImportTest, WrongUnitsAreNoticed) {
  const Result<ImportReport> report =
      Run(Urdf("../meshes/box.stl",
               "<link name='far'><visual><geometry><box size='300 1 1'/></geometry></visual></link>"
               "<joint name='k' type='revolute'><parent link='tip'/><child link='far'/>"
               "<axis xyz='0 0 1'/><limit lower='-160' upper='160'/></joint>"));
  ASSERT_TRUE(report.ok()) << report.status().message();
  ASSERT_GE(report->warnings.size(), 2u);
  EXPECT_NE(report->warnings[0].find("joint 'k': its limits of -160 to 160 rad are 51 turns apart"), std::string::npos)
      << report->warnings[0];
  EXPECT_NE(report->warnings[1].find("is 300 m long; if that is a wrong unit, mend its size, in metres"),
            std::string::npos)
      << report->warnings[1];
}

TEST_F(ImportTest, ARobotWithoutLooksIsAGlbToo) {
  const Result<ImportReport> report = Run("<robot name='r'><link name='only'/></robot>");
  ASSERT_TRUE(report.ok()) << report.status().message();
  const Glb glb = TakeApart(TextOf(At("out/twin.glb")));
  EXPECT_EQ(glb.json["nodes"].size(), 1u);
  EXPECT_FALSE(glb.json.contains("meshes")) << "an empty list would be no glTF";
}

TEST_F(ImportTest, ACapsuleHoldsEachLink) {
  const Result<ImportReport> report = Run(Urdf("../meshes/box.stl"));
  ASSERT_TRUE(report.ok());
  ASSERT_EQ(report->robot.capsules.size(), 2u) << "the base has looks alone, and they count";
  EXPECT_EQ(report->robot.capsules[0].link, 0);
  const robot::Capsule& capsule = report->robot.capsules[1];
  EXPECT_NEAR(capsule.radius, 0.05 * std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(Norm(capsule.to - capsule.from), 0.2, 1e-6) << "the corners are at its balls' equators";
}

TEST_F(ImportTest, EachLinkIsMeasuredByWhatItHas) {
  const std::string wide =
      "<link name='l'><visual><geometry><box size='1 1 1'/></geometry></visual><collision><geometry><box size='2 2 2'/>"
      "</geometry></collision></link><link name='m'><visual><geometry><box size='1 1 1'/></geometry></visual></link>"
      "<joint name='k' type='fixed'><parent link='tip'/><child link='l'/></joint>"
      "<joint name='n' type='fixed'><parent link='l'/><child link='m'/></joint>";
  options_.density = 1000.0;
  const Result<ImportReport> report = Run(Urdf("../meshes/box.stl", wide));
  ASSERT_TRUE(report.ok()) << report.status().message();
  ASSERT_EQ(report->robot.capsules.size(), 4u);
  EXPECT_NEAR(report->robot.links[2].inertial->mass, 8000.0, 1e-3) << "by what it collides by";
  ASSERT_TRUE(report->robot.links[3].inertial.has_value()) << "it collides by nothing, other links do";
  EXPECT_NEAR(report->robot.links[3].inertial->mass, 1000.0, 1e-3);
}

TEST_F(ImportTest, TheTableNamesTheBytesThatWereRead) {
  ASSERT_TRUE(Run(Urdf("../meshes/box.stl")).ok());
  const auto sum = [&] { return nlohmann::json::parse(TextOf(At("out/twin.json")))["source"]["sha256"]; };
  const nlohmann::json before = sum();
  options_.replace = true;
  options_.progress = [&](std::size_t, std::size_t) {
    Put(At("robot/urdf/arm.urdf"), "another");
    return true;
  };
  ASSERT_TRUE(Run(Urdf("../meshes/box.stl")).ok());
  EXPECT_EQ(sum(), before);
}

TEST_F(ImportTest, EveryStepCanBeInterrupted) {
  std::size_t calls = 0, most = 0;
  options_.progress = [&](std::size_t done, std::size_t of) {
    EXPECT_EQ(done, calls++);
    most = of;
    return true;
  };
  ASSERT_TRUE(Run(Urdf("../meshes/box.stl")).ok());
  EXPECT_EQ(calls, 3u + 2u + 2u + 1u + 1u)
      << "meshes that are named, looks that are measured, links, meshes that are written as glTF and as USD";
  EXPECT_LE(calls, most);
  fs::remove_all(At("out"));
  for (std::size_t stop = 0; stop < calls; ++stop) {
    options_.progress = [&](std::size_t done, std::size_t) { return done < stop; };
    ExpectRefused(Urdf("../meshes/box.stl"), "interrupted");
  }
}

TEST_F(ImportTest, PairsThatAreNoneAreSaidWithoutNamingAFormat) {
  Put(At("robot/urdf/arm.urdf"),
      "<mujoco model='m'><worldbody><body name='a'/></worldbody><contact><exclude body1='a' body2='b'/></contact>"
      "</mujoco>");
  options_.output = At("out");
  const Result<ImportReport> report = Import(At("robot/urdf/arm.urdf"), options_);
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(report->warnings[0],
            "pairs that may touch, but are not two links of the robot: 'a' and 'b'; mend their names");
}

TEST_F(ImportTest, ATableThatNobodyWouldReadIsNotWritten) {
  constexpr int kLinks = 280;
  const auto name = [](int i) { return std::string(250, 'n') + std::to_string(i); };
  std::string urdf = "<robot name='r'><link name='" + name(0) + "'/>", pairs = "<robot>";
  for (int i = 1; i < kLinks; ++i) {
    urdf += "<link name='" + name(i) + "'/><joint name='j" + std::to_string(i) + "' type='fixed'><parent link='" +
            name(0) + "'/><child link='" + name(i) + "'/></joint>";
    for (int j = 0; j < i; ++j) pairs += "<disable_collisions link1='" + name(i) + "' link2='" + name(j) + "'/>";
  }
  Put(At("pairs.srdf"), pairs + "</robot>");
  options_.srdf = At("pairs.srdf");
  ExpectRefused(urdf + "</robot>", "nobody would read its joint table");
}

TEST_F(ImportTest, APairCountsOnce) {
  Put(At("pairs.srdf"),
      "<robot><disable_collisions link1='base' link2='tip'/><disable_collisions link1='tip' link2='base'/></robot>");
  options_.srdf = At("pairs.srdf");
  const Result<ImportReport> report = Run(Urdf("../meshes/box.stl"));
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(report->robot.allowed_collisions.size(), 1u);
}

TEST_F(ImportTest, WhatAFileIsItsFirstElementSays) {
  Put(At("a.urdf"), "<!-- was <mujoco> once --><robot name='r'><link name='l'/></robot>");
  const Result<Model> model = ReadModel(At("a.urdf"));
  ASSERT_TRUE(model.ok()) << model.status().message();
  EXPECT_EQ(model->format, "urdf");
}

TEST_F(ImportTest, OtherFormatsSayWhatToDo) {
  for (const char* name : {"a.step", "a.STP", "a.igs", "a.iges"})
    EXPECT_NE(ReadModel(At(name)).status().message().find("is a CAD file; make a twin of it first: consac twin import"),
              std::string::npos)
        << name;
  EXPECT_NE(ReadModel(At("a.xacro")).status().message().find("xacro FILE > robot.urdf"), std::string::npos);
}

}  // namespace
}  // namespace consac::twin
