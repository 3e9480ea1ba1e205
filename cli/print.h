#pragma once
// Standard output of the verbs. A reader that goes away (| head) or a full disk is seen at the end of the program,
// where it becomes one line and an exit code (main.cpp), and never stops what is under way.

#include <fmt/format.h>

#include <cstdio>
#include <string>

namespace consac::cli {

/// Prints to standard output.
template <class... Arguments>
void Print(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  const std::string text = fmt::format(format, std::forward<Arguments>(arguments)...);
  (void)std::fwrite(text.data(), 1, text.size(), stdout);
}

/// Prints to standard error.
template <class... Arguments>
void PrintError(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  const std::string text = fmt::format(format, std::forward<Arguments>(arguments)...);
  (void)std::fwrite(text.data(), 1, text.size(), stderr);
}

/// An argument as a shell takes it: in quotes where it has a blank.
inline std::string Argument(const std::string& text) {
  return text.find(' ') == std::string::npos ? text : "\"" + text + "\"";
}

}  // namespace consac::cli
