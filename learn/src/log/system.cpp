#include "log/system.h"

#include <cerrno>

#if defined(_WIN32)
#include <direct.h>
#include <fcntl.h>
#include <io.h>
#include <share.h>
#include <sys/stat.h>
#include <windows.h>

#include <algorithm>
#include <climits>

#include "consac/base/file.h"
#else
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace consac::learn {

#if defined(_WIN32)
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

bool IsPipe(int) {
  return false;  // pipes have names of their own there
}

std::int64_t WriteSome(int descriptor, const char* bytes, std::size_t count) {
  return _write(descriptor, bytes, static_cast<unsigned>((std::min<std::size_t>)(count, INT_MAX)));
}

bool ReadAt(int descriptor, std::uint64_t position, char* bytes, std::size_t count) {
  return _lseeki64(descriptor, static_cast<std::int64_t>(position), SEEK_SET) >= 0 &&
         _read(descriptor, bytes, static_cast<unsigned>(count)) == static_cast<int>(count);
}

std::int64_t BytesIn(int descriptor) {
  return _filelengthi64(descriptor);
}

bool CutTo(int descriptor, std::uint64_t bytes) {
  return _chsize_s(descriptor, static_cast<std::int64_t>(bytes)) == 0;
}

void CloseDescriptor(int descriptor) {
  _close(descriptor);
}

void RemoveFile(const std::string& path) {
  _wremove(WidePath(path).c_str());
}

FolderMade MakeFolder(const std::string& path) {
  if (_wmkdir(WidePath(path).c_str()) == 0) return FolderMade::kNew;
  return errno == EEXIST ? FolderMade::kThereAlready : FolderMade::kFailed;
}

std::string HostName() {
  char name[MAX_COMPUTERNAME_LENGTH + 1] = {};
  DWORD size = sizeof(name);
  return GetComputerNameA(name, &size) != 0 && size > 0 ? std::string(name, size) : "localhost";
}
#else
int OpenToAppend(const std::string& path) {
  return open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0644);
}

bool HasOtherNames(int descriptor) {
  struct stat info {};
  return fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode) && info.st_nlink > 1;
}

bool IsPipe(int descriptor) {
  struct stat info {};
  return fstat(descriptor, &info) == 0 && S_ISFIFO(info.st_mode);
}

std::int64_t WriteSome(int descriptor, const char* bytes, std::size_t count) {
  return write(descriptor, bytes, count);
}

bool ReadAt(int descriptor, std::uint64_t position, char* bytes, std::size_t count) {
  return pread(descriptor, bytes, count, static_cast<off_t>(position)) == static_cast<ssize_t>(count);
}

std::int64_t BytesIn(int descriptor) {
  struct stat info {};
  return fstat(descriptor, &info) == 0 ? static_cast<std::int64_t>(info.st_size) : -1;
}

bool CutTo(int descriptor, std::uint64_t bytes) {
  return ftruncate(descriptor, static_cast<off_t>(bytes)) == 0;
}

void CloseDescriptor(int descriptor) {
  close(descriptor);
}

void RemoveFile(const std::string& path) {
  (void)unlink(path.c_str());
}

FolderMade MakeFolder(const std::string& path) {
  if (mkdir(path.c_str(), 0777) == 0) return FolderMade::kNew;
  return errno == EEXIST ? FolderMade::kThereAlready : FolderMade::kFailed;
}

std::string HostName() {
  char name[256] = {};
  return gethostname(name, sizeof(name) - 1) == 0 && name[0] != '\0' ? name : "localhost";
}
#endif

}  // namespace consac::learn
