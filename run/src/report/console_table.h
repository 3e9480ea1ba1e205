#pragma once
// The feedback table that users of Stable Baselines know, letter by letter, in both generations' layouts.

#include <string>

#include "consac/learn/algo/learner.h"
#include "report/row.h"

namespace consac::run {

/// The table of one row, ending in a newline; empty for an empty row.
/// Sources: Stable Baselines 2.10.2 and Stable Baselines3, logger.py, HumanOutputFormat.
std::string FormatTable(learn::LogStyle style, const Row& row);

}  // namespace consac::run
