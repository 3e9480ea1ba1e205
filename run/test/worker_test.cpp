// A world's steps as a learner sees them.
#include "worker.h"

#include <gtest/gtest.h>

#include "consac/base/archive.h"
#include "consac/env/parameter_laws.h"
#include "consac/learn/algo/learner.h"
#include "small_run.h"

namespace consac::run {
namespace {

/// Knows what it was called for, and nothing else.
class Listener final : public learn::Learner {
 public:
  explicit Listener(const BehaviourSpec& behaviour) : staged_(behaviour) {}
  Batch Stage(std::span<const std::int32_t> slots) override {
    ++stages;
    Batch batch = staged_.batch();
    batch.slots = slots;
    return batch;
  }
  void Begin(const Batch&) override {}
  void Act(Batch& batch) override { staged = batch.observations == staged_.batch().observations; }
  void Record(const Batch& batch) override { steps_ += batch.rows(); }
  bool LearningDue() const override { return false; }
  bool Learn(const learn::LearnBudget&) override { return false; }
  std::int64_t steps() const override { return steps_; }
  std::int64_t updates() const override { return 0; }
  std::int64_t steps_per_update() const override { return 0; }
  Status StartFrom(const PolicyData&) override { return Status::Ok(); }
  void SetTotalSteps(std::int64_t) override {}
  std::span<const learn::Metric> metrics() const override { return {}; }
  Status health() const override { return Status::Ok(); }
  PolicyData Snapshot() const override { return {}; }
  void Visit(Archive&) override {}

  int stages = 0;
  bool staged = false;  // the latest step was acted upon in this learner's memory

 private:
  BatchBuffer staged_;
  std::int64_t steps_ = 0;
};

// A learner may use its memory for something else once a step is recorded, and while it learns.
TEST(Worker, LearnersMemoryIsReadNeitherAfterRecordNorForStepsOfItsOwn) {
  for (const Rows rows : {Rows::kLearners, Rows::kOwn}) {
    Worker worker(*MakeLocalLink("road-v0", 3), {0}, nullptr);
    const BehaviourSpec behaviour = worker.link().spec().behaviours[0];
    std::vector<Trainee> trainees;
    trainees.push_back({std::make_unique<Listener>(behaviour), EpisodeSums(behaviour.slots),
                        DataWatch(behaviour, DataWatchOptions())});
    auto& learner = static_cast<Listener&>(*trainees[0].learner);
    ASSERT_TRUE(worker.Reset(1).ok());
    ASSERT_TRUE(worker.Begin(trainees).ok());
    for (int step = 1; step <= 3; ++step) {
      worker.Act(trainees, rows);
      ASSERT_TRUE(worker.Step(MoreSteps::kYes).ok());
      ASSERT_TRUE(worker.TakeOutcome(trainees).ok());
      EXPECT_EQ(worker.rows(), 3);
      EXPECT_EQ(learner.steps(), 3 * (step - 1));
      ASSERT_TRUE(worker.Record(trainees).ok());
      EXPECT_EQ(learner.steps(), 3 * step);
      EXPECT_EQ(worker.rows(), 0) << "what was staged is the learner's again";
      EXPECT_EQ(worker.batches()[0].rewards, nullptr);
    }
    EXPECT_EQ(learner.stages, rows == Rows::kLearners ? 3 : 0);
    EXPECT_EQ(learner.staged, rows == Rows::kLearners);
  }
}

// A checkpoint may be saved while an engine is connected anew on another thread.
TEST(Worker, ParametersAreDrawnOnlyOnceANewConnectionIsAdopted) {
  const auto connect = [] { return MakeLocalLink("pendulum-v1", 2); };
  Worker worker(*connect(), {0}, connect);
  const std::int64_t steps = 0;
  const Result<std::vector<ParameterLaw>> laws = ParseParameterLaws("gravity=uniform 5 15");
  ASSERT_TRUE(laws.ok());
  worker.UseParameters({ParameterChooser(*laws, worker.link().spec().parameters, 1, 0), &steps});
  ASSERT_TRUE(worker.Reset(1).ok());
  const auto state = [&worker] {
    StateHasher hasher;
    worker.VisitParameters("parameters", hasher);
    return hasher.hash();
  };
  const std::uint64_t before = state();
  ASSERT_TRUE(worker.ConnectAnew(2).ok());
  EXPECT_EQ(state(), before);
  worker.Adopt();
  EXPECT_NE(state(), before);
}

}  // namespace
}  // namespace consac::run
