// A whole training run allocates for its start, its updates' logs and its end, but not per step.
#include <gtest/gtest.h>

#include "consac/run/training.h"
#include "tests/support.h"

namespace consac {
namespace {

// A rollout longer than the run: no update comes, so that only steps can differ.
std::int64_t AllocationsOfARun(const std::string& directory, std::int64_t steps) {
  const std::atomic<bool> never{false};
  run::RunConfig config;
  config.world = "pendulum-v1";
  config.directory = directory;
  config.name = "steps" + std::to_string(steps);
  config.steps = steps;
  config.envs = 4;
  config.checkpoint_every_s = 0;
  config.table = config.progress = config.tensorboard = false;
  config.quiet = true;
  config.hyperparameters = {{"n_steps", "20000"}, {"net_arch", "[{pi: [8], vf: [8]}]"}};
  const std::int64_t before = testing::AllocationCount();
  const Result<run::RunSummary> summary = run::Train(config, never);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
  return testing::AllocationCount() - before;
}

TEST(Allocations, ATrainingRunMakesNonePerStep) {
  testing::ScratchFolder scratch("training_allocations");
  (void)AllocationsOfARun(scratch.path(), 400);  // first use of libraries
  const std::int64_t few = AllocationsOfARun(scratch.path(), 8000);
  const std::int64_t many = AllocationsOfARun(scratch.path(), 64000);
  EXPECT_LT(many - few, 64) << few << " allocations in 8,000 steps, " << many << " in 64,000";
}

}  // namespace
}  // namespace consac
