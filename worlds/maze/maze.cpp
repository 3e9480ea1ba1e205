// Source: CONSAC's own.
#include "worlds/maze/maze.h"

#include <limits>

namespace consac::worlds {
namespace {

// '#' wall, '.' free, 'E' the exit.
constexpr const char* kMap[Maze::kSize] = {
    "...#...", ".#.#.#.", ".#...#.", ".###.#.", "...#.#.", ".#.#.#.", ".#...#E",
};
constexpr int kMoves[4][2] = {{-1, 0}, {0, 1}, {1, 0}, {0, -1}};

bool Open(int row, int column) {
  return row >= 0 && row < Maze::kSize && column >= 0 && column < Maze::kSize && kMap[row][column] != '#';
}

}  // namespace

EnvSpec Maze::Spec(std::int32_t copies) {
  return SimpleSpec("maze-v0", Space::Box(0, 1, {6}), Space::Discrete(4), copies, 100,
                    std::numeric_limits<double>::quiet_NaN());
}

void Maze::Observe(float* observation) const {
  observation[0] = static_cast<float>(row_) / (kSize - 1);
  observation[1] = static_cast<float>(column_) / (kSize - 1);
  for (int move = 0; move < 4; ++move) {
    observation[2 + move] = Open(row_ + kMoves[move][0], column_ + kMoves[move][1]) ? 1.0f : 0.0f;
  }
}

void Maze::Reset(Rng& rng, float* observation) {
  do {
    row_ = static_cast<std::int32_t>(rng.Below(kSize));
    column_ = static_cast<std::int32_t>(rng.Below(kSize));
  } while (kMap[row_][column_] != '.');
  Observe(observation);
}

// Every step costs 0.01, the exit pays 1: the shorter the way, the higher the return.
StepResult Maze::Step(const Action* action, Rng&, float* observation) {
  const int* move = kMoves[*action & 3];
  if (Open(row_ + move[0], column_ + move[1])) {
    row_ += move[0];
    column_ += move[1];
  }
  Observe(observation);
  const bool out = kMap[row_][column_] == 'E';
  return {out ? 1.0f : -0.01f, out};
}

void Maze::Visit(Archive& archive) {
  archive("row", row_);
  archive("column", column_);
  archive.Check("column", Open(row_, column_));
}

}  // namespace consac::worlds
