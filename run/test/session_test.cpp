// Worlds that the built-in ones are not: several behaviours at once, and an engine inside this process.
#include "session.h"

#include <gtest/gtest.h>

#include <thread>

#include "consac/transport/transport.h"
#include "small_run.h"

namespace consac::run {
namespace {

/// Two kinds of agents in one world: three walk the road, two balance poles.
class TwoWorlds final : public VectorEnv {
 public:
  TwoWorlds()
      : road_((*worlds::FindWorld("road-v0"))->create(3)), poles_((*worlds::FindWorld("cartpole-v1"))->create(2)) {
    spec_.id = "two-v0";
    spec_.behaviours = {road_->spec().behaviours[0], poles_->spec().behaviours[0]};
    spec_.behaviours[0].name = "walker";
    spec_.behaviours[1].name = "balancer";
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override {
    road_->Reset(seed, batches.first(1));
    poles_->Reset(seed, batches.subspan(1));
  }
  void Step(std::span<Batch> batches) override {
    road_->Step(batches.first(1));
    poles_->Step(batches.subspan(1));
  }
  void Visit(Archive& archive) override {
    archive("road", *road_);
    archive("poles", *poles_);
  }

 private:
  std::unique_ptr<VectorEnv> road_, poles_;
  EnvSpec spec_;
};

RunConfig TwoRun(const std::string& directory, const std::string& name, std::int64_t steps) {
  RunConfig config = SmallRun(directory, name);
  config.world = "two-v0";
  config.steps = steps;
  return config;
}

RunSummary TrainTwo(const RunConfig& config) {
  const Result<RunSummary> summary =
      RunSession(config, Length::kOfCaller, Only(MakeLocalLink(std::make_unique<TwoWorlds>())), kNeverStop);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
  return summary.ok() ? *summary : RunSummary{};
}

TEST(Session, EveryBehaviourHasALearnerAndAModelOfItsOwn) {
  testing::ScratchFolder scratch("behaviours");
  const RunSummary summary = TrainTwo(TwoRun(scratch.path(), "two", 1000));
  EXPECT_EQ(summary.steps, 1000);
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
