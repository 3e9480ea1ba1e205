// The line that says how far a run is.
#include "report/progress.h"

#include <gtest/gtest.h>

#include <limits>

#include "run/test/report/files.h"

namespace consac::run {
namespace {

std::string Duration(double seconds) {
  fmt::memory_buffer out;
  AppendDuration(seconds, &out);
  return fmt::to_string(out);
}

std::string LineOf(const ProgressView& view) {
  fmt::memory_buffer out;
  AppendProgressLine(view, &out);
  return fmt::to_string(out);
}

std::string BarOf(const ProgressView& view, int columns, bool colour = false) {
  fmt::memory_buffer out;
  AppendProgressBar(view, columns, colour, &out);
  return fmt::to_string(out);
}

const RewardView kGood[] = {{"", 184.25, false}}, kOne[] = {{"", 1.0, false}}, kNone[] = {{}};
const ProgressView kHalf{50000, 100000, 312345.6, kGood};

TEST(Progress, Durations) {
  EXPECT_EQ(Duration(0.0), "0:00");
  EXPECT_EQ(Duration(59.6), "1:00");
  EXPECT_EQ(Duration(3723.0), "1:02:03");
  EXPECT_EQ(Duration(100000.0), "1d 3h");
  EXPECT_EQ(Duration(std::numeric_limits<double>::infinity()), "-:--");
  EXPECT_EQ(Duration(-1.0), "-:--");
}

TEST(Progress, PlainLine) {
  const RewardView episode[] = {{"", 18.4, false}}, step[] = {{"", 0.97, true}};
  EXPECT_EQ(LineOf({8400, 20000, 1000.0, episode}),
            " 42% | 8,400 of 20,000 steps | 1,000 steps/s | mean episode reward 18.4 | 0:12 left");
  EXPECT_EQ(LineOf({1234567, 0, 9.54, kNone}), "1,234,567 steps | 9.5 steps/s | no episode yet");
  EXPECT_EQ(LineOf({20000, 20000, 2e5, step}),
            "100% | 20,000 of 20,000 steps | 200,000 steps/s | reward per step 0.97 | 0:00 left");
  EXPECT_EQ(LineOf({0, 100, 0.0, kNone}), "  0% | 0 of 100 steps | 0.0 steps/s | no episode yet | -:-- left");
}

TEST(Progress, EveryBehaviourIsNamed) {
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  const RewardView some[] = {{"hunter", 3.1, false}, {"prey", 0.02, true}, {"scout", nothing, false}};
  EXPECT_EQ(LineOf({50, 100, 10.0, some}),
            " 50% | 50 of 100 steps | 10.0 steps/s | mean episode reward hunter 3.1, prey 0.02 a step, scout none yet"
            " | 0:05 left");
  const RewardView none[] = {{"hunter", nothing, false}, {"prey", nothing, false}};
  EXPECT_EQ(LineOf({50, 0, 10.0, none}), "50 steps | 10.0 steps/s | no episode yet");
  const std::vector<RewardView> many(7, {"bee", 1.0, false});
  EXPECT_EQ(LineOf({50, 0, 10.0, many}),
            "50 steps | 10.0 steps/s | mean episode reward bee 1, bee 1, bee 1, bee 1, and of 3 more");
}

TEST(Progress, BarFillsWhatTheTerminalHas) {
  const std::string rest = " 50,000/100,000 | 312,345 steps/s | mean episode reward 184.2 | 0:00 left";
  EXPECT_EQ(BarOf(kHalf, 200), " 50% [" + std::string(20, '#') + std::string(20, '-') + "]" + rest);
  EXPECT_EQ(BarOf(kHalf, 200, true),
            " 50% [\x1b[32m" + std::string(20, '#') + "\x1b[0m" + std::string(20, '-') + "]" + rest);
  EXPECT_EQ(BarOf(kHalf, 80), " 50%" + rest) << "no room for a meter";
  EXPECT_EQ(BarOf(kHalf, 20), " 50% 50,000/100,000");
}

TEST(Progress, BarNeverWraps) {
  for (int columns = 1; columns < 260; ++columns)
    EXPECT_LT(BarOf(kHalf, columns).size(), static_cast<std::size_t>(std::max(columns, 2))) << columns;
}

TEST(Progress, AFullMeterIsFull) {
  EXPECT_NE(BarOf({100, 100, 1.0, kOne}, 200, true).find("[\x1b[32m" + std::string(40, '#') + "\x1b[0m]"),
            std::string::npos);
  EXPECT_NE(BarOf({150, 100, 1.0, kOne}, 200).find("100% [" + std::string(40, '#') + "]"), std::string::npos);
}

TEST(RateMeter, ForgetsWhatIsLongAgo) {
  RateMeter meter;
  meter.Start(0.0, 0);
  EXPECT_EQ(meter.Rate(0.0, 0), 0.0);
  double now = 0.0;
  std::int64_t steps = 0;
  for (; now < 60.0; now += 1.0) meter.Note(now, steps += 1000);
  for (int i = 0; i < 100; ++i) meter.Note(now += 1.0, steps += 10);
  EXPECT_NEAR(meter.Rate(now, steps), 10.0, 1e-9);
}

std::string TextPrinted(std::FILE* stream) {
  std::string text(static_cast<std::size_t>(std::ftell(stream)), '\0');
  std::rewind(stream);
  text.resize(std::fread(text.data(), 1, text.size(), stream));
  std::fseek(stream, 0, SEEK_END);  // between reading and writing
  return text;
}

TEST(Console, PrintingMovesTheBarDown) {
  std::FILE* stream = std::tmpfile();
  ASSERT_NE(stream, nullptr);
  Console console({stream, true, false, 80});
  console.Bar(" 10%");
  console.Print("a line\n");
  console.Bar(" 20%");
  console.EndBar();
  console.Print("after\n");
  EXPECT_EQ(TextPrinted(stream), "\r\x1b[K 10%\r\x1b[Ka line\n 10%\r\x1b[K 20%\nafter\n");
  std::fclose(stream);
}

// A session that is over by then is told of elsewhere.
TEST(Console, WhatIsHeldComesWithWhatIsSaidLaterOrNotAtAll) {
  FakeClock clock;
  std::FILE* stream = std::tmpfile();
  ASSERT_NE(stream, nullptr);
  const ConsoleOptions options{stream, true, false, 80, clock.now + 1.0};
  {
    Console brief(options);
    brief.Line("begins");
    brief.Bar("50%");
    brief.Line("ends");
  }
  EXPECT_EQ(TextPrinted(stream), "");
  Console console(options);
  console.Line("begins");
  clock.now += 1.0;
  EXPECT_EQ(TextPrinted(stream), "");
  console.Line("goes on");
  EXPECT_EQ(TextPrinted(stream), "begins\ngoes on\n");
  Console alarmed(options);
  alarmed.Line("begins");
  alarmed.Alarm("the disk is full");
  EXPECT_EQ(TextPrinted(stream), "begins\ngoes on\nbegins\nerror: the disk is full\n");
  std::fclose(stream);
}

TEST(Console, AnAlarmIsRedUnlessColourIsUnwanted) {
  for (const bool colour : {false, true}) {
    std::FILE* stream = std::tmpfile();
    ASSERT_NE(stream, nullptr);
    Console({stream, true, colour, 80}).Alarm("the disk is full");
    EXPECT_EQ(TextPrinted(stream), colour ? "\x1b[1;31merror: the disk is full\x1b[0m\n" : "error: the disk is full\n");
    std::fclose(stream);
  }
}

}  // namespace
}  // namespace consac::run
