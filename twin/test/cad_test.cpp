// The stream that consac-cad writes, and that program as a child: what it may do wrong is one line and leaves nothing.
#include "consac/twin/cad.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>

#include "cad_model.h"
#include "consac/twin/cad_joints.h"
#include "consac/twin/import.h"
#include "tests/support.h"
#include "twin/test/cad_assembly.h"
#include "twin/test/twin_files.h"

namespace consac::twin {
namespace {

namespace fs = std::filesystem;

HandMade Small() {
  HandMade made;
  made.Add("base", {HandMade::Along(10, 20, 8.1, 0, 30, true)}, 200);
  made.AddTo("arm", "arm part", {HandMade::Along(10, 20, 8.0, -5, 25, false)},
             {robot::RotationAboutX(0.3), {0.1, 0, 0}});
  made.assembly.nodes.back().colour = Colour{0.2, 0.4, 0.6, 1.0};
  made.assembly.warnings = {"a\nline"};
  return made;
}

TEST(CadStream, ComesBack) {
  const HandMade made = Small();
  const std::vector<std::byte> bytes = made.Stream();
  const Result<CadAssembly> read = ReadCad(bytes);
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->format, "step");
  ASSERT_EQ(read->parts.size(), 2u);
  ASSERT_EQ(read->nodes.size(), 4u);
  const Result<CadRobot> found = FindJoints(*read, {});
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_EQ(found->path_of_node[3], "arm/arm part");
  EXPECT_NEAR(Norm(found->place_of_node[3].position), 0.0, 1e-15);
  EXPECT_EQ(*read->nodes[3].colour, (Colour{0.2, 0.4, 0.6, 1.0}));
  const CadCylinder &a = read->parts[0].cylinders[0], &b = made.assembly.parts[0].cylinders[0];
  EXPECT_TRUE(a.origin == b.origin && a.direction == b.direction && a.radius == b.radius && a.concave);
  EXPECT_EQ(read->warnings.front().find('\n'), std::string::npos) << "a line stays one";
  const Result<Triangles> triangles = TrianglesOf(*read, 0);
  ASSERT_TRUE(triangles.ok());
  EXPECT_EQ(triangles->count(), 12u);
}

TEST(CadStream, TheFilesOwnJointsComeBack) {
  HandMade made = Small();
  CadJoint joint{"lift", robot::JointType::kPrismatic, 1, 2, {0.01, 0.02, 0.03}, {0, 0.6, 0.8}};
  joint.upper = 0.25, joint.drawn_at = 0.125;
  made.assembly.joints = {joint};
  const Result<CadAssembly> read = ReadCad(made.Stream());
  ASSERT_TRUE(read.ok()) << read.status().message();
  ASSERT_EQ(read->joints.size(), 1u);
  const CadJoint& back = read->joints[0];
  EXPECT_EQ(back.name, "lift");
  EXPECT_EQ(back.type, robot::JointType::kPrismatic);
  EXPECT_EQ(std::pair(back.first, back.second), std::pair(1, 2));
  EXPECT_TRUE(back.origin == joint.origin && back.direction == joint.direction);
  EXPECT_EQ(back.lower, -robot::kNoLimit);
  EXPECT_EQ(back.upper, 0.25);
  EXPECT_EQ(back.drawn_at, 0.125);
  for (const auto& [first, second] : {std::pair(-1, 2), std::pair(1, 4)}) {
    made.assembly.joints[0].first = first, made.assembly.joints[0].second = second;
    EXPECT_FALSE(ReadCad(made.Stream()).ok()) << "no such node";
  }
  made.assembly.joints[0] = joint;
  made.assembly.joints[0].direction = {0, 0, 2};
  EXPECT_FALSE(ReadCad(made.Stream()).ok());
}

TEST(CadStream, CutOrChangedAnywhereIsRefusedOrRead) {
  HandMade made = Small();
  made.assembly.joints = {{"turn", robot::JointType::kRevolute, 1, 2, {}, {0, 0, 1}, -1.0, 1.0}};
  const std::vector<std::byte> whole = made.Stream();
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_FALSE(ReadCad(std::span(whole).first(length)).ok()) << length;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::vector<std::byte> changed = whole;
    changed[at] ^= std::byte{0xFF};
    const Result<CadAssembly> read = ReadCad(changed);
    if (!read.ok()) continue;
    for (std::size_t part = 0; part < read->parts.size(); ++part) (void)TrianglesOf(*read, part);
    (void)FindJoints(*read, {});
  }
}

// As many as are read: a step for each pair of them would be 10^10.
TEST(CadStream, TheMostNodesTakeStepsInProportion) {
  CadFile file;
  HandMade made;
  (void)made.Add("plate 0", {});
  for (std::size_t n = 2; n < kMostCadNodes; ++n)
    made.assembly.nodes.push_back({"plate " + std::to_string(n - 1), 0, 0, {}, std::nullopt});
  const std::vector<std::byte> bytes = made.Stream();
  Result<CadAssembly> read = ReadCad(bytes);
  ASSERT_TRUE(read.ok()) << read.status().message();
  Result<CadRobot> found = FindJoints(*read, {});
  ASSERT_TRUE(found.ok()) << found.status().message();
  file.assembly = std::move(*read), file.found = std::move(*found);
  const auto begin = std::chrono::steady_clock::now();
  const Model model = ModelOf(file);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10)) << "it takes a tenth of one";
  ASSERT_EQ(model.visuals.size(), kMostCadNodes - 1);
  EXPECT_EQ(model.visuals.back().name, "plate " + std::to_string(kMostCadNodes - 2));
}

TEST(CadStream, OneThatIsNestedForEverIsRefusedBeforeItsPathsAreMade) {
  HandMade made;
  for (std::int32_t n = 0; n < 30'000; ++n) made.assembly.nodes.push_back({"assembly", n, -1, {}, std::nullopt});
  const Result<CadAssembly> read = ReadCad(made.Stream());
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.status().code(), StatusCode::kResourceExhausted);
  EXPECT_NE(read.status().message().find("nested too deep"), std::string::npos) << read.status().message();
}

// A program in consac-cad's place.
class CadProgram : public ::testing::Test {
 protected:
  CadProgram() : scratch_("cad_program") { Put(At("a.step"), "ISO-10303-21;"); }
  std::string At(const std::string& name) const { return scratch_.path() + "/" + name; }
  Result<ImportReport> Run(const std::string& script) {
    Put(At("program"), "#!/bin/sh\n" + script + "\n");
    chmod(At("program").c_str(), 0755);
    options_.cad.program = At("program");
    options_.output = At("out");
    return Import(At("a.step"), options_);
  }
  void ExpectRefused(const std::string& script, StatusCode code, const std::string& part) {
    const Result<ImportReport> report = Run(script);
    ASSERT_FALSE(report.ok()) << script;
    EXPECT_EQ(report.status().code(), code) << script;
    EXPECT_NE(report.status().message().find(part), std::string::npos) << report.status().message();
    EXPECT_EQ(report.status().message().find('\n'), std::string::npos);
    EXPECT_FALSE(fs::exists(At("out")));
    EXPECT_FALSE(fs::exists(At("out.importing")));
  }

  testing::ScratchFolder scratch_;
  ImportOptions options_;
};

TEST_F(CadProgram, WhatItWritesIsImported) {
  const std::vector<std::byte> bytes = Small().Stream();
  Put(At("stream"), std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  const Result<ImportReport> report = Run("echo noise >&2; echo '= 1 2' >&2; cat " + At("stream"));
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_EQ(report->robot.positions(), 1);
  EXPECT_EQ(report->meshes, 2u);
  EXPECT_TRUE(fs::exists(At("out/candidates.json")));
  const Glb glb = TakeApart(TextOf(At("out/twin.glb")));
  EXPECT_NE(glb.json.dump().find("arm/arm part"), std::string::npos) << "parts keep their names";
}

TEST_F(CadProgram, ItsFailuresAreALine) {
  ExpectRefused("echo noise >&2; echo '! it is bent' >&2; exit 1", StatusCode::kDataLoss, "a.step': it is bent");
  ExpectRefused("kill -SEGV $$", StatusCode::kDataLoss, "ended by signal 11");
  ExpectRefused("kill -XCPU $$", StatusCode::kDeadlineExceeded, "--cad-seconds");
  ExpectRefused("exit 3", StatusCode::kDataLoss, "code 3");
  ExpectRefused("exit 0", StatusCode::kDataLoss, "wrote nothing");
  ExpectRefused("echo hello", StatusCode::kDataLoss, "is no assembly");
  ExpectRefused("head -c 100000 /dev/urandom", StatusCode::kDataLoss, "is no assembly");
  ExpectRefused("yes | head -c 200000 >&2; exit 1", StatusCode::kDataLoss, "code 1");
  options_.cad.program = At("nowhere");
  options_.output = At("out");
  const Result<ImportReport> none = Import(At("a.step"), options_);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.status().code(), StatusCode::kUnavailable);
}

TEST_F(CadProgram, ItEndsWithItsTimeAndWithWhoeverWaits) {
  options_.cad.seconds = 0.3;
  ExpectRefused("exec sleep 600", StatusCode::kDeadlineExceeded, "took more than 0.3 s");
  ExpectRefused("exec sleep 60 2>&-", StatusCode::kDeadlineExceeded, "took more than 0.3 s");
  options_.cad.seconds = 300;
  options_.progress = [](std::size_t, std::size_t) { return false; };
  ExpectRefused("exec sleep 600", StatusCode::kCancelled, "interrupted");
  options_.progress = [this](std::size_t, std::size_t) { return !fs::exists(At("mute")); };
  ExpectRefused("exec 2>&-; touch " + At("mute") + "; exec sleep 60", StatusCode::kCancelled, "interrupted");
}

}  // namespace
}  // namespace consac::twin
