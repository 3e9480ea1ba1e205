#pragma once
// Child processes under the system's own limits: of descriptors, memory and threads. Nothing is made to fail but by
// them. Sanitizers reserve and start more than such limits leave, so these tests belong to the plain presets.

#include <fcntl.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support.h"

namespace consac::testing {

/// One limit of the system.
struct Limit {
  decltype(RLIMIT_AS) resource;
  rlim_t value;
  rlim_t soft = RLIM_INFINITY;  ///< what the process may raise to `value`, where that is less
};

/// Sets them for this process. Threads are counted per user and not for root: then the process becomes a user of its
/// own first.
inline void Impose(const std::vector<Limit>& limits) {
  constexpr uid_t kFirstNobody = 100000;
  for (const Limit& limit : limits) {
    if (limit.resource == RLIMIT_NPROC && geteuid() == 0) {
      const auto nobody = static_cast<uid_t>(kFirstNobody + static_cast<uid_t>(getpid()));
      if (setgroups(0, nullptr) != 0 || setgid(nobody) != 0 || setuid(nobody) != 0) _exit(97);
    }
    const rlimit both{std::min(limit.soft, limit.value), limit.value};
    if (setrlimit(limit.resource, &both) != 0) _exit(97);
  }
}

/// The exit code of a process, 128 + N when signal N ended it.
inline int CodeOf(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

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

/// What the program left.
struct Left {
  int code = -1;
  std::string out, error;
};

/// All of a file.
inline std::string TextOf(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The program under limits, in a folder that any user may write to.
class LimitedProgram {
 public:
  LimitedProgram(const std::string& folder, std::vector<std::string> arguments, const std::vector<Limit>& limits,
                 unsigned alarm_s = 60)
      : folder_(folder) {
    chmod(folder.c_str(), 0777);
    arguments.insert(arguments.begin(), CONSAC_PROGRAM);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    child_ = fork();
    if (child_ != 0) return;
    if (chdir(folder.c_str()) != 0) _exit(99);
    dup2(open("out", O_CREAT | O_TRUNC | O_WRONLY, 0666), STDOUT_FILENO);
    dup2(open("error", O_CREAT | O_TRUNC | O_WRONLY, 0666), STDERR_FILENO);
    for (int other = STDERR_FILENO + 1; other < 1024; ++other) close(other);
    alarm(alarm_s);
    Impose(limits);
    execv(argv[0], argv.data());
    _exit(98);
  }
  ~LimitedProgram() {
    if (child_ <= 0) return;
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  LimitedProgram(const LimitedProgram&) = delete;
  LimitedProgram& operator=(const LimitedProgram&) = delete;

  void Signal(int number) const { kill(child_, number); }
  pid_t pid() const { return child_; }
  std::string error() const { return TextOf(folder_ + "/error"); }
  /// Waits for its end.
  Left Wait() {
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = -1;
    return {CodeOf(status), TextOf(folder_ + "/out"), error()};
  }

 private:
  std::string folder_;
  pid_t child_ = -1;
};

/// How often `part` is in `text`.
inline int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

}  // namespace consac::testing
