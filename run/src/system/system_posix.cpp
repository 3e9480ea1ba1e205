#include "consac/run/output.h"
#include "system/system.h"

#if !defined(_WIN32)

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <string_view>

namespace consac::run {

bool UnderstandsEscapeCodes(std::FILE* stream) {
  const char* term = std::getenv("TERM");
  return ::isatty(::fileno(stream)) != 0 && term != nullptr && std::string_view(term) != "dumb";
}

int TerminalColumns(std::FILE* stream) {
  winsize size{};
  return ::ioctl(::fileno(stream), TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

bool TakesOutput(std::FILE* stream, double wait_s) {
  pollfd asked{::fileno(stream), POLLOUT, 0};
  return ::poll(&asked, 1, static_cast<int>(wait_s * 1e3)) > 0;
}

StandardErrorAside::StandardErrorAside() {
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere < 0) return;
  kept_ = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  if (kept_ >= 0) ::dup2(nowhere, STDERR_FILENO);
  ::close(nowhere);
}

StandardErrorAside::~StandardErrorAside() {
  if (kept_ < 0) return;
  ::dup2(kept_, STDERR_FILENO);
  ::close(kept_);
}

bool LetsNothingGo(const std::string& folder) {
#if defined(STATX_ATTR_APPEND)
  struct statx found {};
  return statx(AT_FDCWD, folder.c_str(), 0, 0, &found) == 0 && (found.stx_attributes & STATX_ATTR_APPEND) != 0;
#else
  (void)folder;
  return false;
#endif
}

void SyncFolder(const std::string& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  (void)fsync(descriptor);
  ::close(descriptor);
}

void Close(int descriptor) {
  ::close(descriptor);
}

Locked LockFile(const std::string& path, int* descriptor) {
  *descriptor = ::open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (*descriptor < 0) return Locked::kFailed;
  if (::flock(*descriptor, LOCK_EX | LOCK_NB) == 0) return Locked::kByUs;
  ::close(*descriptor);
  return Locked::kByOthers;
}

}  // namespace consac::run

#endif
