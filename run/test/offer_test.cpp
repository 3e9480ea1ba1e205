// What an engine offers to a run that goes on: the same as before, or the run is left alone.
#include "offer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <limits>
#include <map>

#include "judgement.h"
#include "session.h"
#include "small_run.h"
#include "tests/files.h"

namespace consac::run {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// A world of zeros that ends every fourth step, with one behaviour; what else is said of it is the caller's.
class OfferedWorld final : public VectorEnv {
 public:
  explicit OfferedWorld(EnvSpec spec, float reward = 0.0f) : spec_(std::move(spec)), reward_(reward) {}
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t, std::span<Batch> batches) override { Observe(batches[0]); }
  void Step(std::span<Batch> batches) override {
    const auto rows = static_cast<std::size_t>(batches[0].rows());
    ++steps_;
    std::fill_n(batches[0].rewards, rows, reward_);
    std::memset(batches[0].terminated, steps_ % 4 == 0 ? 1 : 0, rows);
    std::memset(batches[0].truncated, 0, rows);
    if (steps_ % 4 == 0) std::memset(batches[0].final_observations, 0, Bytes(batches[0]));
    Observe(batches[0]);
  }
  void Visit(Archive&) override {}

 private:
  std::size_t Bytes(const Batch& batch) const {
    return static_cast<std::size_t>(batch.rows()) * spec_.behaviours[0].observation_layout.row_bytes;
  }
  void Observe(Batch& batch) const { std::memset(batch.next_observations, 0, Bytes(batch)); }

  const EnvSpec spec_;
  const float reward_;
  int steps_ = 0;
};

EnvSpec Offer(Space observation, Space action, const std::string& name = "walker", const std::string& id = "first-v0",
              std::int32_t slots = 1) {
  EnvSpec spec;
  spec.id = id;
  spec.behaviours.push_back(BehaviourSpec::Of(name, std::move(observation), std::move(action), slots));
  return spec;
}

EnvSpec First() {
  return Offer(*Space::Box(0, 40, {2}), *Space::Discrete(3));
}

Result<RunSummary> TrainIn(const EnvSpec& offered, RunConfig config) {
  EnvServerOptions options;
  options.training_length = 64;
  const testing::ServedWorld engine(std::make_unique<OfferedWorld>(offered), options);
  config.world = engine.url();
  config.protocol = "2";
  return Train(config, kNeverStop);
}

TEST(Offer, AnEngineThatOffersSomethingElseIsRefusedAndNothingIsTouched) {
  testing::ScratchFolder scratch("offer");
  RunConfig config = SmallRun(scratch.path(), "walker");
  config.envs = 1;
  config.steps = 64;
  config.tensorboard = true;
  ASSERT_TRUE(TrainIn(First(), config).ok());
  const auto before = testing::FilesBelow(scratch.path());
  config.resume = true;
  config.steps = 128;
  const auto refused = [&](const EnvSpec& other, const std::string& saved, const std::string& offered) {
    const Result<RunSummary> resumed = TrainIn(other, config);
    ASSERT_FALSE(resumed.ok()) << offered;
    EXPECT_EQ(resumed.status().code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(resumed.status().message(), AllOf(HasSubstr(saved), HasSubstr(offered), HasSubstr("another --name")));
    EXPECT_EQ(testing::FilesBelow(scratch.path()), before) << offered;
  };
  const Space seen = *Space::Box(0, 40, {2}), done = *Space::Discrete(3);
  refused(Offer(*Space::Box(0, 4000, {2}), done), "high '40.0' was expected", "offers '4000.0'");
  refused(Offer(seen, *Space::Discrete(3, 5)), "", "action/start");
  refused(Offer(*Space::Box(0, 40, {2}, DType::kF64), done), "'\"F32\"' was expected", "offers '\"F64\"'");
  refused(Offer(seen, *Space::Discrete(4)), "'3' was expected", "offers '4'");
  refused(Offer(*Space::Box(0, 40, {3}), done), "shape/0 '2' was expected", "offers '3'");
  refused(Offer(seen, done, "runner"), "'\"walker\"'", "'\"runner\"'");
  refused(Offer(seen, done, "walker", "other-v9"), "was 'first-v0'", "is 'other-v9'");
  refused(Offer(seen, done, "walker", "first-v0", 3), "'1' was expected", "offers '3'");
  const Result<RunSummary> resumed = TrainIn(First(), config);
  ASSERT_TRUE(resumed.ok()) << resumed.status().message();
  EXPECT_EQ(resumed->steps, 128);
}

TEST(Offer, AnIdThatIsNotSaidEqualsAny) {
  const std::int64_t slots[] = {1};
  EnvSpec silent = First();
  silent.id = "";
  EXPECT_TRUE(CompareOffers(OfferText(silent, slots), OfferText(First(), slots)).ok());
  EXPECT_TRUE(CompareOffers(OfferText(First(), slots), OfferText(silent, slots)).ok());
}

// A model is judged in its own spaces too.
TEST(Offer, EvaluationsNeedTheModelsSpaces) {
  testing::ScratchFolder scratch("judged");
  RunConfig config = SmallRun(scratch.path(), "walker");
  config.steps = 64;
  ASSERT_TRUE(TrainIn(First(), config).ok());
  const auto judged = [&](const EnvSpec& spec) {
    EnvServerOptions options;
    options.training_length = 1000;
    const testing::ServedWorld engine(std::make_unique<OfferedWorld>(spec), options);
    EvaluateOptions asked;
    asked.model = "walker";
    asked.directory = scratch.path();
    asked.world = engine.url();
    asked.episodes = 3;
    return Evaluate(asked, kNeverStop).status();
  };
  EXPECT_TRUE(judged(First()).ok());
  const Status bounds = judged(Offer(*Space::Box(0, 4000, {2}), *Space::Discrete(3)));
  EXPECT_THAT(bounds.message(), AllOf(HasSubstr("Box(0, 40,"), HasSubstr("Box(0, 4000,")));
}

TEST(Judging, ARewardThatIsNoNumberIsAFailure) {
  testing::ScratchFolder scratch("not_finite");
  for (const float reward : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    RunConfig config = SmallRun(scratch.path(), "walker");
    config.force = true;
    config.steps = 64;
    const Result<RunSummary> trained =
        RunSession(config, Length::kOfCaller, Only(MakeLocalLink(std::make_unique<OfferedWorld>(First()))), kNeverStop);
    ASSERT_TRUE(trained.ok()) << trained.status().message();
    Result<Policy> policy = Policy::Load(trained->models[0].path);
    std::vector<PolicyData> models = {policy->data()};
    Result<Actors> actors = Actors::Of(std::move(models), First());
    ASSERT_TRUE(actors.ok()) << actors.status().message();
    const auto link = MakeLocalLink(std::make_unique<OfferedWorld>(First(), reward));
    const Status verdict = Judge(EvaluateOptions{}, *link, *actors, kNeverStop, [] {}).status();
    EXPECT_EQ(verdict.code(), StatusCode::kNonFinite);
    EXPECT_THAT(verdict.message(), AllOf(HasSubstr("'walker', agent 0"), HasSubstr("the reward is")));
  }
}

}  // namespace
}  // namespace consac::run
