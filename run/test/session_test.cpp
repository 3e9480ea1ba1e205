// Worlds that the built-in ones are not: several behaviours at once, and an engine inside this process.
#include "session.h"

#include <gtest/gtest.h>

#include <thread>

#include "consac/transport/transport.h"
#include "small_run.h"
#include "tests/two_worlds.h"

namespace consac::run {
namespace {

using testing::TwoWorlds;

RunConfig TwoRun(const std::string& directory, const std::string& name, std::int64_t steps) {
  RunConfig config = SmallRun(directory, name);
  config.world = "two-v0";
  config.steps = steps;
  return config;
}

RunSummary TrainTwo(const RunConfig& config, std::unique_ptr<VectorEnv> world = std::make_unique<TwoWorlds>()) {
  const Result<RunSummary> summary =
      RunSession(config, Length::kOfCaller, Only(MakeLocalLink(std::move(world))), kNeverStop);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
  return summary.ok() ? *summary : RunSummary{};
}

TEST(Session, EveryBehaviourHasALearnerAndAModelOfItsOwn) {
  testing::ScratchFolder scratch("behaviours");
  const RunSummary summary = TrainTwo(TwoRun(scratch.path(), "two", 1000));
  EXPECT_EQ(summary.steps, 1000);
  ASSERT_EQ(summary.models.size(), 2u);
  EXPECT_EQ(summary.models[1].behaviour, "balancer");
  EXPECT_EQ(summary.models[1].path, summary.directory + "/balancer.consac");
  const TwoWorlds world;
  for (const BehaviourSpec& behaviour : world.spec().behaviours) {
    const Result<Policy> policy = Policy::Load(summary.directory + "/" + behaviour.name + ".consac");
    ASSERT_TRUE(policy.ok()) << policy.status().message();
    EXPECT_TRUE(policy->Fits(behaviour).ok());
  }
}

TEST(Session, SeveralBehavioursResumeToTheSameWeights) {
  testing::ScratchFolder scratch("two");
  const std::uint64_t whole = TrainTwo(TwoRun(scratch.path(), "whole", 2000)).weights_hash;
  TrainTwo(TwoRun(scratch.path(), "pieces", 735));
  RunConfig rest = TwoRun(scratch.path(), "pieces", 2000);
  rest.resume = true;
  EXPECT_EQ(TrainTwo(rest).weights_hash, whole);
}

// Twins in equal worlds: what tells them apart is their learners' draws alone.
TEST(Session, NoTwoBehavioursDrawTheSameNumbers) {
  testing::ScratchFolder scratch("twins");
  TrainTwo(TwoRun(scratch.path(), "twins", 40),
           std::make_unique<TwoWorlds>(testing::Half{"one", "road-v0"}, testing::Half{"other", "road-v0"}));
  RunConfig alone = SmallRun(scratch.path(), "alone");
  alone.envs = 1;
  alone.steps = 20;
  ASSERT_TRUE(Train(alone, kNeverStop).ok());
  const auto parameters = [&](const std::string& file) {
    const Result<Policy> policy = Policy::Load(scratch.path() + file);
    EXPECT_TRUE(policy.ok()) << policy.status().message();
    return policy.ok() ? policy->data().parameters : std::vector<float>();
  };
  const std::vector<float> first = parameters("/twins/one.consac");
  EXPECT_NE(first, parameters("/twins/other.consac"));
  EXPECT_EQ(first, parameters("/alone/model.consac")) << "the first draws what a behaviour alone draws";
}

TEST(Session, ABehaviourWithoutAgentsKeepsNoCheckpointFromTheOthers) {
  testing::ScratchFolder scratch("absent");
  RunConfig config = TwoRun(scratch.path(), "two", 200);
  config.checkpoint_every_updates = 1;
  config.keep_checkpoints = 100;
  TrainTwo(config, std::make_unique<TwoWorlds>(testing::Half{"nobody", "cartpole-v1", 1, 1},
                                               testing::Half{"walker", "road-v0", 2}));
  const auto files = std::filesystem::directory_iterator(scratch.path() + "/two/checkpoints");
  EXPECT_EQ(std::distance(files, {}), 4) << "after each of three updates of 64 steps, and at the end";
}

TEST(Session, EveryBehaviourActsByItsOwnModelForAnEngineThatAsks) {
  testing::ScratchFolder scratch("act_two");
  TrainTwo(TwoRun(scratch.path(), "two", 300));
  EnvServerOptions options;
  options.model_name = "two";
  std::atomic<bool> stop{false};
  auto world = std::make_unique<TwoWorlds>(testing::Half{"walker", "road-v0", 3, 1},
                                           testing::Half{"balancer", "cartpole-v1", 2});
  const testing::ServedWorld engine(std::move(world), options);
  std::thread limit([&] {
    for (int i = 0; i < 1000 && engine.steps() < 100; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    stop = true;
  });
  RunConfig config = TwoRun(scratch.path(), "", -1);
  config.world = engine.url();
  const Result<RunSummary> summary = Train(config, stop);
  limit.join();
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_TRUE(summary->acted_only);
  ASSERT_EQ(summary->models.size(), 2u);
  EXPECT_EQ(ModelPaths(*summary), scratch.path() + "/two/walker.consac and " + scratch.path() + "/two/balancer.consac");
  EXPECT_GT(summary->models[1].mean_episode_reward, 5.0) << "a pole that is balanced is paid at each step";
  EXPECT_EQ(summary->steps % 4, 0) << "two walkers and two balancers; the empty place takes no steps";
}

TEST(Session, AnEngineInsideThisProcessLearnsWhatOneOverTcpLearns) {
  testing::ScratchFolder scratch("inside");
  /// Hands out one end of an in-process connection.
  class OneConnection final : public Listener {
   public:
    explicit OneConnection(std::unique_ptr<Transport> end) : end_(std::move(end)) {}
    Result<std::unique_ptr<Transport>> Accept(double) override { return std::move(end_); }
    int port() const override { return 0; }
    void Close() override {}

   private:
    std::unique_ptr<Transport> end_;
  };
  EnvServerOptions options;
  options.training_length = 320;
  options.grace_s = 5.0;   // a slow machine must not end in text protocol 1, whose session would be the second
  options.resume_s = 1.0;  // a session that fails must not be waited for
  options.seed = 3;
  auto [ours, engines] = MakeInProcessPair();
  std::atomic<bool> over{false};
  std::thread engine([&over, &options, end = std::move(engines)]() mutable {
    const auto world = (*worlds::FindWorld("road-v0"))->create(1);
    auto server = EnvServer::Create(*world, std::make_unique<OneConnection>(std::move(end)), options);
    ASSERT_TRUE(server.ok()) << server.status().message();
    EXPECT_TRUE((*server)->ServeSession(over).ok());
  });
  RunConfig config = SmallRun(scratch.path(), "inside");
  config.world = "tcp://in-process";
  config.lockstep = true;
  config.steps = -1;
  Result<std::unique_ptr<WorldLink>> link = OpenEngine(std::move(ours), EnvClientOptions{});
  ASSERT_TRUE(link.ok()) << link.status().message();
  const Result<RunSummary> inside = RunSession(config, Length::kOfEngine, Only(std::move(*link)), kNeverStop);
  engine.join();  // by itself, once it has read the BYE
  ASSERT_TRUE(inside.ok()) << inside.status().message();
  EXPECT_EQ(inside->steps, 320);

  testing::ServedWorld served("road-v0", options);
  RunConfig tcp = SmallRun(scratch.path(), "tcp");
  tcp.world = served.url();
  tcp.lockstep = true;
  tcp.steps = -1;
  const Result<RunSummary> outside = Train(tcp, kNeverStop);
  ASSERT_TRUE(outside.ok()) << outside.status().message();
  EXPECT_EQ(inside->weights_hash, outside->weights_hash);
}

}  // namespace
}  // namespace consac::run
