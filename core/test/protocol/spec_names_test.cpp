// The names that SPEC and a text setup give: each is judged when it arrives.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "consac/protocol/protocol2.h"
#include "consac/protocol/text1.h"

namespace consac::protocol2 {
namespace {

SpecMessage SpecOf(const std::vector<std::string>& behaviours) {
  SpecMessage spec;
  spec.env.id = "two-v0";
  spec.model_name = "walker";
  for (const std::string& name : behaviours)
    spec.env.behaviours.push_back(BehaviourSpec::Of(name, *Space::Box(-1, 1, {2}), *Space::Discrete(2), 1));
  return spec;
}

Status Judged(const SpecMessage& spec) {
  const std::string json = EncodeSpec(spec);
  return ParseSpec(std::as_bytes(std::span(json))).status();
}

void ExpectRefused(const SpecMessage& spec, const std::string& why) {
  const Status status = Judged(spec);
  EXPECT_EQ(FaultName(status), "MALFORMED") << why;
  EXPECT_THAT(status.message(), ::testing::HasSubstr(why));
}

TEST(SpecNames, OfAnyScriptAreTaken) {
  EXPECT_TRUE(Judged(SpecOf({"walker", "L\xc3\xa4ufer", "\xe8\xb5\xb0\xe8\x80\x85", "red team/scout"})).ok());
}

TEST(SpecNames, AnEngineMaySayThatItsResultsMayDiffer) {
  for (const bool deterministic : {true, false}) {
    SpecMessage spec = SpecOf({"walker"});
    spec.env.deterministic = deterministic;
    const std::string json = EncodeSpec(spec);
    const Result<SpecMessage> parsed = ParseSpec(std::as_bytes(std::span(json)));
    ASSERT_TRUE(parsed.ok());
    EXPECT_EQ(parsed->env.deterministic, deterministic);
  }
}

TEST(SpecNames, OfBehavioursDifferAndShow) {
  ExpectRefused(SpecOf({"walker", "walker"}), "twice");
  ExpectRefused(SpecOf({"walker", "Walker"}), "capitals");
  ExpectRefused(SpecOf({""}), "empty");
  ExpectRefused(SpecOf({std::string("../../.bashrc\0", 14), "b"}), "does not show");
  ExpectRefused(SpecOf({"a\nconsac train: training completed"}), "does not show");
  ExpectRefused(SpecOf({"a\x1b[2J"}), "does not show");
  ExpectRefused(SpecOf({"a\xe2\x80\xae"}), "does not show");
  ExpectRefused(SpecOf({std::string(256, 'x')}), "255 bytes");
  ExpectRefused(SpecOf({std::string(250, 'x'), "b"}), "file name");
}

TEST(SpecNames, OfEnvironmentModelAndAgentsAreJudgedToo) {
  SpecMessage spec = SpecOf({"walker"});
  spec.env.id = std::string(70000, 'x');
  ExpectRefused(spec, "environment name");
  spec = SpecOf({"walker"});
  spec.model_name = "a\x1b]0;title\x07";
  ExpectRefused(spec, "model name");
  spec = SpecOf({"walker"});
  spec.env.behaviours[0].agents = {"agent\n"};
  ExpectRefused(spec, "agent name");
  spec = SpecOf({"walker"});
  spec.env.id = spec.model_name = "";
  EXPECT_TRUE(Judged(spec).ok());
}

TEST(SpecNames, SixteenLevelsOfSpaceTravel) {
  Space space = *Space::Box(-1, 1, {2});
  for (int i = 0; i < 16; ++i) space = *Space::Tuple({space});
  SpecMessage spec;
  spec.env.behaviours.push_back(BehaviourSpec::Of("deep", space, *Space::Discrete(2), 1));
  EXPECT_TRUE(Judged(spec).ok()) << Judged(spec).message();
  space = *Space::Tuple({space});
  spec.env.behaviours[0] = BehaviourSpec::Of("deeper", space, *Space::Discrete(2), 1);
  EXPECT_FALSE(Judged(spec).ok());
}

TEST(SpecNames, AModelsNameInATextSetupIsJudged) {
  EXPECT_TRUE(text1::ParseSetup("D#3#0#B#1#0,1#10#L\xc3\xa4ufer").ok());
  for (const std::string name : {"a\x1b[2J", "\xff", "a\x7f"})
    EXPECT_FALSE(text1::ParseSetup("D#3#0#B#1#0,1#10#" + name).ok());
  EXPECT_FALSE(text1::ParseSetup("D#3#0#B#1#0,1#10#" + std::string(256, 'x')).ok());
}

}  // namespace
}  // namespace consac::protocol2
