// The sample of YuMi's arm: what it sees, does and is paid is yumi-reach-v0's to the bit, by a model that acts and
// while it learns; the twin stands where the world's arm does.
#include "Components/StaticMeshComponent.h"
#include "ConsacYumiReach.h"
#include "ConsacYumiReachComponent.h"
#include "Misc/Paths.h"
#include "consac/env/buffer.h"
#include "random_policy.h"
#include "twin.h"
#include "worlds/registry.h"
#include "worlds/yumi_reach/yumi_arm.h"

namespace consac::testing {
namespace {

constexpr int kSeen = 26, kDone = 3;

/// One decision: what was seen, what was done, what it paid.
struct Decision {
  std::vector<float> seen, done;
  float reward = 0.0f;

  friend bool operator==(const Decision&, const Decision&) = default;
};

/// A policy with random weights for the world, large enough for its actions to meet their bounds.
Policy ReachPolicy() {
  const auto env = (*worlds::FindWorld("yumi-reach-v0"))->create(1);
  const BehaviourSpec& behaviour = env->spec().behaviours[0];
  Rng rng(11, 0);
  PolicyData data =
      RandomPolicyData(behaviour.observation_space, behaviour.action_space, kSeen, kDone, {32}, rng, 2.0f);
  data.log_std.assign(kDone, -1.0f);
  return *Policy::Create(std::move(data), 1);
}

/// The world in this process, played by the policy for `steps` decisions from `seed`.
std::vector<Decision> InProcess(Policy& policy, std::uint64_t seed, std::size_t steps) {
  const auto env = (*worlds::FindWorld("yumi-reach-v0"))->create(1);
  BatchBuffer buffer(env->spec().behaviours[0]);
  env->Reset(seed, {&buffer.batch(), 1});
  Rng unused(0, 0);
  std::vector<Decision> decisions;
  while (decisions.size() < steps) {
    buffer.Advance();
    Batch& batch = buffer.batch();
    Decision one{std::vector<float>(kSeen), std::vector<float>(kDone), 0.0f};
    std::memcpy(one.seen.data(), batch.observations, kSeen * sizeof(float));
    policy.Act(batch.observations, nullptr, 1, ActionMode::kDeterministic, unused, batch.actions);
    std::memcpy(one.done.data(), batch.actions, kDone * sizeof(float));
    env->Step({&batch, 1});
    one.reward = batch.rewards[0];
    decisions.push_back(one);
  }
  return decisions;
}

std::vector<float> Row(const UConsacYumiReachComponent& task) {
  std::vector<float> row;
  for (const TCHAR* entry : {TEXT("achieved_goal"), TEXT("desired_goal"), TEXT("observation")})
    for (const float number : task.GetReachObservation(entry)) row.push_back(number);
  return row;
}

/// The sample, and all that its agent decides.
struct Reacher {
  explicit Reacher(Shim::Game& game) : actor(game.Spawn<AConsacYumiReach>()) {
    UConsacAgentComponent* agent = actor->Agent;
    agent->OnObserve.ShimBind(agent, [this](UConsacAgentComponent*) { seen = Row(*actor->Task); });
    agent->OnAction.ShimBind(agent, [this](UConsacAgentComponent* which) {
      Decision one{seen, {}, which->GetEpisodeReward() - before};
      for (const float number : which->GetActionNumbers(which->Actions[0].Name)) one.done.push_back(number);
      before = which->GetEpisodeReward();
      decisions.push_back(one);
    });
    agent->OnEpisodeBegin.ShimBind(agent, [this](UConsacAgentComponent*, std::int64_t seed) {
      seeds.push_back(seed);
      before = 0.0f;
    });
  }
  AConsacYumiReach* actor;
  std::vector<float> seen;
  float before = 0.0f;  // of the episode
  std::vector<Decision> decisions;
  std::vector<std::int64_t> seeds;
};

TEST(YumiReachSample, AModelActsBitForBitAsInProcess) {
  const ScratchFolder scratch("unreal_yumi_reach");
  const std::string path = scratch.path() + "/reach.consac";
  Policy policy = ReachPolicy();
  ASSERT_TRUE(policy.ToFile(1).Save(path).ok());
  Shim::Game game;
  Reacher reacher(game);
  const AConsacTrainer* trainer = game.SpawnWith<AConsacTrainer>([&](AConsacTrainer& made) {
    made.Mode = EConsacMode::Act;
    FConsacBehaviourModel row;
    row.Path = Text(path);
    made.Models.Add(row);
  });
  for (int k = 0; k < 1000 && reacher.decisions.size() < 130; ++k) game.Tick();
  ASSERT_TRUE(trainer->IsTraining()) << (Shim::Log().empty() ? "" : Shim::Log().back());
  ASSERT_EQ(reacher.decisions.size(), 130u) << "two whole episodes and a part";
  ASSERT_GE(reacher.seeds.size(), 3u);
  EXPECT_LT(reacher.seeds[1], 0) << "its goals go on as they would";
  const auto seed = static_cast<std::uint64_t>(std::max<std::int64_t>(reacher.seeds[0], 0));
  const std::vector<Decision> expected = InProcess(policy, seed, 130);
  for (std::size_t k = 0; k < expected.size(); ++k) EXPECT_TRUE(reacher.decisions[k] == expected[k]) << k;
}

TEST(YumiReachSample, TheTwinStandsWhereTheToolIs) {
  Shim::Game game;
  AConsacYumiReach* actor = game.Spawn<AConsacYumiReach>();
  actor->Task->BeginReach(3);
  float reward = 1.0f;
  for (int k = 0; k < 10; ++k) ASSERT_TRUE(actor->Task->StepReach({0.7f, -0.9f, 0.4f}, reward));
  EXPECT_LE(reward, 0.0f);
  const robot::Transform last = FrameIn(*actor->Robot, actor->Robot->GetLinkComponent(TEXT("yumi_link_7_r")));
  const robot::Transform tool = TransformFrom(robot::Convention::kUnreal, last) * worlds::YumiTool().offset;
  const TArray<float> achieved = actor->Task->GetReachObservation(TEXT("achieved_goal"));
  ASSERT_EQ(achieved.Num(), 3);
  const robot::Vector3 seen{double{achieved[0]}, double{achieved[1]}, double{achieved[2]}};
  EXPECT_LT(Norm(tool.position - seen), 1e-5) << "m";
  const TArray<float> wanted = actor->Task->GetReachObservation(TEXT("desired_goal"));
  EXPECT_NEAR(actor->Task->GetReachGoal().Y, -100.0 * static_cast<double>(wanted[1]), 1e-9);
  TArray<UStaticMeshComponent*> shown;
  actor->GetComponents(shown);
  EXPECT_EQ(shown.Num(), 8) << "seven links and the goal";
}

TEST(YumiReachSample, Learns) {
  const ScratchFolder scratch("unreal_yumi_train");
  FPaths::ShimSetProject(scratch.path());
  Shim::Game game;
  Reacher reacher(game);
  reacher.actor->Task->bDense = true;
  game.SpawnWith<AConsacTrainer>([&](AConsacTrainer& made) {
    made.Mode = EConsacMode::Train;
    made.TotalSteps = 300;
    made.SaveFolder = TEXT("reach");
    made.WhileLearning = EConsacWhileLearning::Wait;
  });
  const std::string model = scratch.path() + "/Saved/Consac/reach/default.consac";
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
  while (!std::filesystem::exists(model) && std::chrono::steady_clock::now() < end) game.Tick();
  ASSERT_TRUE(std::filesystem::exists(model)) << (Shim::Log().empty() ? "" : Shim::Log().back());
  EXPECT_GE(reacher.decisions.size(), 300u);
  const Result<Policy> learned = Policy::Load(model, 1);
  ASSERT_TRUE(learned.ok()) << learned.status().message();
  const auto env = (*worlds::FindWorld("yumi-reach-v0"))->create(1);
  EXPECT_TRUE(learned->Fits(env->spec().behaviours[0]).ok()) << "it may act in the program's world";
}

TEST(YumiReachSample, WhatIsNoActionIsOneLineAndNoStep) {
  Shim::Game game;
  Shim::ForgetLog();
  AConsacYumiReach* actor = game.Spawn<AConsacYumiReach>();
  float reward = 1.0f;
  EXPECT_FALSE(actor->Task->StepReach({0.0f, 0.0f, 0.0f}, reward)) << "nothing has begun";
  EXPECT_EQ(reward, 0.0f);
  EXPECT_EQ(actor->Task->GetReachObservation(TEXT("observation")).Num(), 0);
  actor->Task->BeginReach(1);
  const std::vector<float> before = Row(*actor->Task);
  EXPECT_FALSE(actor->Task->StepReach({0.0f, 0.0f}, reward));
  EXPECT_FALSE(actor->Task->StepReach({0.0f, 0.0f, std::numeric_limits<float>::quiet_NaN()}, reward));
  EXPECT_EQ(Row(*actor->Task), before);
  EXPECT_EQ(actor->Task->GetReachObservation(TEXT("reward")).Num(), 0);
  EXPECT_EQ(Shim::Log().size(), 3u);
}

}  // namespace
}  // namespace consac::testing
