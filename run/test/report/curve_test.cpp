// Thinning, round axes, and pictures that are whole.
#include "report/curve.h"

#include <gtest/gtest.h>

#include <cmath>

#include "report/axis.h"
#include "report/curve_drawing.h"
#include "run/test/report/files.h"

namespace consac::run {
namespace {

TEST(EpisodeCurve, KeepsEveryEpisodeWhileThereIsRoom) {
  EpisodeCurve curve;
  for (int i = 0; i < 100; ++i) curve.Add(10 * i, i, i / 2.0);
  const std::vector<CurvePoint> points = curve.Points();
  ASSERT_EQ(points.size(), 100u);
  EXPECT_EQ(points[7].step, 70.0);
  EXPECT_EQ(points[7].value, 7.0);
  EXPECT_EQ(points[7].mean, 3.5);
}

TEST(EpisodeCurve, ThinsEvenlyAndKeepsTheLatest) {
  EpisodeCurve curve;
  for (int i = 0; i < 1000003; ++i) curve.Add(i, i, i);
  const std::vector<CurvePoint> points = curve.Points();
  EXPECT_GT(points.size(), EpisodeCurve::kCapacity / 2 - 1);
  EXPECT_LE(points.size(), EpisodeCurve::kCapacity + 1);
  EXPECT_EQ(points.back().step, 1000002.0);
  const double apart = points[1].step - points[0].step;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) ASSERT_EQ(points[i].step, apart * static_cast<double>(i));
}

TEST(EpisodeCurve, NumbersThatAreNoneAreLeftOut) {
  EpisodeCurve curve;
  curve.Add(1, std::nan(""), 0.0);
  curve.Add(2, INFINITY, 0.0);
  EXPECT_TRUE(curve.Points().empty());
}

TEST(EpisodeCurve, AResumedCurveGoesOnAsIfNeverInterrupted) {
  EpisodeCurve whole, begun, resumed;
  const auto add = [](EpisodeCurve& curve, int from, int to) {
    for (int i = from; i < to; ++i) curve.Add(i, std::sin(i), std::cos(i));
  };
  add(whole, 0, 20000);
  add(begun, 0, 9001);
  StateWriter writer;
  begun.Visit(writer);
  StateReader reader(writer.fields());
  resumed.Visit(reader);
  ASSERT_TRUE(reader.status().ok());
  add(resumed, 9001, 20000);
  EXPECT_EQ(HashState(resumed), HashState(whole));
}

TEST(StepCurve, MergesPiecesInBoundedMemory) {
  StepCurve curve;
  for (int step = 8; step <= 800000; step += 8) curve.Add(step, 4.0, 8);
  const std::vector<CurvePoint> points = curve.Points();
  EXPECT_LE(points.size(), StepCurve::kPieces);
  EXPECT_GT(points.size(), StepCurve::kPieces / 2);
  for (const CurvePoint& point : points) {
    ASSERT_DOUBLE_EQ(point.value, 0.5);
    ASSERT_DOUBLE_EQ(point.mean, 0.5);
  }
  EXPECT_DOUBLE_EQ(curve.RecentMean(), 0.5);
}

TEST(StepCurve, RecentMeanIsRecent) {
  StepCurve curve;
  for (int step = 1; step <= 1000; ++step) curve.Add(step, step <= 900 ? 0.0 : 1.0, 1);
  EXPECT_DOUBLE_EQ(curve.RecentMean(), 1.0);
  EXPECT_TRUE(std::isnan(StepCurve().RecentMean()));
}

TEST(Axis, TicksAreRound) {
  EXPECT_EQ(MakeAxis(0.0, 10.0, 5).ticks, (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(MakeAxis(-1600.0, 13.0, 6).ticks,
            (std::vector<double>{-1600, -1400, -1200, -1000, -800, -600, -400, -200, 0}));
  const Axis flat = MakeAxis(7.0, 7.0, 5);
  EXPECT_LT(flat.low, 7.0);
  EXPECT_GT(flat.high, 7.0);
  EXPECT_GE(flat.ticks.size(), 2u);
  for (const double size : {1e-9, 0.3, 5.0, 1e12}) {
    for (const double low : {-3.0, 0.0, 1.0}) {
      const Axis axis = MakeAxis(low * size, (low + 1.7) * size, 6);
      EXPECT_GE(axis.ticks.size(), 3u) << size << " " << low;
      EXPECT_LE(axis.ticks.size(), 10u) << size << " " << low;
    }
  }
}

TEST(Axis, TickTexts) {
  const auto texts = [](double low, double high, int wanted) {
    std::string all;
    const Axis axis = MakeAxis(low, high, wanted);
    for (const double tick : axis.ticks) all += TickText(tick, axis) + " ";
    return all;
  };
  EXPECT_EQ(texts(0.0, 9000.0, 5), "0 2000 4000 6000 8000 ");
  EXPECT_EQ(texts(0.0, 20000.0, 4), "0 5k 10k 15k 20k ");
  EXPECT_EQ(texts(0.0, 2.1e6, 4), "0 0.5M 1.0M 1.5M 2.0M ");
  EXPECT_EQ(texts(-0.21, 0.11, 3), "-0.2 -0.1 0 0.1 ");
  EXPECT_EQ(texts(10000.0, 11000.0, 2), "10.0k 10.5k 11.0k ");
  EXPECT_EQ(texts(0.0, 2e13, 2), "0 1e+13 2e+13 ");
}

std::vector<CurvePoint> SomePoints(int count) {
  std::vector<CurvePoint> points;
  for (int i = 0; i < count; ++i) points.push_back({10.0 * i, 100.0 * std::sin(0.05 * i), 0.1 * i});
  return points;
}

TEST(CurveDrawing, BothPicturesAreWhole) {
  const CurveLabels labels{500.0, "ppo2 on a <world> & more", "mean 1", "episode reward", "an episode", "mean of 100"};
  for (const int count : {0, 1, 50, 4097}) {
    const TestFolder folder;
    ASSERT_TRUE(DrawCurve(folder.File("curve"), labels, SomePoints(count), {}).ok());
    const std::string svg = TextOf(folder.File("curve.svg")), png = TextOf(folder.File("curve.png"));
    EXPECT_EQ(svg.rfind("<?xml", 0), 0u);
    EXPECT_EQ(svg.substr(svg.size() - 7), "</svg>\n");
    EXPECT_LT(svg.size(), 400000u);
    ASSERT_GT(png.size(), 2000u);
    EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
    EXPECT_EQ(png.substr(12, 12), std::string("IHDR\x00\x00\x06\x40\x00\x00\x03\x84", 12)) << "1600 x 900";
    EXPECT_EQ(png.substr(png.size() - 8, 4), "IEND");
    EXPECT_LT(png.size(), 500000u);
  }
}

TEST(CurveDrawing, AFolderThatIsNotThereIsNamed) {
  const Status status = DrawCurve("/nowhere/curve", {}, SomePoints(3), {});
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.message().find("/nowhere/curve.svg"), std::string::npos) << status.message();
}

}  // namespace
}  // namespace consac::run
