#pragma once
// Child processes under the system's own limits: of descriptors, memory and threads. Nothing is made to fail but by
// them. Sanitizers reserve and start more than such limits leave, so these tests belong to the plain presets.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <string>

#include "tests/program.h"
#include "tests/support.h"

namespace consac::testing {

/// What `body` returns, run in a process of its own; nobody waits for longer than `alarm_s`.
inline int InChild(const std::function<int()>& body, unsigned alarm_s = 60) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(alarm_s);
    _exit(body());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return CodeOf(status);
}

/// How often `part` is in `text`.
inline int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

}  // namespace consac::testing
