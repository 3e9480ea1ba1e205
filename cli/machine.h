#pragma once
// What a measurement was made on, for `doctor` and `bench`.

#include <string>

namespace consac::cli {

/// Lets an allocation that exceeds the memory that is free now fail at once, instead of the system killing this program
/// or another.
void LimitMemory();
/// "g++ 12.2.0".
std::string CompilerName();
/// FLOP/s of a 64x64 dense layer on 64 rows, best of bursts that take about `seconds` together.
double MeasureDenseFlops(double seconds);

}  // namespace consac::cli
