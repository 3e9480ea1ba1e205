#pragma once
// pixel-catch-v0: catch falling balls, seen as an image; the smallest task for a CNN. See README.md.

#include "worlds/batched.h"

namespace consac::worlds {

/// One board.
class PixelCatch {
 public:
  using Action = std::int32_t;       ///< 0 left, 1 stay, 2 right
  using Observation = std::uint8_t;  ///< 255 ball or paddle, 0 nothing

  static constexpr std::int32_t kCells = 9;                      ///< along a side
  static constexpr std::int32_t kCellPixels = 4;                 ///< along a side of a cell
  static constexpr std::int32_t kPixels = kCells * kCellPixels;  ///< along a side of the image
  static constexpr std::int32_t kBalls = 10;                     ///< of an episode

  /// What it offers: an image [36, 36, 1] and three actions.
  static EnvSpec Spec(std::int32_t copies);
  /// The paddle in the middle and a ball at the top.
  void Reset(Rng& rng, Observation* observation);
  /// The paddle moves, then the ball falls by a cell.
  StepResult Step(const Action* action, Rng& rng, Observation* observation);
  /// Exact state.
  void Visit(Archive& archive);

  /// Where the ball is, from the left and from the top.
  std::int32_t ball_column() const { return ball_column_; }
  std::int32_t ball_row() const { return ball_row_; }
  /// Where the paddle is, from the left.
  std::int32_t paddle() const { return paddle_; }

 private:
  void Drop(Rng& rng);
  void Draw(Observation* image) const;

  std::int32_t ball_column_ = 0, ball_row_ = 0, paddle_ = 0;
};

}  // namespace consac::worlds
