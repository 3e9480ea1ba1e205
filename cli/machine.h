#pragma once
// What the program asks of the machine, and what a measurement was made on, for `doctor` and `bench`.

#include <cstddef>
#include <string>
#include <string_view>

namespace consac::cli {

/// Lets an allocation that exceeds the memory that is free now fail at once, instead of the system killing this program
/// or another.
void LimitMemory();
/// Takes the main thread's stack as far as anything here needs it, or half of a smaller one. It would grow as it is
/// used, and where memory has run short by then that is a fault that nothing can catch. Other threads have all of
/// theirs from the start. False where it may not even have kLeastStack.
bool TakeStack();
inline constexpr std::size_t kLeastStack = std::size_t{128} << 10;  ///< bytes
/// As many connections and files as the system's hard limit has, not only those of the soft one.
void AllowManyFiles();
/// Makes a terminal show UTF-8, as all of the program's words are; and a write that nobody can take an error instead of
/// the end of the program.
void PrepareOutput();
/// Writes `line` to standard error, if that takes it at once, and ends the process, as a signal handler may.
[[noreturn]] void EndAtOnce(std::string_view line, int code);
/// Whether what standard output does not take is nobody's fault: its reader has left, or there never was a console.
bool OutputMayBeLost();
/// "g++ 12.2.0".
std::string CompilerName();
/// FLOP/s of a 64x64 dense layer on 64 rows, best of bursts that take about `seconds` together.
double MeasureDenseFlops(double seconds);

}  // namespace consac::cli
