#pragma once
// The feedback table that users of Stable Baselines know, letter by letter, in both generations' layouts.

#include <string>

#include "consac/learn/algo/learner.h"
#include "consac/learn/log/row.h"

namespace consac::run {

/// The value as the table shows it: "%-8.3g" for a double, else as Python's str() writes it.
std::string TableText(const learn::Cell& cell);
/// The table of one row, ending in a newline; empty for an empty row.
/// Sources: Stable Baselines 2.10.2 and Stable Baselines3, logger.py, HumanOutputFormat.
std::string FormatTable(learn::LogStyle style, const learn::Row& row);

}  // namespace consac::run
