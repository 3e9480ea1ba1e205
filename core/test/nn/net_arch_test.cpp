#include "consac/nn/net_arch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace consac::nn {
namespace {

using Widths = std::vector<std::int64_t>;

struct ArchCase {
  const char* text;
  Widths shared, pi, vf;
};

TEST(NetArch, ReadsEveryFormOfTheGrammar) {
  const ArchCase cases[] = {
      {"[64, 64]", {64, 64}, {}, {}},
      {"[]", {}, {}, {}},
      {"[dict(vf=[64,64], pi=[64,64])]", {}, {64, 64}, {64, 64}},
      {"[128, dict(vf=[256,256])]", {128}, {}, {256, 256}},
      {"[55, dict(vf=[255,255], pi=[128])]", {55}, {128}, {255, 255}},
      {"dict(pi=[32], vf=[16,8])", {}, {32}, {16, 8}},
      {"[{pi: [64], vf: [64]}]", {}, {64}, {64}},
      {"[8, {'pi': [4], \"vf\": []},]", {8}, {4}, {}},
      {" [ 1 , 2,] ", {1, 2}, {}, {}},
  };
  for (const ArchCase& c : cases) {
    const Result<NetArch> arch = ParseNetArch(c.text);
    ASSERT_TRUE(arch.ok()) << arch.status().message();
    EXPECT_EQ(arch->shared, c.shared) << c.text;
    EXPECT_EQ(arch->pi, c.pi) << c.text;
    EXPECT_EQ(arch->vf, c.vf) << c.text;
    const Result<NetArch> again = ParseNetArch(ToString(*arch));
    ASSERT_TRUE(again.ok()) << again.status().message();
    EXPECT_EQ(again->shared, c.shared);
    EXPECT_EQ(again->pi, c.pi);
    EXPECT_EQ(again->vf, c.vf);
  }
}

TEST(NetArch, TextIsCanonical) {
  EXPECT_EQ(ToString(NetArch{}), "[dict(pi=[64, 64], vf=[64, 64])]");
  EXPECT_EQ(ToString({{128}, {}, {256, 256}}), "[128, dict(pi=[], vf=[256, 256])]");
  EXPECT_EQ(ToString({{64, 64}, {}, {}}), "[64, 64]");
}

TEST(NetArch, CriticsMayBeCalledQfAsInStableBaselines3) {
  const Result<NetArch> arch = ParseNetArch("[dict(pi=[8], qf=[64, 32])]");
  ASSERT_TRUE(arch.ok());
  EXPECT_THAT(arch->vf, testing::ElementsAre(64, 32));
}

TEST(NetArch, QuotesWhereItWentWrong) {
  for (const char* text : {"", "64", "[64", "[64,", "[sixty]", "[dict(pi=[64]]", "[dict(zf=[64])]", "[dict(pi=64)]",
                           "[64]x", "[0]", "[-3]", "[dict(pi=[8]), 64]", "[dict(pi=[8], pi=[9])]",
                           "[99999999999999999999]", "[dict(pi=[8] vf=[8])]", "[{'pi: [3]}]", "[1 2]", "[1.5]"}) {
    const Result<NetArch> arch = ParseNetArch(text);
    ASSERT_FALSE(arch.ok()) << text;
    EXPECT_THAT(arch.status().message(), testing::HasSubstr("net_arch"));
  }
  EXPECT_THAT(ParseNetArch("[dict(zf=[64])]").status().message(), testing::HasSubstr("zf"));
  EXPECT_THAT(ParseNetArch("[64, sixty]").status().message(), testing::HasSubstr("at 'sixty]'"));
}

TEST(ActorCriticSpec, NamesItsBlocksAsTheModelFileDoes) {
  ActorCriticOptions options;
  options.arch = {{32}, {16}, {8, 8}};
  options.observation_size = 4;
  options.action_size = 2;
  options.activation = Activation::kRelu;
  const NetworkSpec spec = ActorCritic(options);
  std::vector<std::string> names;
  for (const Block& block : spec.blocks) names.push_back(block.name);
  EXPECT_THAT(names, testing::ElementsAre("shared/0", "pi/0", "pi/head", "vf/0", "vf/1", "vf/head"));
  EXPECT_THAT(spec.outputs, testing::ElementsAre("pi", "vf"));
  EXPECT_EQ(spec.blocks[0].activation, Activation::kRelu);
  EXPECT_EQ(spec.blocks[2].activation, Activation::kLinear);
  EXPECT_FLOAT_EQ(spec.blocks[2].gain, 0.01f);
  EXPECT_FLOAT_EQ(spec.blocks[5].gain, 1.0f);
  EXPECT_TRUE(Network::Create(spec).ok());
}

TEST(ActorCriticSpec, WithoutLayersItIsTwoLinearHeads) {
  ActorCriticOptions options;
  options.arch = {{}, {}, {}};
  options.observation_size = 4;
  options.action_size = 2;
  const NetworkSpec spec = ActorCritic(options);
  EXPECT_EQ(spec.blocks.size(), 2u);
  EXPECT_TRUE(Network::Create(spec).ok());
}

}  // namespace
}  // namespace consac::nn
