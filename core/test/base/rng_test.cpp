// The generator against Philox's published vectors, and what it promises.
#include "consac/base/rng.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "consac/base/archive.h"

namespace consac {
namespace {

// Random123's known-answer test: counter 0, key 0.
TEST(Rng, MatchesPhilox4x32WithTenRounds) {
  Rng rng(0, 0, 0);
  EXPECT_EQ(rng.NextU32(), 0x6627e8d5u);
  EXPECT_EQ(rng.NextU32(), 0xe169c58du);
  EXPECT_EQ(rng.NextU32(), 0xbc57ac4cu);
  EXPECT_EQ(rng.NextU32(), 0x9b00dbd8u);
}

TEST(Rng, StreamsAndIndicesDiffer) {
  Rng a(1, StreamId("x")), b(1, StreamId("y")), c(1, StreamId("x"), 1), d(2, StreamId("x"));
  const std::uint64_t first = a.NextU64();
  EXPECT_NE(first, b.NextU64());
  EXPECT_NE(first, c.NextU64());
  EXPECT_NE(first, d.NextU64());
}

TEST(Rng, UniformAndBelowStayInRangeAndCoverIt) {
  Rng rng(3, 1);
  std::array<int, 7> counts{};
  double sum = 0.0;
  for (int i = 0; i < 70000; ++i) {
    const float u = rng.Uniform();
    ASSERT_GE(u, 0.0f);
    ASSERT_LT(u, 1.0f);
    sum += u;
    ++counts[rng.Below(7)];
  }
  EXPECT_NEAR(sum / 70000, 0.5, 0.005);
  for (const int count : counts) EXPECT_NEAR(count, 10000, 500);
}

TEST(Rng, NormalHasUnitMoments) {
  Rng rng(5, 1);
  double sum = 0, squares = 0, fourth = 0;
  constexpr int kCount = 200000;
  for (int i = 0; i < kCount; ++i) {
    const double x = rng.Normal();
    sum += x;
    squares += x * x;
    fourth += x * x * x * x;
  }
  EXPECT_NEAR(sum / kCount, 0.0, 0.01);
  EXPECT_NEAR(squares / kCount, 1.0, 0.015);
  EXPECT_NEAR(fourth / kCount, 3.0, 0.12);
}

TEST(Rng, RestoredStateGoesOnTheSameWay) {
  Rng rng(9, 4);
  for (int i = 0; i < 5; ++i) rng.Normal();
  StateWriter writer;
  rng.Visit(writer);
  Rng other;
  StateReader reader(writer.fields());
  other.Visit(reader);
  ASSERT_TRUE(reader.status().ok());
  for (int i = 0; i < 9; ++i) EXPECT_EQ(rng.Normal(), other.Normal());
}

TEST(Rng, ShuffleIsAPermutation) {
  Rng rng(1, 1);
  std::vector<std::int32_t> items(100);
  std::iota(items.begin(), items.end(), 0);
  const std::vector<std::int32_t> before = items;
  rng.Shuffle(items);
  EXPECT_NE(items, before);
  std::sort(items.begin(), items.end());
  EXPECT_EQ(items, before);
}

}  // namespace
}  // namespace consac
