// The cases' own wrong actions, where behaviours differ and not everybody takes part.
#include "cli/conformance_payloads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <span>
#include <vector>

namespace consac::cli {
namespace {

constexpr std::int32_t kWorlds = 2;

EnvSpec PickersAndWalkers() {
  EnvSpec spec;
  spec.behaviours.push_back(BehaviourSpec::Of("picker", *Space::Box(-1, 1, {1}), *Space::Discrete(3), kWorlds));
  spec.behaviours.push_back(BehaviourSpec::Of("walker", *Space::Box(-1, 1, {1}), *Space::Box(-1, 1, {2}), kWorlds));
  return spec;
}

/// A RESULT in which these slots of pickers and walkers take part.
std::string ResultOf(const protocol2::Blocks& blocks, std::vector<bool> pickers, std::vector<bool> walkers) {
  std::string result(blocks.result_bytes, '\0');
  for (std::size_t slot = 0; slot < kWorlds; ++slot) {
    if (pickers[slot]) result[blocks.behaviours[0].states + slot] = protocol2::kActive;
    if (walkers[slot]) result[blocks.behaviours[1].states + slot] = protocol2::kActive;
  }
  return result;
}

TEST(ConformancePayloads, TheWrongActionIsOfSomebodyWhoTakesPartAndCanBeSo) {
  const EnvSpec spec = PickersAndWalkers();
  const protocol2::Blocks blocks(spec);
  const Payloads payloads(spec);
  const std::string apart = ResultOf(blocks, {false, true}, {true, true});
  EXPECT_EQ(payloads.WorldAtFault("illegal", apart, "discrete"), 1) << "the first picker that takes part";
  EXPECT_EQ(payloads.WorldAtFault("illegal", apart, "box"), 0);
  EXPECT_EQ(payloads.WorldAtFault("illegal of the last", apart, "box"), 1);
  EXPECT_EQ(payloads.WorldAtFault("NaN", apart, ""), 0)
      << "of the first that has floats, not of the first that takes part";
  const std::string step = payloads.Of("NaN", apart);
  float number = 0.0f;
  std::memcpy(&number, step.data() + blocks.behaviours[1].actions + sizeof(float), sizeof(number));
  EXPECT_TRUE(std::isnan(number));

  const std::string alone = ResultOf(blocks, {false, false}, {false, true});
  EXPECT_EQ(payloads.WorldAtFault("illegal", alone, "discrete"), -1) << "no picker takes part: not offered";
  EXPECT_EQ(payloads.WorldAtFault("infinity", alone, ""), 1);
  EXPECT_EQ(payloads.WorldAtFault("illegal", alone, ""), 1);
}

TEST(ConformancePayloads, OneValueIsBeyondItsBoundAndAllOthersAreWithin) {
  const ParameterSpec bounded{"speed", 1.0, 0.0, 10.0}, free{"colour", 3.0};
  const std::vector<ParameterSpec> parameters = {bounded, bounded, free};
  const auto wrong = [&](std::string_view how) {
    const std::string block = SettingBlock(parameters, kWorlds, how);
    std::string places;
    for (std::size_t i = 0; i < kWorlds * parameters.size(); ++i) {
      double value = 0.0;
      std::memcpy(&value, block.data() + i * sizeof(value), sizeof(value));
      places += CheckValue(parameters[i % parameters.size()], value).ok() ? '.' : '!';
    }
    return places;
  };
  EXPECT_EQ(wrong("too high"), "...!!.");
  EXPECT_EQ(wrong("too high in the first"), "!!....");
  EXPECT_EQ(wrong("too high by the last"), "....!.");
  EXPECT_EQ(wrong("too low by the last"), "....!.");
  EXPECT_FALSE(CanBeSet(std::span(&free, 1), "too low by the last"));
}

TEST(ConformancePayloads, TheLastOfSeveralBehavioursWithGoalsIsAskedFor) {
  const Space goal = *Space::Box(-1, 1, {1});
  const Space pursuit = *Space::Dict({{"achieved_goal", goal}, {"desired_goal", goal}});
  EnvSpec spec = PickersAndWalkers();
  spec.behaviours.push_back(BehaviourSpec::Of("first", pursuit, *Space::Discrete(3), kWorlds));
  EXPECT_FALSE(Payloads(spec).CanBeAsked("goals of the last")) << "which is the first too";
  spec.behaviours.push_back(BehaviourSpec::Of("last", pursuit, *Space::Discrete(3), kWorlds));
  const Payloads payloads(spec);
  EXPECT_TRUE(payloads.CanBeAsked("goals of the last"));
  EXPECT_EQ(payloads.Of("goals of the last", "")[0], 3);
  EXPECT_EQ(payloads.Of("goals", "")[0], 2);
}

}  // namespace
}  // namespace consac::cli
