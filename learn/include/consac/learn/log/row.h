#pragma once
// One row of a training's log: the numbers of an update under their keys. The console table and progress.csv show the
// same row; how a number is written follows Stable Baselines, which prints Python and NumPy values.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace consac::learn {

/// What a number would be in Stable Baselines, which decides how its table shows it.
enum class CellKind : std::uint8_t {
  kDouble,   ///< Python float: three digits in the table
  kSingle,   ///< NumPy float32: all its digits
  kInteger,  ///< Python int
};

/// A number under its key.
struct Cell {
  std::string_view key;               ///< "ep_reward_mean", "rollout/ep_rew_mean"; lives as long as the row is used
  double value = 0.0;                 ///< NaN allowed
  CellKind kind = CellKind::kDouble;  ///< how it is shown
};

/// Sorted by key.
using Row = std::vector<Cell>;

/// Keys without a section first, each lot by name.
void SortByKey(Row* row);
/// The value as Python's str() writes it: shortest-exact, "1.0" for a whole float.
std::string ExactText(const Cell& cell);
/// The same of a float, into `out`: what is returned lies there.
std::string_view ExactText(double value, std::span<char, 32> out);

}  // namespace consac::learn
