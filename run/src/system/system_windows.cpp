#include "consac/run/output.h"
#include "system/system.h"

#if defined(_WIN32)

#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <share.h>
#include <sys/stat.h>
#include <windows.h>

#include <algorithm>
#include <cerrno>
#include <climits>

#include "consac/base/file.h"

namespace consac::run {
namespace {

HANDLE ConsoleOf(std::FILE* stream) {
  return reinterpret_cast<HANDLE>(_get_osfhandle(_fileno(stream)));
}

}  // namespace

int ProcessId() {
  return _getpid();
}

std::string HostName() {
  char name[MAX_COMPUTERNAME_LENGTH + 1] = {};
  DWORD size = sizeof(name);
  return GetComputerNameA(name, &size) != 0 && size > 0 ? std::string(name, size) : "localhost";
}

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

// Others may read the file and take it away: a spreadsheet, TensorBoard.
int OpenToAppend(const std::string& path) {
  const int flags = _O_RDWR | _O_CREAT | _O_APPEND | _O_BINARY | _O_NOINHERIT;
  return _wsopen(WidePath(path).c_str(), flags, _SH_DENYNO, _S_IREAD | _S_IWRITE);
}

bool HasOtherNames(int descriptor) {
  BY_HANDLE_FILE_INFORMATION info{};
  const auto handle = reinterpret_cast<HANDLE>(_get_osfhandle(descriptor));
  return GetFileInformationByHandle(handle, &info) != 0 && info.nNumberOfLinks > 1;
}

std::int64_t WriteSome(int descriptor, const char* bytes, std::size_t count) {
  return _write(descriptor, bytes, static_cast<unsigned>(std::min<std::size_t>(count, INT_MAX)));
}

bool ReadAt(int descriptor, std::uint64_t position, char* bytes, std::size_t count) {
  return _lseeki64(descriptor, static_cast<std::int64_t>(position), SEEK_SET) >= 0 &&
         _read(descriptor, bytes, static_cast<unsigned>(count)) == static_cast<int>(count);
}

bool IsPipe(int) {
  return false;  // pipes have names of their own there
}

std::int64_t SizeOf(int descriptor) {
  return _filelengthi64(descriptor);
}

bool CutTo(int descriptor, std::uint64_t bytes) {
  return _chsize_s(descriptor, static_cast<std::int64_t>(bytes)) == 0;
}

bool LetsNothingGo(const std::string&) {
  return false;
}

void SyncFolder(const std::string&) {}  // NTFS keeps the order of renames

void Close(int descriptor) {
  _close(descriptor);
}

// A file that is open cannot be deleted there, nor can its folder.
bool IsStillAt(int, const std::string&) {
  return true;
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
