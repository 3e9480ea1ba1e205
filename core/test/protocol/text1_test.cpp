// Text protocol 1: every field of every message, and the framer under every split. The golden transcripts of
// spec/conformance/text1 are run by transcript_test.cpp.
#include "consac/protocol/text1.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace consac::text1 {
namespace {

TEST(Setup, TheThesisExample) {
  const auto setup = ParseSetup("D#3#0#B#3#0,0,0,5,6,7#1000");
  ASSERT_TRUE(setup.ok()) << setup.status().message();
  EXPECT_EQ(setup->action_space, *Space::Discrete(3));
  EXPECT_EQ(setup->observation_space, *Space::Box({0, 0, 0}, {5, 6, 7}, {3}));
  EXPECT_EQ(setup->training_length, 1000);
  EXPECT_EQ(setup->model_name, "");
}

TEST(Setup, WritesWhatItReads) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  text1::Setup setup;
  setup.action_space = *Space::Box({-2, -0.1}, {2, 0.1}, {2});
  setup.observation_space = *Space::Box({-kInfinity, 0}, {kInfinity, 1}, {2});
  setup.training_length = 0;
  setup.model_name = "walker";
  std::string text;
  ASSERT_TRUE(EncodeSetup(setup, &text).ok());
  const auto back = ParseSetup(text);
  ASSERT_TRUE(back.ok()) << text << back.status().message();
  EXPECT_EQ(back->action_space, setup.action_space);
  EXPECT_EQ(back->observation_space, setup.observation_space);
  EXPECT_EQ(back->model_name, "walker");
}

// Whoever cuts the largest float32's digits off, or rounds them up, means a side without bound all the same.
TEST(Setup, WhatIsTheLargestFloatOnceReadIsWithoutBound) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const char* largest : {"3.4028235e+38", "3.4028234e38", "3.40282346638528859e38", "1e39", "1e300"}) {
    const auto setup = ParseSetup("D#2#0#B#1#-" + std::string(largest) + "," + largest + "#10");
    ASSERT_TRUE(setup.ok()) << setup.status().message();
    EXPECT_EQ(setup->observation_space, *Space::Box({-kInfinity}, {kInfinity}, {1})) << largest;
  }
  const auto bounded = ParseSetup("D#2#0#B#1#0,3.4028233e38#10");
  ASSERT_TRUE(bounded.ok()) << bounded.status().message();
  EXPECT_TRUE(std::isfinite(bounded->observation_space.high()[0]));
}

TEST(Setup, EveryFieldIsCheckedAndQuoted) {
  const struct {
    const char* message;
    const char* quoted;
  } cases[] = {
      {"D#3#0#B#3#0,0,0,5,6,7", "fields"},
      {"X#3#0#B#1#0,1#10", "'X'"},
      {"D#3#0#B#1#0,1#0", "send the steps to train for, or the model's name behind the 0"},
      {"D#0#0#B#1#0,1#10", "'0'"},
      {"D#3.5#0#B#1#0,1#10", "'3.5'"},
      {"D#3#1#B#1#0,1#10", "'1'"},
      {"D#3#0#Q#1#0,1#10", "'Q'"},
      {"D#3#0#B#x#0,1#10", "'x'"},
      {"D#3#0#B#2#0,1#10", "4 numbers"},
      {"D#3#0#B#1#1,0#10", "above high"},
      {"D#3#0#B#1#0,y#10", "'y'"},
      {"D#3#0#B#1#0,nan#10", "'nan'"},
      {"D#3#0#B#1#0,1#-5", "'-5'"},
      {"D#3#0#B#1#0,1#ten", "'ten'"},
      {"D#3#0#B#1#0,1#0", "model name"},
      {"D#3#0#B#1#0,1#10#a#b", "9 fields"},
      {"D#99999999999#0#B#1#0,1#10", "99999999999"},
      {"", "fields"},
  };
  for (const auto& entry : cases) {
    const auto setup = ParseSetup(entry.message);
    ASSERT_FALSE(setup.ok()) << entry.message;
    EXPECT_EQ(setup.status().code(), StatusCode::kProtocol) << entry.message;
    EXPECT_NE(setup.status().message().find(entry.quoted), std::string::npos) << setup.status().message();
    EXPECT_EQ(setup.status().message().find('\n'), std::string::npos);
  }
}

TEST(Setup, OtherSpacesAreRefusedByName) {
  for (const Space& space :
       {*Space::MultiBinary(2), *Space::MultiDiscrete({2, 3}), *Space::Dict({{"a", *Space::Discrete(2)}}),
        *Space::Box(0, 1, {2, 2}), *Space::Box(0, 255, {4}, DType::kU8), *Space::Discrete(3, 1)}) {
    const Status status = CheckSpace(space, "observation");
    EXPECT_FALSE(status.ok());
    EXPECT_NE(status.message().find("text protocol 1 carries Discrete"), std::string::npos);
    EXPECT_NE(status.message().find(space.ToString()), std::string::npos);
  }
}

TEST(Observation, ReadsTheThesisExample) {
  const Layout layout = Layout::Of(*Space::Box(0, 10, {3}));
  float row[3], reward = 0;
  bool done = true;
  ASSERT_TRUE(
      ParseObservation("2.23,4.1,5#2.3#0", layout, false, reinterpret_cast<std::byte*>(row), &reward, &done).ok());
  EXPECT_EQ(row[0], 2.23f);
  EXPECT_EQ(row[2], 5.0f);
  EXPECT_EQ(reward, 2.3f);
  EXPECT_FALSE(done);
}

TEST(Observation, WhatDoesNotFitIsQuoted) {
  const Layout layout = Layout::Of(*Space::Box(0, 10, {2}));
  float row[2], reward = 0;
  bool done = false;
  const struct {
    const char* message;
    StatusCode code;
    const char* quoted;
  } cases[] = {
      {"1,2", StatusCode::kProtocol, "reward#done"},    {"1,2#3", StatusCode::kProtocol, "reward#done"},
      {"1#0#0", StatusCode::kProtocol, "1 numbers"},    {"1,2,3#0#0", StatusCode::kProtocol, "3 numbers"},
      {"1,x#0#0", StatusCode::kProtocol, "'x'"},        {"1,nan#0#0", StatusCode::kNonFinite, "'nan'"},
      {"1,2#inf#0", StatusCode::kNonFinite, "'inf'"},   {"1,1.#INF#0#0", StatusCode::kNonFinite, "1.#INF"},
      {"1,2#0#2", StatusCode::kProtocol, "'2'"},        {"1,2#0#", StatusCode::kProtocol, "''"},
      {"1,1e999#0#0", StatusCode::kNonFinite, "1e999"}, {"1,2#-1e+39#0", StatusCode::kNonFinite, "-1e+39"},
      {"1,1e9x#0#0", StatusCode::kProtocol, "1e9x"},    {"1,-#0#0", StatusCode::kProtocol, "'-'"},
      {"1,2##0", StatusCode::kProtocol, "''"},          {"1,2#0#0#0", StatusCode::kProtocol, "'0#0'"},
  };
  for (const auto& entry : cases) {
    const Status status =
        ParseObservation(entry.message, layout, false, reinterpret_cast<std::byte*>(row), &reward, &done);
    EXPECT_EQ(status.code(), entry.code) << entry.message << ": " << status.message();
    EXPECT_NE(status.message().find(entry.quoted), std::string::npos) << status.message();
  }
}

TEST(Observation, AloneWhenAModelOnlyActs) {
  const Layout layout = Layout::Of(*Space::Box(0, 10, {2}));
  float row[2], reward = 9;
  bool done = true;
  ASSERT_TRUE(ParseObservation("3,4", layout, true, reinterpret_cast<std::byte*>(row), &reward, &done).ok());
  EXPECT_EQ(row[1], 4.0f);
  EXPECT_EQ(reward, 0.0f);
  EXPECT_FALSE(done);
}

TEST(Action, ChoicesAndNumbers) {
  const Layout discrete = Layout::Of(*Space::Discrete(3));
  std::int32_t choice = -1;
  EXPECT_TRUE(ParseAction("2", discrete, reinterpret_cast<std::byte*>(&choice)).ok());
  EXPECT_EQ(choice, 2);
  for (const char* text : {"3", "-1", "1.5", "", "1,2", "a"})
    EXPECT_FALSE(ParseAction(text, discrete, reinterpret_cast<std::byte*>(&choice)).ok()) << text;
  const Layout box = Layout::Of(*Space::Box(-1, 1, {2}));
  float row[2];
  EXPECT_TRUE(ParseAction("0.25,-7", box, reinterpret_cast<std::byte*>(row)).ok());
  EXPECT_EQ(row[0], 0.25f);
  EXPECT_EQ(row[1], -1.0f);
}

TEST(Encode, RoundTripsEveryFloat) {
  const Layout layout = Layout::Of(*Space::Box(-1e30, 1e30, {4}));
  std::vector<char> text(MaxText(layout));
  Rng rng(1, 1);
  for (int i = 0; i < 10000; ++i) {
    float row[4], back[4], reward = 0;
    for (float& value : row) value = rng.Normal() * std::pow(10.0f, static_cast<float>(rng.Below(40)) - 20.0f);
    const std::size_t length =
        EncodeObservation(layout, reinterpret_cast<std::byte*>(row), row[0], i % 2 == 0, Terminator::kNone, text);
    bool done = false;
    ASSERT_TRUE(
        ParseObservation({text.data(), length}, layout, false, reinterpret_cast<std::byte*>(back), &reward, &done)
            .ok());
    ASSERT_EQ(std::memcmp(row, back, sizeof(row)), 0);
    ASSERT_EQ(reward, row[0]);
    ASSERT_EQ(done, i % 2 == 0);
  }
}

TEST(Framer, ANulByteEndsNothing) {
  Framer framer;
  framer.SetExpect(Framer::Expect::kSetup, false);
  const std::string_view setup("D#3#0#B#1#0,1#10\0#walker\n", 25);
  std::memcpy(framer.Writable().data(), setup.data(), setup.size());
  ASSERT_TRUE(framer.Commit(setup.size()).ok());
  const std::string_view message = framer.Next();
  EXPECT_EQ(message, setup.substr(0, setup.size() - 1));
  EXPECT_NE(ParseSetup(message).status().message().find("'10\\x00'"), std::string::npos)
      << ParseSetup(message).status().message();
}

TEST(Framer, TooLongAMessageIsRefusedAndMemoryStaysBounded) {
  Framer framer;
  framer.SetExpect(Framer::Expect::kSetup, false);
  Status status;
  std::size_t written = 0;
  while (status.ok() && written < 4 * kMaxMessage) {
    const auto room = framer.Writable();
    ASSERT_FALSE(room.empty());
    std::memset(room.data(), '1', room.size());
    written += room.size();
    status = framer.Commit(room.size());
    EXPECT_TRUE(framer.Next().empty());
  }
  EXPECT_EQ(status.code(), StatusCode::kProtocol) << "the peer's fault";
  EXPECT_LT(written, 3 * kMaxMessage);
}

}  // namespace
}  // namespace consac::text1
