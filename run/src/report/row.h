#pragma once
// One row of a run's log: the numbers of an update under their keys. The console table and progress.csv show the
// same row; how a number is written follows Stable Baselines, which prints Python and NumPy values.

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace consac::run {

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

/// The value as the table shows it: "%-8.3g" for a double, else ExactText.
std::string TableText(const Cell& cell);
/// The value as Python's str() writes it: shortest-exact, "1.0" for a whole float.
std::string ExactText(const Cell& cell);
/// Appends a float as Python's str() writes it. Allocates only past the buffer's inline size.
void AppendExact(double value, fmt::memory_buffer* out);

}  // namespace consac::run
