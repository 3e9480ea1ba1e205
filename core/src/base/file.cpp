#include "consac/base/file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

#if defined(_WIN32)
#include <io.h>
#include <process.h>
#include <sys/stat.h>
#include <windows.h>

#include <cwchar>
#else
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

namespace consac {
namespace {

Status FileError(const char* action, const std::string& path, int error) {
  bool full = error == ENOSPC || error == EFBIG || error == EMFILE || error == ENFILE || error == ENOMEM;
#if defined(EDQUOT)
  full = full || error == EDQUOT;
#endif
  const StatusCode code = error == ENOENT ? StatusCode::kNotFound
                          : full          ? StatusCode::kResourceExhausted
                                          : StatusCode::kDataLoss;
  return {code, std::string("cannot ") + action + " '" + path + "': " + std::strerror(error)};
}

// Of a file that is to be written: a folder that is not there is no unknown name.
Status WriteError(const char* action, const std::string& path, int error) {
  const Status status = FileError(action, path, error);
  return status.code() == StatusCode::kNotFound ? Status(StatusCode::kDataLoss, status.message()) : status;
}

std::FILE* OpenFile(const std::string& path, const char* mode) {
#if defined(_WIN32)
  return _wfopen(WidePath(path).c_str(), WidePath(mode).c_str());
#else
  return std::fopen(path.c_str(), mode);
#endif
}

// Of a regular file; 0 of any other.
std::uint64_t LengthOf(std::FILE* file) {
#if defined(_WIN32)
  struct _stat64 what;
  const bool known = _fstat64(_fileno(file), &what) == 0 && (what.st_mode & _S_IFREG) != 0;
#else
  struct stat what;
  const bool known = fstat(fileno(file), &what) == 0 && S_ISREG(what.st_mode);
#endif
  return known ? static_cast<std::uint64_t>(what.st_size) : 0;
}

bool SyncFile(std::FILE* file) {
#if defined(_WIN32)
  return _commit(_fileno(file)) == 0;
#else
  return fsync(fileno(file)) == 0;
#endif
}

// A rename would put a file in the place of a device.
bool IsSpecial(const std::string& path) {
#if defined(_WIN32)
  // NUL and COM1 are in every folder.
  const HANDLE handle = CreateFileW(WidePath(path).c_str(), 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE,
                                    nullptr, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr);
  if (handle == INVALID_HANDLE_VALUE) return false;
  const bool special = GetFileType(handle) != FILE_TYPE_DISK;
  CloseHandle(handle);
  return special;
#else
  struct stat what;
  return stat(path.c_str(), &what) == 0 && !S_ISREG(what.st_mode);
#endif
}

// Of the folder that `path` lies in, with its last '/'; "" where it names none.
std::string FolderPart(const std::string& path) {
#if defined(_WIN32)
  const std::size_t slash = path.find_last_of("/\\");
#else
  const std::size_t slash = path.rfind('/');
#endif
  return path.substr(0, slash == std::string::npos ? 0 : slash + 1);
}

}  // namespace

int ProcessId() {
#if defined(_WIN32)
  return _getpid();
#else
  return static_cast<int>(getpid());
#endif
}

#if defined(_WIN32)
bool IsStillAt(int, const std::string&) {
  return true;
}
#else
bool IsStillAt(int descriptor, const std::string& path) {
  struct stat opened {
  }, found{};
  return fstat(descriptor, &opened) == 0 && stat(path.c_str(), &found) == 0 && opened.st_dev == found.st_dev &&
         opened.st_ino == found.st_ino;
}
#endif

#if defined(_WIN32)
std::wstring WidePath(std::string_view path) {
  const int length = static_cast<int>(path.size());
  std::wstring wide(path.size(), L'\0');  // never more of them than of UTF-8's
  wide.resize(static_cast<std::size_t>(
      length == 0 ? 0 : MultiByteToWideChar(CP_UTF8, 0, path.data(), length, wide.data(), length)));
  return wide;
}
#endif

Result<std::vector<std::byte>> ReadRegularFile(const std::string& path, std::size_t limit_bytes) {
  if (IsSpecial(path)) return Status{StatusCode::kInvalidArgument, "'" + path + "' is no regular file; take it away"};
  return ReadFile(path, limit_bytes);
}

Result<std::vector<std::byte>> ReadFile(const std::string& path, std::size_t limit_bytes) {
  std::FILE* file = OpenFile(path, "rb");
  if (file == nullptr) return FileError("open", path, errno);
  const auto too_long = [&] {
    std::fclose(file);
    return Status{StatusCode::kResourceExhausted,
                  "'" + path + "' is longer than the " + std::to_string(limit_bytes) + " bytes that are read"};
  };
  const std::uint64_t size = LengthOf(file);  // 0 where it has none
  if (size > limit_bytes) return too_long();
  std::vector<std::byte> bytes;
  bytes.reserve(static_cast<std::size_t>(size));
  std::byte chunk[16384];  // a main thread's stack may be small
  std::size_t count = 0;
  while ((count = std::fread(chunk, 1, sizeof(chunk), file)) > 0) {
    if (bytes.size() + count > limit_bytes) return too_long();
    bytes.insert(bytes.end(), chunk, chunk + count);
  }
  const bool failed = std::ferror(file) != 0;
  const int error = errno;
  std::fclose(file);
  if (failed) return FileError("read", path, error);
  return bytes;
}

FileReader::~FileReader() {
  if (file_ != nullptr) std::fclose(file_);
}

Status FileReader::Open(const std::string& path) {
  if (file_ != nullptr) std::fclose(file_);
  file_ = nullptr;
  path_ = path;
  refused_ = IsSpecial(path);
  if (refused_) return {StatusCode::kInvalidArgument, "'" + path + "' is no regular file; take it away"};
  file_ = OpenFile(path, "rb");
  if (file_ != nullptr) return Status::Ok();
  const int error = errno;
  refused_ = error != ENOENT;
  return FileError("open", path, error);
}

Status FileReader::Read(std::span<std::byte> bytes) {
  errno = 0;
  if (file_ != nullptr && std::fread(bytes.data(), 1, bytes.size(), file_) == bytes.size()) return Status::Ok();
  refused_ = file_ != nullptr && std::ferror(file_) != 0;
  if (refused_) return FileError("read", path_, errno);
  return {StatusCode::kDataLoss, "'" + path_ + "' ends too early"};
}

Folder::~Folder() {
  Close();
}

// Opened before the check: it is of this folder then, whatever takes its place.
Status Folder::Open(const std::string& path, const FolderCheck& is_ours) {
  CONSAC_RETURN_IF_ERROR(OpenUnasked(path));
  return is_ours ? is_ours() : Status::Ok();
}

#if defined(_WIN32)
Status Folder::OpenUnasked(const std::string& path) {
  path_ = path.empty() || path.ends_with('/') || path.ends_with('\\') ? path : path + "/";
  return Status::Ok();
}

void Folder::Close() {}

void Folder::Remove(const std::string& name) const {
  _wremove(WidePath(path_ + name).c_str());
}

std::FILE* Folder::Create(const std::string& name) const {
  return OpenFile(path_ + name, "wb");
}

bool Folder::Rename(const std::string& from, const std::string& to) const {
  // A file that somebody reads cannot be replaced there: an engine that loads the model is done in a moment.
  const std::wstring source = WidePath(path_ + from), target = WidePath(path_ + to);
  for (int tries = 0; tries < 100; ++tries) {
    if (MoveFileExW(source.c_str(), target.c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH)) return true;
    const DWORD error = GetLastError();
    errno = error == ERROR_DISK_FULL                                         ? ENOSPC
            : error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND ? ENOENT
                                                                             : EACCES;
    if (error != ERROR_SHARING_VIOLATION && error != ERROR_ACCESS_DENIED) break;
    Sleep(10);
  }
  return false;
}

void Folder::Sync() const {}
#else
Status Folder::OpenUnasked(const std::string& path) {
  Close();
  path_ = path.empty() ? "." : path;
  folder_ = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
#if defined(O_PATH)
  // Into a folder that may not be listed files can be put.
  if (folder_ < 0 && errno == EACCES) folder_ = open(path_.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
#endif
  return folder_ < 0 ? WriteError("open folder", path_, errno) : Status::Ok();
}

void Folder::Close() {
  if (folder_ >= 0) close(folder_);
  folder_ = -1;
}

void Folder::Remove(const std::string& name) const {
  (void)unlinkat(folder_, name.c_str(), 0);
}

std::FILE* Folder::Create(const std::string& name) const {
  const int descriptor = openat(folder_, name.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  std::FILE* const file = descriptor < 0 ? nullptr : fdopen(descriptor, "wb");
  if (file != nullptr || descriptor < 0) return file;
  const int error = errno;
  close(descriptor);
  Remove(name);
  errno = error;
  return nullptr;
}

bool Folder::Rename(const std::string& from, const std::string& to) const {
  return renameat(folder_, from.c_str(), folder_, to.c_str()) == 0;
}

// After a rename only the folder's own sync makes the new name survive a power cut.
void Folder::Sync() const {
  (void)fsync(folder_);
}
#endif

AtomicFile::~AtomicFile() {
  Drop();
}

void AtomicFile::Drop() {
  if (file_ == nullptr) return;
  std::fclose(file_);
  file_ = nullptr;
  folder_.Remove(temporary_);
}

Status AtomicFile::Open(const std::string& path, const FolderCheck& may_write) {
  Drop();
  path_ = path;
  if (IsSpecial(path)) {
    return status_ = {StatusCode::kDataLoss,
                      "'" + path + "' is no regular file and is not replaced; take it away, or name another"};
  }
  const std::string folder = FolderPart(path);
  name_ = path.substr(folder.size());
  temporary_ = name_ + ".tmp-" + std::to_string(ProcessId());
  status_ = folder_.OpenUnasked(folder);
  if (!status_.ok()) return status_ = {status_.code(), "cannot write '" + path + "': " + status_.message()};
  if (may_write) status_ = may_write();  // from here on it stays the folder that is asked of
  if (!status_.ok()) return status_;
  file_ = folder_.Create(temporary_);
  return status_ = file_ == nullptr ? WriteError("create", folder + temporary_, errno) : Status::Ok();
}

Status AtomicFile::Write(std::span<const std::byte> bytes) {
  if (file_ == nullptr) return status_;
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) == bytes.size()) return status_;
  status_ = WriteError("write", path_, errno);
  Drop();
  return status_;
}

Status AtomicFile::Commit() {
  if (file_ == nullptr) return status_;
  errno = 0;
  const bool written = std::fflush(file_) == 0 && SyncFile(file_);
  const int write_error = errno;
  const bool closed = std::fclose(file_) == 0;
  file_ = nullptr;
  if (!written || !closed) {
    const int error = written ? errno : write_error;
    folder_.Remove(temporary_);
    return status_ = WriteError("write", path_, error);
  }
  if (!folder_.Rename(temporary_, name_)) {
    const int error = errno;
    folder_.Remove(temporary_);
    return status_ = WriteError("rename onto", path_, error);
  }
  folder_.Sync();
  return status_;
}

Status WriteFileAtomically(const std::string& path, std::span<const std::byte> bytes, const FolderCheck& may_write) {
  AtomicFile file;
  CONSAC_RETURN_IF_ERROR(file.Open(path, may_write));
  CONSAC_RETURN_IF_ERROR(file.Write(bytes));
  return file.Commit();
}

}  // namespace consac
