#include "consac/host/socket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

namespace consac::host {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Asks until `done` or two seconds have gone.
template <class Asked>
bool Eventually(const Asked& done) {
  for (int i = 0; i < 2000 && !done(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return done();
}

struct Pair {
  Pair() {
    EXPECT_TRUE(socket.Open({"127.0.0.1", 0}).ok());
    trainer = *ConnectTcp({"127.0.0.1", socket.port()}, 2.0);
    EXPECT_TRUE(Eventually([&] { return *socket.CheckConnection(); }));
    EXPECT_TRUE(socket.AcceptConnection().ok());
  }
  void Say(std::string_view text) { ASSERT_TRUE(trainer->Write(std::as_bytes(std::span(text)), 1.0).ok()); }
  Socket socket;
  std::unique_ptr<Transport> trainer;
};

TEST(Socket, TalksMessageByMessage) {
  Pair pair;
  EXPECT_FALSE(*pair.socket.CheckPendingData());
  pair.Say("2\n1\n");
  ASSERT_TRUE(Eventually([&] { return *pair.socket.CheckPendingData(); }));
  EXPECT_EQ(*pair.socket.AcceptPendingData(), "2");
  EXPECT_EQ(*pair.socket.AcceptPendingData(), "1");
  EXPECT_EQ(pair.socket.AcceptPendingData().status().code(), StatusCode::kFailedPrecondition);
  ASSERT_TRUE(pair.socket.SendData("3,17#1#0").ok());
  std::byte heard[64];
  const auto count = pair.trainer->Read(heard, 2.0);
  EXPECT_EQ(std::string_view(reinterpret_cast<char*>(heard), *count), "3,17#1#0\n");
}

TEST(Socket, AMessageWithoutTerminatorEndsWithSilence) {
  Pair pair;
  pair.Say("0.25,-0.7");
  ASSERT_TRUE(Eventually([&] { return *pair.socket.CheckPendingData(); }));
  EXPECT_EQ(*pair.socket.AcceptPendingData(), "0.25,-0.7");
}

TEST(Socket, ATrainerThatReadsNothingHoldsNobody) {
  Pair pair;
  const std::string message(100000, '1');
  Status status;
  double longest = 0.0;
  std::size_t sent = 0;
  for (int k = 0; k < 10000 && status.ok(); ++k) {
    const double before = Now();
    status = pair.socket.SendData(message);
    longest = std::max(longest, Now() - before);
    sent += status.ok() ? 1 : 0;
  }
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(status.message(), HasSubstr("before sending more"));
  EXPECT_TRUE(pair.socket.connected());
  EXPECT_LT(longest, 0.9);
  // All that was sent arrives, once it is read.
  std::vector<std::byte> heard(1 << 16);
  std::size_t count = 0;
  ASSERT_TRUE(Eventually([&] {
    EXPECT_FALSE(*pair.socket.CheckPendingData());
    while (const std::size_t more = *pair.trainer->Read(heard, 0.0)) count += more;
    return count == sent * (message.size() + 1);
  }));
  EXPECT_TRUE(pair.socket.SendData("1").ok());
}

TEST(Socket, WhatCrashedTheThesisEngineIsAnErrorThatSaysWhatToDo) {
  Socket socket;
  EXPECT_THAT(socket.CheckConnection().status().message(), HasSubstr("open it first"));
  EXPECT_THAT(socket.AcceptConnection().message(), HasSubstr("open it first"));
  EXPECT_THAT(socket.SendData("1").message(), HasSubstr("nobody is connected"));
  EXPECT_THAT(socket.CheckPendingData().status().message(), HasSubstr("nobody is connected"));
  socket.Close();
  socket.CloseConnection();
  ASSERT_TRUE(socket.Open({"127.0.0.1", 0}).ok());
  EXPECT_THAT(socket.Open({"127.0.0.1", 0}).message(), HasSubstr("open already"));
  EXPECT_THAT(socket.AcceptConnection().message(), HasSubstr("nobody waits"));
  Socket other;
  EXPECT_EQ(other.Open({"127.0.0.1", socket.port()}).code(), StatusCode::kAlreadyExists);
}

TEST(Socket, PlayStopsAndStartsAgainAtOnceOnTheSamePort) {
  int port = 0;
  for (int play = 0; play < 5; ++play) {
    Socket socket;
    ASSERT_TRUE(socket.Open({"127.0.0.1", port}).ok());
    port = socket.port();
    const auto trainer = *ConnectTcp({"127.0.0.1", port}, 2.0);
    ASSERT_TRUE(Eventually([&] { return *socket.CheckConnection(); }));
    ASSERT_TRUE(socket.AcceptConnection().ok());
    ASSERT_TRUE(socket.SendData("0,1#0#0").ok());
  }
}

TEST(Socket, ATrainerThatLeavesIsNoticedAndTheNextMayCome) {
  Pair pair;
  pair.trainer->Close();
  Status status;
  ASSERT_TRUE(Eventually([&] {
    if (status.ok()) status = pair.socket.CheckPendingData().status();
    return !status.ok();
  }));
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_FALSE(pair.socket.connected());
  const auto next = *ConnectTcp({"127.0.0.1", pair.socket.port()}, 2.0);
  ASSERT_TRUE(Eventually([&] { return *pair.socket.CheckConnection(); }));
  EXPECT_TRUE(pair.socket.AcceptConnection().ok());
}

TEST(Messages, AreThoseOfTextProtocol1) {
  text1::Setup setup;
  setup.action_space = *Space::Discrete(3);
  setup.observation_space = *Space::Box({0, 0}, {40, 40}, {2});
  setup.training_length = 20000;
  EXPECT_EQ(*CompileTrainingData(setup), "D#3#0#B#2#0,0,40,40#20000");
  const double seen[2] = {3, 17};
  EXPECT_EQ(*CompileEnvironmentMessage(setup.observation_space, seen, 1.0, false), "3,17#1#0");
  EXPECT_THAT(CompileEnvironmentMessage(setup.observation_space, {seen, 1}, 1.0, false).status().message(),
              HasSubstr("1 numbers"));
  const double nothing[2] = {3, std::nan("")};
  EXPECT_EQ(CompileEnvironmentMessage(setup.observation_space, nothing, 1.0, true).status().code(),
            StatusCode::kNonFinite);
  EXPECT_THAT(*DecodeAction(setup.action_space, "2"), ElementsAre(2));
  EXPECT_THAT(*DecodeAction(*Space::Box(-1, 1, {2}), "0.25,-0.75"), ElementsAre(0.25, -0.75));
  EXPECT_THAT(DecodeAction(setup.action_space, "3").status().message(), HasSubstr("3"));
  EXPECT_FALSE(DecodeAction(setup.action_space, "left").ok());
}

}  // namespace
}  // namespace consac::host
