// `consac twin` as a program (CONSAC_PROGRAM): what it prints, and one line for what is wrong.
#include <nlohmann/json.hpp>

#include "tests/cli/program_fixture.h"

namespace consac::testing {
namespace {

class TwinProgram : public ProgramTest {
 protected:
  TwinProgram() {
    std::ofstream(folder() + "/arm.urdf")
        << "<robot name='arm'><link name='base'/><link name='tip'><visual><geometry><box size='1 1 "
           "1'/></geometry></visual></link>"
           "<joint name='turn' type='revolute'><parent link='base'/><child link='tip'/><origin xyz='0 0 1'/><axis "
           "xyz='0 0 1'/>"
           "<limit lower='-1' upper='1' effort='1' velocity='1'/></joint></robot>";
  }
  Outcome Twin(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "twin");
    return RunProgram(folder(), arguments);
  }
};

TEST_F(TwinProgram, ImportsAndAnswers) {
  const Outcome import = Twin({"import", "arm.urdf", "-o", "out"});
  ASSERT_EQ(import.code, 0) << import.error;
  EXPECT_NE(import.out.find("arm: 2 links, 1 joints, 1 of them move by themselves"), std::string::npos) << import.out;
  EXPECT_NE(import.out.find("warning: without a mass"), std::string::npos) << import.out;
  EXPECT_EQ(import.out.find("meshes,"), std::string::npos) << "it has none: " << import.out;
  EXPECT_EQ(import.out.find("and the meshes"), std::string::npos) << import.out;
  for (const char* q : {"turn=90", "90"}) {
    const Outcome pose =
        Twin({"fk", "out", "--degrees", "--q", q, "--link", "tip", "--convention", "unreal", "--json"});
    ASSERT_EQ(pose.code, 0) << pose.error;
    const nlohmann::json rows = nlohmann::json::parse(pose.out);
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_NEAR(rows[0]["position"][2].get<double>(), 100.0, 1e-9) << "centimetres";
  }
  const Outcome check = Twin({"check", "out"});
  EXPECT_EQ(check.code, 0) << check.error;
  EXPECT_NE(check.out.find("turn"), std::string::npos);
}

TEST_F(TwinProgram, ARobotsFileIsNoTwinYet) {
  const auto train = [&](const std::string& world) {
    return RunProgram(folder(), {"train", world, "--steps", "200", "--name", "m", "--no-table", "--no-progress"});
  };
  ExpectRefusal(train("twin-reach-v0:arm.urdf"), 2,
                "'arm.urdf' is a robot's description, not a twin; make one of it first: consac twin import arm.urdf -o "
                "twin, then name its folder: twin-reach-v0:twin");
  std::ofstream(folder() + "/arm.step") << "ISO-10303-21;\nHEADER;\n";
  ExpectRefusal(train("twin-reach-v0:arm.step"), 2, "consac twin import arm.step");
}

TEST_F(TwinProgram, WarnsOfWhatTheRobotCannotDo) {
  const Outcome beyond = Twin({"fk", "arm.urdf", "--degrees", "--q", "turn=-300", "--json"});
  EXPECT_EQ(beyond.code, 0);
  EXPECT_EQ(beyond.error, "consac twin: warning: turn = -300 is beyond its limits -57.2958 to 57.2958 degrees\n");
  const Outcome within = Twin({"fk", "arm.urdf", "--q", "-0.5", "--json"});
  EXPECT_EQ(within.error, "");
  EXPECT_EQ(Twin({"fk", "arm.urdf", "--q", "-0", "--json"}).out.find("-0.0"), std::string::npos);
  std::ofstream(folder() + "/wide.urdf") << "<robot name='r'><link name='a'/><link name='b'/><joint name='j' "
                                            "type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/>"
                                            "<limit lower='-160' upper='160'/></joint></robot>";
  const Outcome check = Twin({"check", "wide.urdf"});
  EXPECT_EQ(check.code, 0) << check.error;
  EXPECT_NE(check.out.find("warning: joint 'j': its limits of -160 to 160 rad are 51 turns apart"), std::string::npos)
      << check.out;
}

TEST_F(TwinProgram, SaysWhyTheZeroPoseMayTouch) {
  const std::string box = "<visual><geometry><box size='1 1 1'/></geometry></visual></link>";
  const auto joint = [](const std::string& parent, const std::string& child) {
    return "<joint name='to_" + child + "' type='revolute'><parent link='" + parent + "'/><child link='" + child +
           "'/><axis xyz='0 0 1'/><limit lower='-1' upper='1'/></joint>";
  };
  std::ofstream(folder() + "/folded.urdf") << "<robot name='r'><link name='a'>" + box +
                                                  "<link name='b'/><link name='c'>" + box + joint("a", "b") +
                                                  joint("b", "c") + "</robot>";
  ASSERT_EQ(Twin({"import", "folded.urdf", "-o", "folded"}).code, 0);
  const std::string said = Twin({"check", "folded"}).out;
  EXPECT_NE(said.find("mm into each other\nthat need not be a fault: 0 may be a pose that the robot never takes"),
            std::string::npos)
      << said;
}

TEST_F(TwinProgram, EachSubcommandHasExamplesOfItsOwn) {
  for (const std::string verb : {"import", "candidates", "fk", "check", "reach", "view"}) {
    const std::string help = Twin({verb, "--help"}).out;
    const std::size_t examples = help.find("Examples:");
    ASSERT_NE(examples, std::string::npos) << verb;
    const std::string shown = help.substr(examples);
    std::size_t all = 0, own = 0;
    for (std::size_t at = 0; (at = shown.find("consac twin ", at)) != std::string::npos; ++at) {
      all += 1;
      own += shown.compare(at + 12, verb.size() + 1, verb + " ") == 0 ? 1 : 0;
    }
    EXPECT_GE(own, 2u) << verb;
    EXPECT_EQ(all, own) << shown;
  }
}

// With the library of MuJoCo elsewhere than the environment says, or a build without, the program is what it is else.
TEST_F(TwinProgram, WithoutMuJoCoOneWorldIsRefusedInOneLine) {
  ASSERT_EQ(Twin({"import", "arm.urdf", "-o", "out"}).code, 0);
  ASSERT_EQ(setenv("CONSAC_MUJOCO_LIBRARY", "/nowhere/libmujoco.so", 1), 0);
  const auto train = [&](const char* world) {
    return RunProgram(folder(), {"train", world, "--steps", "200", "--name", "m", "--no-table", "--no-progress"});
  };
  ExpectRefusal(train("twin-reach-mujoco-v0:out"), 2, "without it twin-reach-v0 is the same task, kinematic");
  EXPECT_EQ(RunProgram(folder(), {"list", "worlds"}).code, 0);
  unsetenv("CONSAC_MUJOCO_LIBRARY");
}

TEST_F(TwinProgram, SaysInOneLineWhatIsWrong) {
  ExpectRefusal(Twin({"import", "none.urdf"}), 2, "none.urdf");
  ExpectRefusal(Twin({"import", "arm.urdf", "--package", "arm"}), 2, "NAME=FOLDER is expected");
  ExpectRefusal(Twin({"fk", "arm.urdf", "--q", "1,2"}), 2, "--q has 2 numbers; the robot has 1 joints");
  ExpectRefusal(Twin({"fk", "arm.urdf", "--q", "tern=2"}), 2, "--q names 'tern=2'");
  ExpectRefusal(Twin({"fk", "arm.urdf", "--q", "turn=far"}), 2, "'far', which is no number");
  ExpectRefusal(Twin({"fk", "arm.urdf", "--link", "tap"}), 2, "no link 'tap' (did you mean 'tip'?)");
  ExpectRefusal(Twin({"fk", "arm.urdf", "--convention", "blender"}), 2, "blender");
  ExpectRefusal(Twin({"check", "."}), 2, "twin.json");
  std::ofstream(folder() + "/cut.urdf") << "<robot name='arm'><link";
  ExpectRefusal(Twin({"check", "cut.urdf"}), 2, "line 1: this is no XML");
  ASSERT_EQ(Twin({"import", "arm.urdf"}).code, 0);
  ExpectRefusal(Twin({"import", "arm.urdf"}), 2, "--force to replace it");
  EXPECT_EQ(Twin({"import", "arm.urdf", "--force"}).code, 0);
}

}  // namespace
}  // namespace consac::testing
