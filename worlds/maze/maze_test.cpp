// The maze: where one can go, what a step costs and what the exit pays.
#include "worlds/maze/maze.h"

#include <gtest/gtest.h>

#include "worlds/put.h"

namespace consac::worlds {
namespace {

enum Move : std::int32_t { kUp, kRight, kDown, kLeft };

struct MazeWalk {
  Maze maze;
  Rng rng{1, 1};
  float seen[6] = {};
  void Put(std::int32_t row, std::int32_t column) {
    worlds::Put(maze, "row", std::vector<std::int32_t>{row});
    worlds::Put(maze, "column", std::vector<std::int32_t>{column});
  }
  StepResult Go(Move move) {
    const std::int32_t action = move;
    return maze.Step(&action, rng, seen);
  }
  int row() const { return static_cast<int>(seen[0] * 6.0f + 0.5f); }
  int column() const { return static_cast<int>(seen[1] * 6.0f + 0.5f); }
};

TEST(Maze, EveryStepCostsAHundredthAndWallsStop) {
  MazeWalk walk;
  walk.Put(0, 0);
  for (const Move into_wall : {kUp, kLeft}) {
    EXPECT_FLOAT_EQ(walk.Go(into_wall).reward, -0.01f);
    EXPECT_EQ(walk.row(), 0);
    EXPECT_EQ(walk.column(), 0);
  }
  EXPECT_FLOAT_EQ(walk.Go(kRight).reward, -0.01f);
  EXPECT_EQ(walk.column(), 1);
  walk.Go(kDown);
  EXPECT_EQ(walk.row(), 0) << "a wall is there";
  EXPECT_EQ(std::vector<float>(walk.seen + 2, walk.seen + 6), (std::vector<float>{0, 1, 0, 1}));
}

TEST(Maze, TheExitPaysOneAndEndsTheEpisode) {
  MazeWalk walk;
  walk.Put(4, 6);
  StepResult result = walk.Go(kDown);
  EXPECT_FLOAT_EQ(result.reward, -0.01f);
  EXPECT_FALSE(result.terminated);
  result = walk.Go(kDown);
  EXPECT_EQ(result.reward, 1.0f);
  EXPECT_TRUE(result.terminated);
  EXPECT_EQ(walk.row(), 6);
  EXPECT_EQ(walk.column(), 6);
}

TEST(Maze, BeginsOnFreeCellsButTheExit) {
  MazeWalk walk;
  for (int i = 0; i < 500; ++i) {
    walk.maze.Reset(walk.rng, walk.seen);
    ASSERT_FALSE(walk.row() == 6 && walk.column() == 6);
    ASSERT_GT(walk.seen[2] + walk.seen[3] + walk.seen[4] + walk.seen[5], 0.0f) << "there is a way on";
  }
}

}  // namespace
}  // namespace consac::worlds
