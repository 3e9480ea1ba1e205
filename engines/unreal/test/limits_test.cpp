// The plugin where the system gives no more.
#include "ConsacFarewell.h"
#include "Shim/Runtime.h"
#include "tests/limits/limited.h"

namespace consac::testing {
namespace {

/// Notes where it ended.
struct EndingDriver final : host::Driver {
  explicit EndingDriver(bool* set) : ended(set) {}
  ~EndingDriver() override { *ended = true; }
  Status Poll(double) override { return Status::Ok(); }
  bool finished() const override { return false; }
  host::Progress progress() const override { return {}; }
  bool* ended;
};

// An uncaught exception of std::thread would end the game, and what was learned with it.
TEST(Limits, ATrainingIsSeenOutWithoutAThread) {
  const int code = InChild([] {
    Impose({{RLIMIT_NPROC, 1}});
    bool ended = false;
    FConsacFarewell farewell;
    farewell.Driver = std::make_unique<EndingDriver>(&ended);
    ConsacPlugin::FLeaving& leaving = ConsacPlugin::SendOut(std::move(farewell));
    const bool out = ended && ConsacPlugin::IsOut(leaving, 0.0);
    const std::string fault = ConsacPlugin::Leave(leaving);
    ConsacPlugin::AwaitFarewells();
    return out && fault.empty() ? 0 : 1;
  });
  EXPECT_EQ(code, 0);
}

}  // namespace
}  // namespace consac::testing
