#pragma once
// Numbers and names as text: locale-free, shortest-exact, no exceptions. Used by the text protocol, configuration
// and error messages.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace consac {

/// Writes the shortest text that reads back as exactly `value`; returns its length (at most 32 characters).
std::size_t FormatNumber(float value, std::span<char, 32> out);
/// The same for a double.
std::size_t FormatNumber(double value, std::span<char, 32> out);
/// The same as a string, for messages.
std::string NumberText(double value);

/// Reads all of `text` as a number; false when it is none or something is left over. Accepts no spaces, no
/// infinity and no NaN.
bool ParseNumber(std::string_view text, float* value);
/// The same for a double.
bool ParseNumber(std::string_view text, double* value);
/// The same for an integer.
bool ParseNumber(std::string_view text, std::int64_t* value);

/// As people write them in flags and files: "1_000_000" (an underscore between digits, as in Python).
bool ParseHumanNumber(std::string_view text, double* value);
/// The same for a whole number, which may also be written "1e6"; beyond 2^53 that is the nearest double.
bool ParseHumanNumber(std::string_view text, std::int64_t* value);

/// `text` in quotes, cut to `limit` bytes at a character's end, as a line for people (PrintableLine in names.h).
std::string Quote(std::string_view text, std::size_t limit = 80);
/// The known name of the same words in another order, else the nearest one by edit distance; empty when none is near
/// enough to be meant.
std::string_view NearestName(std::string_view name, std::span<const std::string_view> known);
/// " (did you mean 'x'?)" or a list of what is known, to end an "unknown ..." message.
std::string Suggestion(std::string_view name, std::span<const std::string_view> known);
/// Names joined by ", ".
std::string Join(std::span<const std::string_view> names);

}  // namespace consac
