#pragma once
// Output that somebody reads, or does not: a pager that stands still, a terminal that was stopped with Ctrl-S.

#include <cstddef>
#include <cstdio>
#include <string_view>

namespace consac::run {

/// The most text that may be written at once after TakesOutput: what any pipe with room has room for.
inline constexpr std::size_t kOutputPiece = 1024;

/// Whether a piece of text can be written to `stream` without waiting for its reader; waits for that at most `wait_s`.
/// True for files, and where the reader has gone: what is written then fails at once.
bool TakesOutput(std::FILE* stream, double wait_s);

/// Writes text. A failure is kept for OutputError and stops nothing.
void WriteOutput(std::FILE* stream, std::string_view text);
/// Hands on what `stream` holds back; failures as above.
void FlushOutput(std::FILE* stream);
/// Why standard output did not take something: the errno of the first time; 0 while it has taken all.
int OutputError();

}  // namespace consac::run
