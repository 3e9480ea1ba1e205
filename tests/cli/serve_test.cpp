// `consac serve` as a program (CONSAC_PROGRAM): what it counts.
#include <gtest/gtest.h>

#include "tests/program.h"
#include "tests/protocol2_peers.h"

namespace consac {
namespace {

using testing::Program;
using testing::RawTrainer;

TEST(ServeProgram, SessionsAreThoseInWhichATrainerHasStepped) {
  testing::ScratchFolder scratch("serve");
  Program serve(scratch.path(), {"serve", "cartpole-v1", "--port", "0", "--port-file", "port", "--sessions", "1"});
  std::string written;
  for (int i = 0; i < 500 && written.empty(); ++i) {
    written = testing::TextOf(scratch.path() + "/port");
    usleep(10000);
  }
  const Endpoint here{"127.0.0.1", std::atoi(written.c_str())};
  const EnvSpec spec = (*worlds::FindWorld("cartpole-v1"))->create(1)->spec();
  (*ConnectTcp(here, 2.0))->Close();  // a port scanner
  for (const bool steps : {false, true}) {
    RawTrainer trainer(*ConnectTcp(here, 2.0));
    trainer.Begin(spec);
    trainer.Ask(protocol2::FrameType::kReset, 2, trainer.ResetPayload(1, {1}));
    if (steps) trainer.Ask(protocol2::FrameType::kStep, 3, trainer.StepPayload({0}, {1}));
    EXPECT_EQ(trainer.last_type, protocol2::FrameType::kResult);
    trainer.Send(protocol2::FrameType::kBye, 0, "");
  }
  const testing::Outcome outcome = serve.Wait();
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.out.find(": 1 steps\n"), std::string::npos) << outcome.out;
}

}  // namespace
}  // namespace consac
