// None per step once warm: training in process, acting, an engine's ticks, and both ends of a connection.
#include <gtest/gtest.h>

#include "consac/env/buffer.h"
#include "consac/learn/algo/learner.h"
#include "consac/server/env_client.h"
#include "engines/host/test/ticked_engine.h"
#include "tests/support.h"

namespace consac {
namespace testing {
std::size_t TakeLargestAllocation();  // tests/allocation_counter.h
}  // namespace testing
namespace {

using testing::AllocationCount;

using Settings = std::vector<std::pair<const char*, const char*>>;

std::unique_ptr<learn::Learner> MakeLearner(const VectorEnv& env, const char* name, const Settings& settings = {}) {
  const learn::Algorithm* algorithm = *learn::FindAlgorithm(name);
  learn::HyperparameterSet values(algorithm->hyperparameters);
  for (const auto& [key, text] : settings) EXPECT_TRUE(values.Set(key, text).ok()) << key;
  learn::LearnerOptions options;
  options.behaviour = env.spec().behaviours[0];
  options.total_steps = 100000;
  options.price_goals = [&env](const std::byte* observations, std::int64_t rows, float* rewards) {
    env.PriceGoals(0, observations, rows, rewards);
    return Status::Ok();
  };
  return std::move(*algorithm->create(options, values));
}

void ExpectNoneWhileItLearns(const worlds::World& world, const char* algorithm, const Settings& settings = {}) {
  const std::unique_ptr<VectorEnv> env = world.create(8);
  const std::unique_ptr<learn::Learner> learner = MakeLearner(*env, algorithm, settings);
  BatchBuffer first(env->spec().behaviours[0]);
  env->Reset(1, {&first.batch(), 1});
  learner->Begin(first.batch());
  const auto step = [&] {
    Batch batch = learner->Stage(first.batch().slots);
    learner->Act(batch);
    env->Step({&batch, 1});
    learner->Record(batch);
    while (learner->Learn({})) {
    }
  };
  for (int i = 0; i < 2 * 128 + 1; ++i) step();
  const std::int64_t before = AllocationCount();
  for (int i = 0; i < 2 * 128; ++i) step();
  EXPECT_EQ(AllocationCount(), before) << algorithm << " on " << world.id;
  EXPECT_GE(learner->updates(), 4) << algorithm << " on " << world.id;
}

TEST(Allocations, NonePerStepOfTrainingInProcess) {
  for (const worlds::World& world : worlds::Worlds()) {
    if (world.argument != nullptr) continue;
    for (const char* algorithm : {"ppo2", "a2c"}) ExpectNoneWhileItLearns(world, algorithm);
    const Layout actions = world.create(1)->spec().behaviours[0].action_layout;
    const bool discrete = actions.leaves.size() == 1 && actions.leaves[0].space.kind() == SpaceKind::kDiscrete;
    if (discrete) ExpectNoneWhileItLearns(world, "dqn");
  }
}

TEST(Allocations, NonePerStepOfLearningContinuousActions) {
  for (const char* algorithm : {"sac", "td3", "ddpg"}) {
    ExpectNoneWhileItLearns(**worlds::FindWorld("pendulum-v1"), algorithm,
                            {{"net_arch", "[16]"}, {"batch_size", "32"}, {"action_noise", "normal"}});
  }
}

// Matrices are drawn anew every few steps.
TEST(Allocations, NonePerStepOfExploringByTheState) {
  const worlds::World& world = **worlds::FindWorld("pendulum-v1");
  const Settings sde = {{"use_sde", "true"}, {"sde_sample_freq", "4"}, {"net_arch", "[16]"}};
  Settings sac = sde, squashed = sde;
  sac.push_back({"batch_size", "32"});
  squashed.push_back({"squash_output", "true"});
  squashed.push_back({"n_steps", "64"});
  ExpectNoneWhileItLearns(world, "sac", sac);
  ExpectNoneWhileItLearns(world, "ppo", squashed);
  ExpectNoneWhileItLearns(world, "a2c", sde);
}

// Parameters are disturbed at the end of an episode, outputs moved with every batch.
TEST(Allocations, NonePerStepOfNoiseInParametersAndMovedOutputs) {
  ExpectNoneWhileItLearns(**worlds::FindWorld("pendulum-v1"), "ddpg",
                          {{"net_arch", "[16]"},
                           {"batch_size", "32"},
                           {"param_noise", "true"},
                           {"critic_l2_reg", "0.01"},
                           {"normalize_returns", "true"},
                           {"enable_popart", "true"}});
}

TEST(Allocations, NonePerStepOfHindsight) {
  ExpectNoneWhileItLearns(**worlds::FindWorld("bit-flipping-v0"), "dqn",
                          {{"replay_buffer_class", "HerReplayBuffer"}, {"buffer_size", "300"}});
}

TEST(Allocations, NoneOfTheFirstUpdateEither) {
  const std::unique_ptr<VectorEnv> env = (*worlds::FindWorld("cartpole-v1"))->create(8);
  const std::unique_ptr<learn::Learner> learner = MakeLearner(*env, "ppo2");
  BatchBuffer first(env->spec().behaviours[0]);
  env->Reset(1, {&first.batch(), 1});
  learner->Begin(first.batch());
  while (!learner->LearningDue()) {
    Batch batch = learner->Stage(first.batch().slots);
    learner->Act(batch);
    env->Step({&batch, 1});
    learner->Record(batch);
  }
  const std::int64_t before = AllocationCount();
  while (learner->Learn({1})) {
  }
  EXPECT_EQ(AllocationCount(), before);
  EXPECT_EQ(learner->updates(), 1);
}

// What learns a head has work space for many rows of it; one that no model can act by is refused before.
TEST(Allocations, NoneOfTheWidthOfAHeadTooWideToAct) {
  const Space choices = *Space::Discrete(1 << 24), numbers = *Space::Box(-1, 1, {1 << 22});
  const std::pair<const char*, const Space*> learners[] = {
      {"ppo2", &choices}, {"ppo2", &numbers}, {"ppo", &choices}, {"ppo", &numbers}, {"a2c", &choices},
      {"a2c", &numbers},  {"dqn", &choices},  {"sac", &numbers}, {"td3", &numbers}, {"ddpg", &numbers}};
  for (const auto& [name, actions] : learners) {
    learn::LearnerOptions options;
    options.behaviour = BehaviourSpec::Of("default", *Space::Box(-1, 1, {2}), *actions, 1);
    const learn::Algorithm* algorithm = *learn::FindAlgorithm(name);
    (void)testing::TakeLargestAllocation();
    const Status status = algorithm->create(options, learn::HyperparameterSet(algorithm->hyperparameters)).status();
    const std::size_t largest = testing::TakeLargestAllocation();
    EXPECT_NE(status.message().find("widths go from 1 to 1048576"), std::string::npos) << name << status.message();
    EXPECT_LT(largest, std::size_t{1} << 20) << name << ": a row of it takes at least 16 MiB";
  }
}

TEST(Allocations, NonePerActionOfAModelThatExploresByTheState) {
  const std::unique_ptr<VectorEnv> env = (*worlds::FindWorld("pendulum-v1"))->create(1);
  Result<Policy> policy =
      Policy::Create(MakeLearner(*env, "sac", {{"use_sde", "true"}, {"sde_sample_freq", "3"}})->Snapshot(), 1);
  ASSERT_TRUE(policy.ok()) << policy.status().message();
  const float observation[3] = {0.1f, 0.2f, -0.1f};
  float action = 0.0f;
  Rng rng(1, 2);
  const std::int64_t before = AllocationCount();
  for (int i = 0; i < 100; ++i) {
    policy->Act(reinterpret_cast<const std::byte*>(observation), nullptr, 1, ActionMode::kSample, rng,
                reinterpret_cast<std::byte*>(&action));
  }
  EXPECT_EQ(AllocationCount(), before);
}

TEST(Allocations, NonePerActionOfAModel) {
  const std::unique_ptr<VectorEnv> env = (*worlds::FindWorld("cartpole-v1"))->create(1);
  Result<Policy> policy = Policy::Create(MakeLearner(*env, "ppo2")->Snapshot(), 1);
  ASSERT_TRUE(policy.ok()) << policy.status().message();
  const float observation[4] = {0.1f, 0.2f, -0.1f, 0.3f};
  std::int32_t action = 0;
  Rng rng(1, 2);
  const std::int64_t before = AllocationCount();
  for (int i = 0; i < 100; ++i) {
    policy->Act(reinterpret_cast<const std::byte*>(observation), nullptr, 1, ActionMode::kSample, rng,
                reinterpret_cast<std::byte*>(&action));
  }
  EXPECT_EQ(AllocationCount(), before);
}

// Between two updates: learning hands over a new model.
TEST(Allocations, NonePerTickOfAnEngine) {
  testing::TickedEngine engine("cartpole-v1", 8, 2);
  host::TrainOptions options;
  options.total_steps = 2 * 8 * 128;
  const std::unique_ptr<host::Driver> driver = *host::Train(engine.world(), options);
  const auto tick = [&](int ticks) {
    const std::int64_t before = AllocationCount();
    for (int i = 0; i < ticks; ++i) EXPECT_TRUE(engine.Tick(*driver, 1.0).ok());
    return AllocationCount() - before;
  };
  tick(100);
  EXPECT_EQ(tick(100), 0) << "while it collects";
  while (!driver->finished()) tick(1);
  tick(1000);  // so that the window of 100 episodes is full
  EXPECT_EQ(tick(1000), 0) << "while the model acts";
}

class EitherProtocol : public ::testing::TestWithParam<Protocol> {};
INSTANTIATE_TEST_SUITE_P(Each, EitherProtocol, ::testing::Values(Protocol::kText1, Protocol::kProtocol2),
                         [](const auto& tested) { return tested.param == Protocol::kText1 ? "Text1" : "Protocol2"; });

TEST_P(EitherProtocol, AllocatesNothingPerStepAtEitherEnd) {
  EnvServerOptions options;
  options.protocol = GetParam();
  options.training_length = 100000;
  testing::ServedWorld engine("road-v0", options);
  auto transport = ConnectTcp(*Endpoint::Parse(engine.url()), 5.0);
  ASSERT_TRUE(transport.ok()) << transport.status().message();
  EnvClientOptions client_options;
  client_options.protocol = GetParam();
  client_options.shared_memory = false;
  auto client = EnvClient::Open(std::move(*transport), client_options);
  ASSERT_TRUE(client.ok()) << client.status().message();
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  ASSERT_TRUE((*client)->Reset(0, {&buffer.batch(), 1}).ok());
  const auto step = [&](int i) {
    buffer.Advance();
    *reinterpret_cast<std::int32_t*>(buffer.batch().actions) = i % 3;
    return (*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes).ok();
  };
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(step(i));
  const std::int64_t before = AllocationCount();
  for (int i = 0; i < 500; ++i) {
    if (!step(i)) FAIL() << "step " << i;
  }
  EXPECT_EQ(AllocationCount(), before);
  (*client)->Close();
}

}  // namespace
}  // namespace consac
