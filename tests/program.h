#pragma once
// The built program from outside: started in a folder of its own, under limits of the system where a test wants them,
// and what it leaves. CONSAC_PROGRAM is its path.

#include <fcntl.h>
#include <grp.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/files.h"

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

/// What a finished program left.
struct Outcome {
  int code = -1;
  std::string out, error;
};

/// How a program is started.
struct ProgramOptions {
  std::vector<Limit> limits = {};
  int out = -1;            ///< its standard output; -1: a file
  unsigned alarm_s = 300;  ///< nobody waits for longer
};

/// The program, running in a folder that any user may write to.
class Program {
 public:
  Program(const std::string& folder, std::vector<std::string> arguments, const ProgramOptions& options = {})
      : folder_(folder), number_(++count_) {
    chmod(folder.c_str(), 0777);
    arguments.insert(arguments.begin(), CONSAC_PROGRAM);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    child_ = fork();
    if (child_ != 0) return;
    if (chdir(folder.c_str()) != 0) _exit(99);
    const auto redirect = [](const std::string& path, int to) {
      dup2(open(path.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0666), to);
    };
    redirect(Path("out"), STDOUT_FILENO);
    if (options.out >= 0) dup2(options.out, STDOUT_FILENO);
    redirect(Path("error"), STDERR_FILENO);
    for (int other = STDERR_FILENO + 1; other < 1024; ++other) close(other);
    // As at a terminal: a job in the background of a script ignores them, and so would its children.
    for (const int heard : {SIGHUP, SIGINT, SIGQUIT}) signal(heard, SIG_DFL);
    alarm(options.alarm_s);
    Impose(options.limits);
    execv(argv[0], argv.data());
    _exit(98);
  }
  ~Program() {
    if (child_ <= 0) return;
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void Signal(int number) const { kill(child_, number); }
  pid_t pid() const { return child_; }
  std::string out() const { return TextOf(Path("out")); }
  std::string error() const { return TextOf(Path("error")); }
  /// Waits for its end.
  Outcome Wait() {
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = -1;
    return {CodeOf(status), out(), error()};
  }

 private:
  std::string Path(const char* what) const { return folder_ + "/" + what + std::to_string(number_); }
  static inline int count_ = 0;
  std::string folder_;
  int number_;
  pid_t child_ = -1;
};

}  // namespace consac::testing
