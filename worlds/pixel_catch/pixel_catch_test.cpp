// pixel-catch: what the image shows, how things move, what a ball pays.
#include "worlds/pixel_catch/pixel_catch.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace consac::worlds {
namespace {

struct CatchGame {
  PixelCatch game;
  Rng rng{1, 1};
  std::vector<std::uint8_t> image = std::vector<std::uint8_t>(PixelCatch::kPixels * PixelCatch::kPixels);
  CatchGame() { game.Reset(rng, image.data()); }
  StepResult Go(std::int32_t action) { return game.Step(&action, rng, image.data()); }
  std::uint8_t Pixel(std::int32_t row, std::int32_t column) const {
    return image[static_cast<std::size_t>(row * PixelCatch::kPixels + column)];
  }
};

TEST(PixelCatch, TheImageShowsBallAndPaddleAndNothingElse) {
  CatchGame seen;
  for (int step = 0; step < 200; ++step) {
    ASSERT_EQ(std::count(seen.image.begin(), seen.image.end(), 255), 2 * 4 * 4);
    ASSERT_EQ(std::count(seen.image.begin(), seen.image.end(), 0), 36 * 36 - 2 * 4 * 4);
    for (const std::int32_t inside : {0, 3}) {
      ASSERT_EQ(seen.Pixel(4 * seen.game.ball_row() + inside, 4 * seen.game.ball_column() + inside), 255);
      ASSERT_EQ(seen.Pixel(4 * 8 + inside, 4 * seen.game.paddle() + inside), 255);
    }
    seen.Go(static_cast<std::int32_t>(seen.rng.Below(3)));
  }
}

TEST(PixelCatch, ThePaddleStopsAtTheEdges) {
  CatchGame seen;
  EXPECT_EQ(seen.game.paddle(), 4);
  for (int i = 0; i < 6; ++i) seen.Go(0);
  EXPECT_EQ(seen.game.paddle(), 0);
  seen.Go(1);
  EXPECT_EQ(seen.game.paddle(), 0);
  for (int i = 0; i < 12; ++i) seen.Go(2);
  EXPECT_EQ(seen.game.paddle(), 8);
}

// Who follows the ball catches all of them, who runs from it none; each takes eight steps.
TEST(PixelCatch, ACaughtBallPaysOneAndAMissedOneCostsOne) {
  for (const bool follow : {true, false}) {
    CatchGame seen;
    int landed = 0;
    for (int step = 1; step <= 400; ++step) {
      const std::int32_t ball = seen.game.ball_column(), paddle = seen.game.paddle();
      const std::int32_t to = follow ? ball : ball > 4 ? 0 : 8;
      const StepResult result = seen.Go(to == paddle ? 1 : to > paddle ? 2 : 0);
      EXPECT_FALSE(result.terminated);
      EXPECT_EQ(result.reward, step % 8 != 0 ? 0.0f : follow ? 1.0f : -1.0f) << step;
      landed += result.reward != 0.0f;
    }
    EXPECT_EQ(landed, 50);
  }
}

}  // namespace
}  // namespace consac::worlds
