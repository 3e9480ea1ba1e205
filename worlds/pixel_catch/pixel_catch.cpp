// Source: after bsuite's catch, Osband et al. 2020, arXiv:1908.03568.
#include "worlds/pixel_catch/pixel_catch.h"

#include <algorithm>

namespace consac::worlds {
namespace {

constexpr std::int32_t kBottom = PixelCatch::kCells - 1;
constexpr std::int64_t kEpisodeSteps = PixelCatch::kBalls * kBottom;
constexpr double kSolved = 9.0;  // one ball in twenty missed

void FillCell(std::int32_t column, std::int32_t row, std::uint8_t* image) {
  for (std::int32_t y = 0; y < PixelCatch::kCellPixels; ++y) {
    const std::int32_t line = (row * PixelCatch::kCellPixels + y) * PixelCatch::kPixels;
    std::fill_n(image + line + column * PixelCatch::kCellPixels, PixelCatch::kCellPixels, std::uint8_t{255});
  }
}

}  // namespace

EnvSpec PixelCatch::Spec(std::int32_t copies) {
  return SimpleSpec("pixel-catch-v0", Space::Box(0, 255, {kPixels, kPixels, 1}, DType::kU8), Space::Discrete(3), copies,
                    kEpisodeSteps, kSolved);
}

void PixelCatch::Drop(Rng& rng) {
  ball_column_ = static_cast<std::int32_t>(rng.Below(kCells));
  ball_row_ = 0;
}

void PixelCatch::Draw(Observation* image) const {
  std::fill_n(image, kPixels * kPixels, Observation{0});
  FillCell(ball_column_, ball_row_, image);
  FillCell(paddle_, kBottom, image);
}

void PixelCatch::Reset(Rng& rng, Observation* observation) {
  paddle_ = kCells / 2;
  Drop(rng);
  Draw(observation);
}

StepResult PixelCatch::Step(const Action* action, Rng& rng, Observation* observation) {
  paddle_ = std::clamp(paddle_ + *action - 1, 0, kCells - 1);
  StepResult result;
  if (++ball_row_ == kBottom) {
    result.reward = ball_column_ == paddle_ ? 1.0f : -1.0f;
    Drop(rng);
  }
  Draw(observation);
  return result;
}

void PixelCatch::Visit(Archive& archive) {
  archive("ball_column", ball_column_);
  archive("ball_row", ball_row_);
  archive("paddle", paddle_);
  const auto on_board = [](std::int32_t cell) { return cell >= 0 && cell < kCells; };
  archive.Check("paddle", on_board(ball_column_) && ball_row_ >= 0 && ball_row_ < kBottom && on_board(paddle_));
}

}  // namespace consac::worlds
