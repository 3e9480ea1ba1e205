#pragma once
// The console table in Stable Baselines' two layouts. Private to run.

#include <map>
#include <string>
#include <vector>

#include "consac/learn/algo/learner.h"

namespace consac::run {

/// A cell: a number and how it prints.
struct Cell {
  double value = 0.0;              ///< NaN prints "nan"
  bool whole = false;              ///< a count
  bool single_precision = false;   ///< all digits of a float32
};
/// Cells by key; the map's order is the table's.
using Cells = std::map<std::string, Cell>;

/// How Stable Baselines writes the number in its table: "%-8.3g" for doubles, all digits for float32.
std::string CellText(const Cell& cell);
/// The table, lines with newlines. SB2: flat keys between dashed rules. SB3: keys grouped by section.
std::string RenderTable(const Cells& cells, learn::LogStyle style);

}  // namespace consac::run
