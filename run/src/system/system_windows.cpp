#include "consac/run/output.h"
#include "system/system.h"

#if defined(_WIN32)

#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <share.h>
#include <sys/stat.h>
#include <windows.h>

#include <cerrno>

#include "consac/base/file.h"

namespace consac::run {
namespace {

HANDLE ConsoleOf(std::FILE* stream) {
  return reinterpret_cast<HANDLE>(_get_osfhandle(_fileno(stream)));
}

}  // namespace

bool UnderstandsEscapeCodes(std::FILE* stream) {
  DWORD mode = 0;
  return GetConsoleMode(ConsoleOf(stream), &mode) != 0 &&
         SetConsoleMode(ConsoleOf(stream), mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0;
}

int TerminalColumns(std::FILE* stream) {
  CONSOLE_SCREEN_BUFFER_INFO info{};
  return GetConsoleScreenBufferInfo(ConsoleOf(stream), &info) != 0 ? info.srWindow.Right - info.srWindow.Left + 1 : 0;
}

bool TakesOutput(std::FILE*, double) {
  return true;
}

// Nothing that is used here talks there.
StandardErrorAside::StandardErrorAside() = default;
StandardErrorAside::~StandardErrorAside() = default;

bool LetsNothingGo(const std::string&) {
  return false;
}

void SyncFolder(const std::string&) {}  // NTFS keeps the order of renames

void Close(int descriptor) {
  _close(descriptor);
}

// Nobody else may open it while it is open here.
Locked LockFile(const std::string& path, int* descriptor) {
  const std::wstring wide = WidePath(path);
  for (int tries = 0; tries < 10; ++tries) {  // a virus scanner looks at a new file for a moment
    *descriptor = _wsopen(wide.c_str(), _O_RDWR | _O_CREAT | _O_NOINHERIT, _SH_DENYRW, _S_IREAD | _S_IWRITE);
    if (*descriptor >= 0 || _doserrno != ERROR_SHARING_VIOLATION) break;
    Sleep(20);
  }
  if (*descriptor >= 0) return Locked::kByUs;
  return _doserrno == ERROR_SHARING_VIOLATION ? Locked::kByOthers : Locked::kFailed;
}

}  // namespace consac::run

#endif
