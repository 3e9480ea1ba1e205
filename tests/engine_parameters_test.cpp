// The parameters that a run draws for the worlds of several engines.
#include <gtest/gtest.h>

#include <mutex>
#include <utility>

#include "run/test/report/files.h"
#include "run/test/small_run.h"
#include "tests/protocol2_peers.h"
#include "tests/rich_env.h"

namespace consac {
namespace {

using namespace testing;
using run::RunConfig;

/// What a run has drawn for an engine's world, in the order in which it was.
class Heights {
 public:
  void Add(double height) {
    const std::lock_guard lock(mutex_);
    if (height != 0.0) all_.push_back(height);  // 0 is what it has of its own
  }
  /// Those since the last call.
  std::vector<double> Take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(all_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<double> all_;
};

class Noting final : public RichEnv {
 public:
  explicit Noting(Heights* heights) : RichEnv(1), heights_(heights) {}
  void SetParameters(std::int32_t world, std::span<const double> values) override {
    heights_->Add(values[1]);
    RichEnv::SetParameters(world, values);
  }

 private:
  Heights* const heights_;
};

TEST(EngineParameters, ARunThatIsResumedDrawsOnForEachOfItsEngines) {
  run::TestFolder folder;
  Heights first, second;
  const Engine one(std::make_unique<Noting>(&first), {}), other(std::make_unique<Noting>(&second), {});
  RunConfig config = run::SmallRun(folder.path());
  config.world = one.url() + "," + other.url();
  config.environment_parameters = "height=uniform -1 1";
  config.steps = 512;
  const auto begun = run::Train(config, run::kNeverStop);
  ASSERT_TRUE(begun.ok()) << begun.status().message();
  const std::vector<double> before[] = {first.Take(), second.Take()};
  config.steps = 1024;
  config.resume = true;
  const auto rest = run::Train(config, run::kNeverStop);
  ASSERT_TRUE(rest.ok()) << rest.status().message();
  const std::vector<double> after[] = {first.Take(), second.Take()};
  for (std::size_t engine = 0; engine < 2; ++engine) {
    ASSERT_GE(before[engine].size(), 2u);
    ASSERT_GE(after[engine].size(), 2u);
    EXPECT_NE(after[engine][0], before[engine][0]) << "engine " << engine << " is set to what it was set to before";
    EXPECT_NE(after[engine][1], before[engine][1]);
  }
  EXPECT_NE(before[0], before[1]) << "each has numbers of its own";
}

}  // namespace
}  // namespace consac
