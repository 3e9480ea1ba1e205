// spec/conformance/protocol2/results.json: what a RESULT may say, judged byte by byte.
#include "consac/protocol/result_check.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace consac::protocol2 {
namespace {

using nlohmann::json;

std::vector<std::byte> ResultBytes(const json& pieces) {
  std::vector<std::byte> bytes;
  for (const json& piece : pieces) {
    const auto hex = piece.get<std::string>();
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
      bytes.push_back(static_cast<std::byte>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

Autoreset AutoresetNamed(const std::string& name) {
  return name == "same_step" ? Autoreset::kSameStep : name == "next_step" ? Autoreset::kNextStep : Autoreset::kDisabled;
}

TEST(ResultCheck, EveryCaseHoldsOrBreaksTheRuleItNames) {
  std::ifstream file(std::string(CONSAC_SOURCE_DIR) + "/spec/conformance/protocol2/results.json");
  ASSERT_TRUE(file.good());
  const json all = json::parse(file);
  ASSERT_GE(all["cases"].size(), 70u);
  for (const json& entry : all["cases"]) {
    const std::string text = all["specs"][entry["spec"].get<std::string>()].dump();
    const std::vector<std::string> names = entry.value("agreed", std::vector<std::string>());
    const Agreed agreed{false, HasCapability(names, "statistics"), HasCapability(names, "groups")};
    const Result<SpecMessage> spec = ParseSpec(std::as_bytes(std::span(text)), agreed);
    ASSERT_TRUE(spec.ok()) << spec.status().message();
    ResultCheck check(spec->env, AutoresetNamed(entry["autoreset"]), Numbers::kJudged, agreed);
    std::vector<std::byte> before, now;
    for (const json& answer : entry["answers"]) {
      std::vector<std::byte> chosen(static_cast<std::size_t>(spec->env.environments()), std::byte{1});
      for (std::size_t i = 0; answer.contains("environments") && i < chosen.size(); ++i)
        chosen[i] = static_cast<std::byte>(answer["environments"][i].get<int>());
      check.Ask(answer["to"] == "STEP" ? FrameType::kStep : FrameType::kReset, chosen);
      now = ResultBytes(answer["result"]);
      const Status status = check.Judge(now, before);
      EXPECT_EQ(RuleOf(status), answer.value("breaks", "")) << entry["name"] << ": " << status.message();
      EXPECT_EQ(status.ok(), !answer.contains("breaks")) << entry["name"] << ": " << status.message();
      before = now;
    }
  }
}

TEST(ResultCheck, SaysWhetherAnyoneTakesPartAndWhichEpisodesAreOver) {
  EnvSpec env;
  env.behaviours.push_back(BehaviourSpec::Of("default", *Space::Discrete(2), *Space::Discrete(2), 2));
  const Blocks blocks(env);
  ResultCheck check(env, Autoreset::kNextStep);
  const std::vector<std::byte> all(2, std::byte{1});
  const auto judge = [&](int first, int second, FrameType to) {
    std::vector<std::byte> payload(blocks.result_bytes);
    payload[blocks.behaviours[0].states] = static_cast<std::byte>(first);
    payload[blocks.behaviours[0].states + 1] = static_cast<std::byte>(second);
    check.Ask(to, all);
    return check.Judge(payload);
  };
  EXPECT_FALSE(check.anyone());
  ASSERT_TRUE(judge(0, 0, FrameType::kReset).ok());
  EXPECT_FALSE(check.anyone());
  ASSERT_TRUE(judge(0, kFirst | kActive, FrameType::kStep).ok());
  EXPECT_TRUE(check.anyone());
  EXPECT_FALSE(check.over(0)) << "nobody has been there yet";
  ASSERT_TRUE(judge(kFirst | kActive, kTerminated, FrameType::kStep).ok());
  EXPECT_FALSE(check.over(0));
  EXPECT_TRUE(check.over(1));
  ASSERT_TRUE(judge(kActive, kFirst | kActive, FrameType::kStep).ok());
  EXPECT_FALSE(check.over(1));
  for (const FrameType begins : {FrameType::kReset, FrameType::kStep}) {
    ASSERT_TRUE(judge(kFirst | kActive, kFirst | kActive, FrameType::kReset).ok());
    ASSERT_TRUE(judge(kTerminated, kTerminated, FrameType::kStep).ok());
    EXPECT_TRUE(check.over(0) && check.over(1));
    ASSERT_TRUE(judge(0, 0, begins).ok());
    EXPECT_FALSE(check.over(0) || check.over(1)) << "the next episode has begun, though nobody is there yet";
  }
}

TEST(ResultCheck, LeavesNumbersToWhoAsksForThat) {
  EnvSpec env;
  env.behaviours.push_back(BehaviourSpec::Of("default", *Space::Box(-1, 1, {1}), *Space::Discrete(2), 1));
  std::vector<std::byte> payload(Blocks(env).result_bytes);
  const std::uint32_t nan = 0x7FC00000u;
  std::memcpy(payload.data() + 8, &nan, sizeof(nan));
  payload[Blocks(env).behaviours[0].states] = static_cast<std::byte>(kFirst | kActive);
  const std::vector<std::byte> all(1, std::byte{1});
  for (const Numbers numbers : {Numbers::kJudged, Numbers::kLeft}) {
    ResultCheck check(env, Autoreset::kSameStep, numbers);
    check.Ask(FrameType::kReset, all);
    EXPECT_EQ(check.Judge(payload).code(), numbers == Numbers::kLeft ? StatusCode::kOk : StatusCode::kNonFinite);
  }
}

}  // namespace
}  // namespace consac::protocol2
