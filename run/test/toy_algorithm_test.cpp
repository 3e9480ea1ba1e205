// What a new algorithm needs, shown by algorithms that exist in this file alone: their rows are added to the table, and
// runs train them, report, checkpoint, resume and save them as they do all others. One learns from recorded steps and
// needs no world; the other acts in one, and asks it what other goals would have paid.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>

#include "consac/env/buffer.h"
#include "session.h"
#include "small_run.h"

namespace consac::run {
namespace {

using ::testing::HasSubstr;

constexpr learn::Hyperparameter kToyTable[] = {{"epochs", "", learn::ParameterType::kInteger, "40", "40", "40", 1, 1e6,
                                                "", "times that every recorded step is learned from", "this file"}};
std::atomic<bool> stop_toys{false};
std::int64_t stop_at = -1;  // steps learned from

/// A model that always does `value`.
PolicyData Constant(const BehaviourSpec& behaviour, float value) {
  PolicyData data;
  data.behaviour = behaviour.name;
  data.observation_space = behaviour.observation_space;
  data.action_space = behaviour.action_space;
  const std::int64_t seen = behaviour.observation_layout.feature_count;
  data.network.inputs = {{"obs", seen}};
  nn::Block block;
  block.inputs = {"obs"};
  block.output = block.name = "pi";
  block.out_size = 1;
  data.network.blocks = {block};
  data.network.outputs = {"pi"};
  data.parameters.assign(static_cast<std::size_t>(seen), 0.0f);
  data.parameters.push_back(value);
  data.log_std = {0.0f};
  return data;
}

/// Does what was done on average: one number, by gradient descent on the recorded steps in random order.
class ToyCloning final : public learn::Learner {
 public:
  ToyCloning(const learn::LearnerOptions& options, std::int64_t epochs)
      : behaviour_(options.behaviour),
        shown_(*options.demonstration),
        planned_(epochs * shown_.steps()),
        rng_(options.seed, StreamId("toy_cloning")) {}
  Batch Stage(std::span<const std::int32_t>) override { return {}; }
  void Begin(const Batch&) override { ADD_FAILURE() << "there is no world"; }
  void Act(Batch&) override { ADD_FAILURE() << "there is no world"; }
  void Record(const Batch&) override { ADD_FAILURE() << "there is no world"; }
  bool LearningDue() const override { return steps_ < planned_; }
  bool Learn(const learn::LearnBudget& budget) override {
    for (std::int64_t i = 0; i < budget.gradient_steps && LearningDue(); ++i) {
      const auto row = static_cast<std::size_t>(rng_.Below(static_cast<std::uint32_t>(shown_.steps())));
      const float done = reinterpret_cast<const float*>(shown_.actions.data())[row];
      loss_ = 0.5 * (done - value_) * (done - value_);
      value_ += 0.01f * (done - value_);
      if (++steps_ == stop_at) stop_toys = true;
    }
    return LearningDue();
  }
  std::int64_t steps() const override { return steps_; }
  std::int64_t updates() const override { return steps_; }
  std::int64_t reports() const override { return steps_ / 100; }
  std::int64_t steps_per_update() const override { return 0; }
  std::int64_t planned_steps() const override { return planned_; }
  Status StartFrom(const PolicyData& model) override {
    value_ = model.parameters.back();
    return Status::Ok();
  }
  void SetTotalSteps(std::int64_t) override {}
  std::span<const learn::Metric> metrics() const override {
    metric_ = {"train/loss", "train/loss", loss_};
    return {&metric_, 1};
  }
  Status health() const override { return Status::Ok(); }
  PolicyData Snapshot() const override { return Constant(behaviour_, value_); }
  void Visit(Archive& archive) override {
    archive("steps", steps_);
    archive("value", value_);
    archive("loss", loss_);
    archive("rng", rng_);
  }

 private:
  const BehaviourSpec behaviour_;
  const Demonstration& shown_;
  const std::int64_t planned_;
  Rng rng_;
  std::int64_t steps_ = 0;
  float value_ = 0.0f;
  double loss_ = 0.0;
  mutable learn::Metric metric_;
};

/// Acts by a constant, and learns how far off another goal was, which the world says; begins with as much as it was
/// shown.
class ToyGoals final : public learn::Learner {
 public:
  explicit ToyGoals(const learn::LearnerOptions& options)
      : behaviour_(options.behaviour), price_(options.price_goals), rows_(options.behaviour) {
    if (options.demonstration != nullptr) meant_ = static_cast<double>(options.demonstration->steps());
  }
  Batch Stage(std::span<const std::int32_t> slots) override {
    Batch batch = rows_.batch();
    batch.slots = slots;
    return batch;
  }
  void Begin(const Batch&) override {}
  void Act(Batch& batch) override {
    for (std::int64_t i = 0; i < batch.rows(); ++i) reinterpret_cast<float*>(batch.actions)[i] = 0.5f;
  }
  void Record(const Batch& batch) override {
    std::vector<float> wanted(static_cast<std::size_t>(2 * batch.rows())), rewards(wanted.size() / 2);
    std::memcpy(wanted.data(), batch.next_observations, wanted.size() * sizeof(float));
    for (std::size_t i = 0; i < rewards.size(); ++i) wanted[2 * i + 1] = wanted[2 * i];  // what was reached was meant
    ASSERT_TRUE(price_(reinterpret_cast<const std::byte*>(wanted.data()), batch.rows(), rewards.data()).ok());
    for (std::size_t i = 0; i < rewards.size(); ++i) {
      meant_ += rewards[i];
      EXPECT_LT(batch.rewards[i], 0.0f);
    }
    steps_ += batch.rows();
  }
  bool LearningDue() const override { return false; }
  bool Learn(const learn::LearnBudget&) override { return false; }
  std::int64_t steps() const override { return steps_; }
  std::int64_t updates() const override { return steps_; }
  std::int64_t reports() const override { return 0; }
  std::int64_t steps_per_update() const override { return 0; }
  Status StartFrom(const PolicyData&) override { return Status::Ok(); }
  void SetTotalSteps(std::int64_t) override {}
  std::span<const learn::Metric> metrics() const override { return {}; }
  Status health() const override { return Status::Ok(); }
  PolicyData Snapshot() const override { return Constant(behaviour_, static_cast<float>(meant_)); }
  void Visit(Archive& archive) override {
    archive("steps", steps_);
    archive("meant", meant_);
  }

 private:
  const BehaviourSpec behaviour_;
  const decltype(learn::LearnerOptions::price_goals) price_;
  BatchBuffer rows_;
  std::int64_t steps_ = 0;
  double meant_ = 0.0;
};

/// The rows, added once.
void AddToyAlgorithms() {
  if (learn::FindAlgorithm("toy_cloning").ok()) return;
  learn::Algorithm cloning{"toy_cloning", "does what was done on average", learn::LogStyle::kStableBaselines3,
                           kToyTable, nullptr};
  cloning.create = [](const learn::LearnerOptions& options, const learn::HyperparameterSet& values) {
    return Result<std::unique_ptr<learn::Learner>>(std::make_unique<ToyCloning>(options, values.Integer("epochs")));
  };
  cloning.needs_world = false;
  cloning.demonstrations = learn::Demonstrations::kNeeds;
  learn::AddAlgorithm(cloning);
  learn::Algorithm goals{"toy_goals", "asks what goals are worth", learn::LogStyle::kStableBaselines3, {}, nullptr};
  goals.create = [](const learn::LearnerOptions& options, const learn::HyperparameterSet&) {
    return Result<std::unique_ptr<learn::Learner>>(std::make_unique<ToyGoals>(options));
  };
  goals.relabels_goals = true;
  goals.demonstrations = learn::Demonstrations::kTakes;
  learn::AddAlgorithm(goals);
}

/// Where an agent is and where it is to be; it goes half a step a time, and is paid by the distance.
class GoalsEnv final : public VectorEnv {
 public:
  explicit GoalsEnv(bool prices) : prices_(prices) {
    spec_.id = "goals";
    spec_.behaviours.push_back(BehaviourSpec::Of("default", *Space::Box(-100, 100, {2}), *Space::Box(-1, 1, {1}), 1));
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t, std::span<Batch> batches) override {
    at_ = 0.0f;
    Show(batches[0]);
  }
  void Step(std::span<Batch> batches) override {
    at_ = at_ >= 20.0f ? 0.0f : at_ + reinterpret_cast<const float*>(batches[0].actions)[0];
    Show(batches[0]);
    PriceGoals(0, batches[0].next_observations, 1, batches[0].rewards);
    batches[0].terminated[0] = batches[0].truncated[0] = 0;
  }
  bool prices_goals() const override { return prices_; }
  void PriceGoals(std::size_t, const std::byte* observations, std::int64_t rows, float* rewards) const override {
    const auto* numbers = reinterpret_cast<const float*>(observations);
    for (std::int64_t i = 0; i < rows; ++i)
      rewards[i] = numbers[2 * i] == numbers[2 * i + 1] ? 1.0f : -std::abs(numbers[2 * i] - numbers[2 * i + 1]);
  }
  void Visit(Archive& archive) override { archive("at", at_); }

 private:
  void Show(Batch& batch) const {
    const float row[] = {at_, 50.0f};
    std::memcpy(batch.next_observations, row, sizeof(row));
  }
  const bool prices_;
  EnvSpec spec_;
  float at_ = 0.0f;
};

/// Fifty steps in which 0.25 was done on average.
std::string RecordedSteps(const std::string& folder) {
  constexpr std::int64_t kSteps = 50;
  ModelFile file;
  file.spec_json = R"({"kind":"demonstration","behaviours":[{"name":"default","observation":)"
                   R"({"type":"box","shape":[2],"dtype":"F32","low":[-100,-100],"high":[100,100]},)"
                   R"("action":{"type":"box","shape":[1],"dtype":"F32","low":[-1],"high":[1]}}]})";
  std::vector<float> done;
  for (std::int64_t i = 0; i < kSteps; ++i) done.push_back(i % 2 == 0 ? 0.5f : 0.0f);
  file.tensors["observations"] = Tensor::OfFloats(std::vector<float>(2 * kSteps), {kSteps, 2});
  file.tensors["actions"] = Tensor::OfFloats(done, {kSteps, 1});
  file.tensors["rewards"] = Tensor::OfFloats(done, {kSteps});
  for (const char* name : {"terminated", "truncated"})
    file.tensors[name] = {DType::kU8, {kSteps}, std::vector<std::byte>(kSteps)};
  file.tensors["slots"] = {DType::kI32, {kSteps}, std::vector<std::byte>(4 * kSteps)};
  const std::string path = folder + "/steps.demonstration";
  EXPECT_TRUE(file.Save(path).ok());
  return path;
}

RunConfig Cloning(const std::string& folder, const std::string& name) {
  AddToyAlgorithms();
  RunConfig config = SmallRun(folder, name);
  config.world = "";
  config.algorithm = "toy_cloning";
  config.hyperparameters.clear();
  config.demonstrations = RecordedSteps(folder);
  config.steps = -1;
  config.checkpoint_every_updates = 256;
  stop_toys = false;
  stop_at = -1;
  return config;
}

TEST(ToyAlgorithm, ThatNeedsNoWorldIsTrainedSavedAndResumed) {
  testing::ScratchFolder scratch("toy_cloning");
  const Result<RunSummary> whole = Train(Cloning(scratch.path(), "whole"), stop_toys);
  ASSERT_TRUE(whole.ok()) << whole.status().message();
  EXPECT_EQ(whole->steps, 40 * 50) << "as long as the algorithm says";
  EXPECT_FALSE(whole->interrupted);
  const Result<Policy> model = Policy::Load(whole->models[0].path);
  ASSERT_TRUE(model.ok()) << model.status().message();
  EXPECT_NEAR(model->data().parameters.back(), 0.25f, 0.06f);
  std::ifstream csv(whole->directory + "/progress.csv");
  EXPECT_EQ(std::count(std::istreambuf_iterator<char>(csv), {}, '\n'), 1 + 20) << "a report every 100 steps";

  RunConfig pieces = Cloning(scratch.path(), "pieces");
  stop_at = 777;
  const Result<RunSummary> first = Train(pieces, stop_toys);
  ASSERT_TRUE(first.ok()) << first.status().message();
  EXPECT_TRUE(first->interrupted);
  EXPECT_LT(first->steps, 2000);
  stop_toys = false;
  pieces.resume = true;
  const Result<RunSummary> rest = Train(pieces, stop_toys);
  ASSERT_TRUE(rest.ok()) << rest.status().message();
  EXPECT_EQ(rest->steps, 2000);
  EXPECT_EQ(rest->weights_hash, whole->weights_hash);
}

/// Each look at the clock is `step_s` later than the one before.
class SteppingClock {
 public:
  explicit SteppingClock(double step_s) : step_s_(step_s) {
    Hooks hooks;
    hooks.user = this;
    hooks.now = [](void* user) {
      auto& self = *static_cast<SteppingClock*>(user);
      return self.now_ += self.step_s_;
    };
    SetHooks(hooks);
  }
  ~SteppingClock() { SetHooks({}); }
  SteppingClock(const SteppingClock&) = delete;
  SteppingClock& operator=(const SteppingClock&) = delete;

 private:
  const double step_s_;
  double now_ = 1000.0;
};

// Where Ctrl-C is looked at is the machine's affair; where the models are saved is not.
TEST(ToyAlgorithm, HowQuickItLearnsDecidesNothing) {
  testing::ScratchFolder scratch("toy_quick");
  const auto saved = [&](const std::string& name, double step_s) {
    RunConfig config = Cloning(scratch.path(), name);
    config.checkpoint_every_updates = 100;
    config.keep_checkpoints = 100;
    const SteppingClock clock(step_s);
    const Result<RunSummary> trained = Train(config, stop_toys);
    EXPECT_TRUE(trained.ok()) << trained.status().message();
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path() + "/" + name + "/checkpoints"))
      names.insert(entry.path().filename().string());
    return names;
  };
  const std::set<std::string> quick = saved("quick", 1e-6);
  EXPECT_EQ(saved("slow", 1.0), quick);
  EXPECT_TRUE(quick.contains("step_000000000128.consac")) << "the first look after 100 updates";
}

TEST(ToyAlgorithm, SaysWhatItNeeds) {
  testing::ScratchFolder scratch("toy_needs");
  RunConfig config = Cloning(scratch.path(), "needs");
  config.demonstrations = "";
  EXPECT_THAT(Train(config, stop_toys).status().message(), HasSubstr("give --set demonstrations=FILE"));
  config = Cloning(scratch.path(), "needs");
  config.world = "road-v0";
  EXPECT_THAT(Train(config, stop_toys).status().message(), HasSubstr("leave the world out"));
  config.demonstrations = scratch.path() + "/nothing";
  config.world = "";
  EXPECT_THAT(Train(config, stop_toys).status().message(), HasSubstr("nothing'"));
  config = SmallRun(scratch.path(), "ppo");
  config.demonstrations = RecordedSteps(scratch.path());
  EXPECT_THAT(Train(config, stop_toys).status().message(), HasSubstr("'ppo2' learns from no demonstrations"));
  config.algorithm = "toy_goals";
  config.hyperparameters.clear();
  EXPECT_THAT(Train(config, stop_toys).status().message(), HasSubstr("record them in this world"));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/needs"));
}

TEST(ToyAlgorithm, AWorldPricesGoalsThatWereNotMeant) {
  AddToyAlgorithms();
  testing::ScratchFolder scratch("toy_goals");
  RunConfig config = SmallRun(scratch.path(), "goals");
  config.world = "goals";
  config.algorithm = "toy_goals";
  config.hyperparameters.clear();
  config.steps = 200;
  const auto train = [&](bool prices) {
    return RunSession(config, Length::kOfCaller, Only(MakeLocalLink(std::make_unique<GoalsEnv>(prices))), kNeverStop);
  };
  const Result<RunSummary> trained = train(true);
  ASSERT_TRUE(trained.ok()) << trained.status().message();
  EXPECT_EQ(Policy::Load(trained->models[0].path)->data().parameters.back(), 200.0f) << "each was worth 1";
  config.name = "shown";
  config.demonstrations = RecordedSteps(scratch.path());
  const Result<RunSummary> shown = train(true);
  ASSERT_TRUE(shown.ok()) << shown.status().message();
  EXPECT_EQ(Policy::Load(shown->models[0].path)->data().parameters.back(), 250.0f) << "and fifty were shown besides";
  config.name = "refused";
  EXPECT_THAT(train(false).status().message(),
              HasSubstr("needs a world that can say what other goals would have paid"));
}

}  // namespace
}  // namespace consac::run
