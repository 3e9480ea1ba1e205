// Spaces and layouts: Gymnasium's order, bounds, sampling, containment.
#include "consac/space/space.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "consac/space/layout.h"

namespace consac {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Space Nested() {
  return *Space::Dict({{"z", *Space::Discrete(3, 5)},
                       {"a", *Space::Tuple({*Space::Box(-1, 1, {2}), *Space::MultiBinary(2)})},
                       {"image", *Space::Box(0, 255, {2, 2}, DType::kU8)},
                       {"m", *Space::MultiDiscrete({2, 4})}});
}

TEST(Space, RefusesWhatIsNoSpace) {
  EXPECT_FALSE(Space::Discrete(0).ok());
  EXPECT_FALSE(Space::Box(1, 0, {2}).ok());
  EXPECT_FALSE(Space::Box({0, 0}, {1}, {2}).ok());
  EXPECT_FALSE(Space::Box(0, 1, {0}).ok());
  EXPECT_FALSE(Space::Box(-kInfinity, kInfinity, {1}, DType::kU8).ok());
  EXPECT_FALSE(Space::Box(std::nan(""), 1, {1}).ok());
  EXPECT_FALSE(Space::MultiDiscrete({2, 0}).ok());
  EXPECT_FALSE(Space::MultiDiscrete({1, std::numeric_limits<std::int64_t>::max()}).ok());
  EXPECT_FALSE(Space::Discrete(2, std::numeric_limits<std::int64_t>::min()).ok());
  EXPECT_FALSE(Space::MultiBinary(0).ok());
  EXPECT_FALSE(Space::Dict({{"a", *Space::Discrete(2)}, {"a", *Space::Discrete(2)}}).ok());
  EXPECT_FALSE(Space::Tuple({}).ok());
}

// 0.1 is no float32: the bound is the nearest one, as in Gymnasium, so that what is clipped to it lies within.
TEST(Space, BoundsAreNumbersOfTheSpacesType) {
  const Layout layout = Layout::Of(*Space::Box(-0.1, 0.1, {1}));
  float value = 5.0f;
  ClipRow(layout, reinterpret_cast<std::byte*>(&value));
  EXPECT_TRUE(CheckRow(layout, reinterpret_cast<std::byte*>(&value)).ok());
  EXPECT_EQ(layout.leaves[0].space.ToString(), "Box(-0.1, 0.1, (1,), float32)");
}

TEST(Space, FlatSizeIsGymnasiums) {
  EXPECT_EQ(Space::Discrete(4)->flat_size(), 4);
  EXPECT_EQ(Space::MultiDiscrete({2, 3, 4})->flat_size(), 9);
  EXPECT_EQ(Space::Box(0, 1, {3, 4})->flat_size(), 12);
  EXPECT_EQ(Nested().flat_size(), 2 + 2 + 4 + 6 + 3);
}

TEST(Layout, DictIsSortedAndLeavesAreNamedAndAligned) {
  const Layout layout = Layout::Of(Nested());
  ASSERT_EQ(layout.leaves.size(), 5u);
  const char* names[] = {"a/0", "a/1", "image", "m", "z"};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(layout.leaves[i].name, names[i]);
    EXPECT_EQ(layout.leaves[i].offset % SizeOf(layout.leaves[i].dtype), 0u);
  }
  EXPECT_EQ(layout.leaves[2].dtype, DType::kU8);
  EXPECT_EQ(layout.row_bytes % 4, 0u);
  EXPECT_FALSE(layout.plain_floats);
  EXPECT_EQ(layout.mask_bytes, 4 + 6 + 3);
}

// gymnasium.spaces.flatten of the same value, worked out by hand.
TEST(Layout, EncodesInGymnasiumsOrder) {
  const Layout layout = Layout::Of(Nested());
  std::vector<std::byte> row(layout.row_bytes);
  WriteElement(layout.leaves[0], row.data(), 0, 0.25);
  WriteElement(layout.leaves[0], row.data(), 1, -0.5);
  WriteElement(layout.leaves[1], row.data(), 1, 1);
  for (int i = 0; i < 4; ++i) WriteElement(layout.leaves[2], row.data(), i, 10 * i);
  WriteElement(layout.leaves[3], row.data(), 0, 1);
  WriteElement(layout.leaves[3], row.data(), 1, 2);
  WriteElement(layout.leaves[4], row.data(), 0, 6);
  std::vector<float> features(static_cast<std::size_t>(layout.feature_count));
  EncodeFeatures(layout, row.data(), 1, features.data());
  EXPECT_EQ(features, (std::vector<float>{0.25f, -0.5f, 0, 1, 0, 10, 20, 30, 0, 1, 0, 0, 1, 0, 0, 1, 0}));
}

TEST(Layout, SamplesLieInTheSpaceAndFillIt) {
  const Layout layout = Layout::Of(Nested());
  std::vector<std::byte> row(layout.row_bytes);
  Rng rng(1, 1);
  bool seen[3] = {};
  for (int i = 0; i < 1000; ++i) {
    SampleRow(layout, rng, row.data());
    ASSERT_TRUE(CheckRow(layout, row.data()).ok());
    seen[static_cast<int>(ReadElement(layout.leaves[4], row.data(), 0)) - 5] = true;
  }
  EXPECT_TRUE(seen[0] && seen[1] && seen[2]);
}

TEST(Layout, UnboundedSidesAreSampledToo) {
  const Layout layout = Layout::Of(*Space::Box({-kInfinity, 0, -kInfinity}, {kInfinity, kInfinity, 3}, {3}));
  float row[3];
  Rng rng(1, 1);
  for (int i = 0; i < 100; ++i) {
    SampleRow(layout, rng, reinterpret_cast<std::byte*>(row));
    EXPECT_TRUE(std::isfinite(row[0]) && row[1] >= 0 && row[2] <= 3);
  }
}

TEST(Layout, CheckNamesLeafValueAndBound) {
  const Layout layout = Layout::Of(Nested());
  std::vector<std::byte> row(layout.row_bytes);
  Rng rng(1, 1);
  SampleRow(layout, rng, row.data());
  WriteElement(layout.leaves[0], row.data(), 1, 3.5);
  const Status high = CheckRow(layout, row.data());
  EXPECT_EQ(high.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(high.message().find("'a/0'"), std::string::npos);
  EXPECT_NE(high.message().find("3.5"), std::string::npos);
  ClipRow(layout, row.data());
  EXPECT_TRUE(CheckRow(layout, row.data()).ok());
  WriteElement(layout.leaves[0], row.data(), 1, std::nan(""));
  EXPECT_EQ(CheckRow(layout, row.data()).code(), StatusCode::kNonFinite);
}

TEST(Layout, AnIntegerTakesTheNearestValueThatItHas) {
  const Layout layout =
      Layout::Of(*Space::Dict({{"pixel", *Space::Box(0, 255, {1}, DType::kU8)}, {"choice", *Space::Discrete(3)}}));
  std::vector<std::byte> row(layout.row_bytes);
  const auto written = [&](std::size_t leaf, double value) {
    WriteElement(layout.leaves[leaf], row.data(), 0, value);
    return ReadElement(layout.leaves[leaf], row.data(), 0);
  };
  for (std::size_t leaf = 0; leaf < 2; ++leaf) {
    const double lowest = written(leaf, -1e30), highest = written(leaf, 1e30);
    EXPECT_EQ(lowest, layout.leaves[leaf].dtype == DType::kU8 ? 0.0 : -2147483648.0);
    EXPECT_EQ(highest, layout.leaves[leaf].dtype == DType::kU8 ? 255.0 : 2147483647.0);
    EXPECT_EQ(written(leaf, std::nan("")), lowest);
    EXPECT_EQ(written(leaf, 2.4), 2.0);
  }
}

TEST(Layout, EachChoiceOfAMaskIsLookedAtByItself) {
  const Layout layout = Layout::Of(*Space::Dict({{"bits", *Space::MultiBinary(1)},
                                                 {"gear", *Space::MultiDiscrete({2, 3})},
                                                 {"push", *Space::Box(-1, 1, {4})},
                                                 {"turn", *Space::Discrete(2)}}));
  const std::vector<std::int64_t> choices = MaskedChoices(layout);
  EXPECT_EQ(choices, (std::vector<std::int64_t>{2, 2, 3, 2}));
  const std::vector<std::uint8_t> legal = {0, 1, 1, 0, 0, 0, 1, 1, 0};
  ASSERT_EQ(static_cast<std::int64_t>(legal.size()), layout.mask_bytes);
  EXPECT_EQ(ChoiceWithNothingLegal(choices, legal.data()), -1);
  std::vector<std::uint8_t> mask = legal;
  mask[6] = 0;  // the second of `gear`, whose first has something
  EXPECT_EQ(ChoiceWithNothingLegal(choices, mask.data()), 2);
  mask[1] = 0;
  EXPECT_EQ(ChoiceWithNothingLegal(choices, mask.data()), 0);
  EXPECT_TRUE(MaskedChoices(Layout::Of(*Space::Box(-1, 1, {2}))).empty());
}

TEST(Space, TextNamesItAsGymnasiumDoes) {
  EXPECT_EQ(Space::Discrete(3)->ToString(), "Discrete(3)");
  EXPECT_EQ(Space::Box({0, 0}, {40, 20}, {2})->ToString(), "Box(0, [40, 20], (2,), float32)");
}

}  // namespace
}  // namespace consac
