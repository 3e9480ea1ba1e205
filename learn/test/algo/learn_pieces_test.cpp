#include "consac/learn/algo/learn_pieces.h"

#include <gtest/gtest.h>

namespace consac::learn {
namespace {

// What a piece takes where an optimiser step takes `step_s`, in the long run.
double PieceOf(double step_s, LearnPieces* pieces) {
  double now = 1000.0;
  for (int k = 0; k < 40; ++k) {
    now += step_s * static_cast<double>(pieces->budget().gradient_steps);
    pieces->Look(now);
  }
  return step_s * static_cast<double>(pieces->budget().gradient_steps);
}

TEST(LearnPieces, NobodyWaitsForMoreThanAMomentOrOneStep) {
  for (const double step_s : {1e-6, 1e-4, 1e-3, 0.02, 1.0}) {
    LearnPieces pieces;
    EXPECT_EQ(pieces.budget().gradient_steps, 1) << "of what nothing is known";
    EXPECT_LE(PieceOf(step_s, &pieces), std::max(step_s, 0.05)) << step_s;
  }
  LearnPieces quick;
  (void)PieceOf(1e-6, &quick);
  EXPECT_EQ(quick.budget().gradient_steps, 64);
  EXPECT_LE(PieceOf(1.0, &quick), 1.0) << "steps that have become slow";
}

}  // namespace
}  // namespace consac::learn
