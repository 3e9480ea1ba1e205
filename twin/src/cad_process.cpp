#include "cad_process.h"

#include <algorithm>
#include <vector>

#include "consac/base/path.h"
#include "consac/base/text.h"

#if defined(__linux__)
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

extern char** environ;  // NOLINT: what a program is started with
#endif

namespace consac::twin {

#if !defined(__linux__)  // what follows is of its own calls: pipe2, /proc

CadOutput::~CadOutput() = default;

Result<std::shared_ptr<CadOutput>> RunCadProgram(const std::string& path, const CadOptions&, const ImportProgress&) {
  return Status{StatusCode::kUnavailable,
                "'" + path + "': CAD files are read on Linux only; make the twin there, or " + "export a URDF"};
}

#else

namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kProgram = "consac-cad";
constexpr int kLookEvery = 100;               // ms: whether to stop
constexpr int kLookEveryMute = 5;             // ms: whether what says nothing more has ended
constexpr std::size_t kMostSaid = 64 * 1024;  // bytes of what it says, from the end

// Beside the running program, then where the system looks for programs; "" nowhere.
std::string FindProgram(const CadOptions& options) {
  if (!options.program.empty()) return options.program;
  std::vector<std::filesystem::path> folders;
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) folders.push_back(self.parent_path());
  const char* path = std::getenv("PATH");
  std::string_view rest = path != nullptr ? path : "";
  while (!rest.empty()) {
    const std::string_view folder = rest.substr(0, rest.find(':'));
    rest.remove_prefix(std::min(folder.size() + 1, rest.size()));
    if (!folder.empty()) folders.emplace_back(folder);
  }
  for (const std::filesystem::path& folder : folders) {
    const std::string program = FromPath(folder / kProgram);
    if (access(program.c_str(), X_OK) == 0 && std::filesystem::is_regular_file(ToPath(program), error)) return program;
  }
  return "";
}

// A descriptor of a file that has no name: gone with whoever holds it.
int NamelessFile() {
  std::error_code error;
  std::string name = FromPath(std::filesystem::temp_directory_path(error) / "consac-cad-XXXXXX");
  const int file = error ? -1 : mkostemp(name.data(), O_CLOEXEC);
  if (file >= 0) unlink(name.c_str());
  return file;
}

// The child, and what it says on its standard error.
class Child {
 public:
  ~Child() {
    if (process_ > 0) {
      kill(process_, SIGKILL);
      while (waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
      }
    }
    if (said_ >= 0) close(said_);
  }

  bool Start(std::vector<std::string> arguments, int out) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return false;
    said_ = ends[0];
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const bool started = posix_spawn(&process_, argv[0], &actions, nullptr, argv.data(), environ) == 0;
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (!started) process_ = -1;
    return started;
  }

  // Waits a moment for it to say something, or to end; false once it has ended.
  bool Listen() {
    if (mute_) {
      (void)poll(nullptr, 0, kLookEveryMute);
      return !HasEnded();
    }
    pollfd waiting{said_, POLLIN, 0};
    if (poll(&waiting, 1, kLookEvery) <= 0) return true;
    char piece[4096];
    const ssize_t count = read(said_, piece, sizeof piece);
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) return true;
    if (count > 0) text_.append(piece, static_cast<std::size_t>(count));
    if (text_.size() > 2 * kMostSaid) text_.erase(0, text_.size() - kMostSaid);
    mute_ = count <= 0;
    return !mute_ || !HasEnded();
  }

  // How it ended, as waitpid says.
  int status() const { return status_; }

  // The last line that begins so, without its beginning; "" none.
  std::string Last(std::string_view begin) const {
    std::string found;
    for (std::string_view rest = text_; !rest.empty();) {
      const std::string_view line = rest.substr(0, rest.find('\n'));
      rest.remove_prefix(std::min(line.size() + 1, rest.size()));
      if (line.starts_with(begin)) found = line.substr(begin.size());
    }
    return found;
  }

 private:
  bool HasEnded() {
    const pid_t ended = waitpid(process_, &status_, WNOHANG);
    if (ended == 0 || (ended < 0 && errno == EINTR)) return false;
    process_ = -1;
    return true;
  }

  pid_t process_ = -1;
  int said_ = -1, status_ = 0;
  bool mute_ = false;  // it has closed its standard error, mostly since it ends
  std::string text_;
};

// "12 161" as a progress, nothing yet as 0 of 0; false to stop.
bool Tell(const std::string& line, const ImportProgress& progress) {
  if (!progress) return true;
  std::int64_t done = 0, of = 0;
  const std::size_t blank = line.find(' ');
  if (blank == std::string::npos || !ParseNumber(line.substr(0, blank), &done) ||
      !ParseNumber(line.substr(blank + 1), &of))
    done = of = 0;
  return progress(static_cast<std::size_t>(std::max<std::int64_t>(done, 0)),
                  static_cast<std::size_t>(std::max<std::int64_t>(of, 0)));
}

Status Why(const std::string& path, const CadOptions& options, int status, const std::string& said) {
  const std::string file = "'" + path + "': ";
  if (!said.empty()) return {StatusCode::kDataLoss, file + said};
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
    return {StatusCode::kDeadlineExceeded, file + "OpenCASCADE took more than " + NumberText(options.seconds) +
                                               " s; allow more by --cad-seconds, or simplify the assembly"};
  if (WIFSIGNALED(status))
    return {StatusCode::kDataLoss, file + "OpenCASCADE ended by signal " + std::to_string(WTERMSIG(status)) + " (" +
                                       strsignal(WTERMSIG(status)) + "), at " + NumberText(options.mebibytes) +
                                       " MiB at most; is the file damaged? Export it again, or allow more by "
                                       "--cad-mebibytes"};
  return {StatusCode::kDataLoss,
          file + "consac-cad ended with code " + std::to_string(WEXITSTATUS(status)) + "; does it run by itself?"};
}

}  // namespace

CadOutput::~CadOutput() {
  if (!bytes_.empty()) munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

Result<std::shared_ptr<CadOutput>> RunCadProgram(const std::string& path, const CadOptions& options,
                                                 const ImportProgress& progress) {
  const std::string program = FindProgram(options);
  if (program.empty())
    return Status{StatusCode::kUnavailable,
                  "'" + path +
                      "': CAD files are read by the program consac-cad, which is neither beside consac nor in "
                      "PATH; tools/setup.sh cad, then make build, makes it"};
  const int file = NamelessFile();
  if (file < 0) return Status{StatusCode::kResourceExhausted, "no temporary file can be made; set TMPDIR"};
  const std::shared_ptr<int> closed(new int(file), [](int* each) { close(*each), delete each; });
  Child child;
  if (!child.Start({program, path, NumberText(options.deflection * 1000.0), NumberText(options.angle),
                    NumberText(std::ceil(options.seconds)), NumberText(options.mebibytes)},
                   file))
    return Status{StatusCode::kUnavailable, "'" + program + "' cannot be started"};
  const auto until = Clock::now() + std::chrono::duration<double>(options.seconds);
  while (child.Listen()) {
    if (!Tell(child.Last("= "), progress)) return Status{StatusCode::kCancelled, "interrupted; nothing was written"};
    if (Clock::now() > until)
      return Status{StatusCode::kDeadlineExceeded, "'" + path + "': OpenCASCADE took more than " +
                                                       NumberText(options.seconds) +
                                                       " s; allow more by --cad-seconds, or simplify the assembly"};
  }
  const int status = child.status();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return Why(path, options, status, child.Last("! "));
  struct stat about {};
  if (fstat(file, &about) != 0 || about.st_size <= 0)
    return Status{StatusCode::kDataLoss, "'" + path + "': consac-cad wrote nothing; does it run by itself?"};
  const auto size = static_cast<std::size_t>(about.st_size);
  void* mapped = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
  if (mapped == MAP_FAILED) return Status{StatusCode::kResourceExhausted, "'" + path + "': no memory for its parts"};
  auto output = std::make_shared<CadOutput>();
  output->bytes_ = {static_cast<const std::byte*>(mapped), size};
  return output;
}

#endif

}  // namespace consac::twin
