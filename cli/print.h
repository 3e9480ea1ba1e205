#pragma once
// What the verbs print. A reader that goes away (| head) or a full disk is seen at the end of the program, where it
// becomes one line and an exit code (main.cpp), and never stops what is under way. A reader that stands still (| less)
// is waited for, until the program is asked to stop.

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>

#include "consac/base/names.h"

namespace consac::cli {

/// Writes text to standard output or standard error, what does not show as \xNN; drops it where nobody reads and the
/// program is to stop.
void Write(std::FILE* stream, std::string_view text);
/// Sends the log to standard error; a line that nobody takes within a second is dropped, and stops nothing.
void LogToStandardError();
/// Writes what standard output still holds back: whether it has taken everything, from the beginning.
bool FlushOutput();

/// A text as one line, whoever wrote it; anything else as it is.
template <class Argument>
auto AsLine(const Argument& argument) {
  if constexpr (std::is_convertible_v<const Argument&, std::string_view>)
    return PrintableLine(std::string(std::string_view(argument)));
  else
    return argument;
}

/// Formats; a text among the arguments cannot add a line.
template <class... Arguments>
std::string FormatLines(std::string_view format, const Arguments&... arguments) {
  return fmt::format(fmt::runtime(format), AsLine(arguments)...);
}

/// Prints to standard output.
template <class... Arguments>
void Print(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  const fmt::string_view text = format;
  Write(stdout, FormatLines({text.data(), text.size()}, arguments...));
}

/// Prints to standard error.
template <class... Arguments>
void PrintError(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  const fmt::string_view text = format;
  Write(stderr, FormatLines({text.data(), text.size()}, arguments...));
}

/// Prints text of several lines that was made here, such as JSON, and a line end.
inline void PrintLines(const std::string& text) {
  Write(stdout, text + "\n");
}

/// An argument as a shell takes it: in quotes where it has a blank.
inline std::string Argument(const std::string& text) {
  return text.find(' ') == std::string::npos ? text : "\"" + text + "\"";
}

}  // namespace consac::cli
