#pragma once
// Whole files in and out, safely: a write goes to a temporary file in the same folder, is synced and renamed, so a
// kill or a full disk never leaves half a file under the final name and never harms the file that was there. Paths are
// UTF-8 on every system.

#include <cstddef>
#include <cstdio>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"

namespace consac {

/// The file's bytes; kNotFound, kDataLoss (unreadable) or kResourceExhausted (larger than `limit_bytes`).
Result<std::vector<std::byte>> ReadFile(const std::string& path, std::size_t limit_bytes = std::size_t{1} << 31);
/// The same, but what is no regular file is refused (kInvalidArgument): a pipe would be waited for, a device may never
/// end.
Result<std::vector<std::byte>> ReadRegularFile(const std::string& path, std::size_t limit_bytes = std::size_t{1} << 31);
/// Number of this process, which the names of temporary files hold.
int ProcessId();
/// Whether `path` still names the file that was opened as `descriptor`: not deleted, not replaced. Always on Windows,
/// where an open file can be neither, nor can its folder.
bool IsStillAt(int descriptor, const std::string& path);
/// Asked before anything is written into a folder that is open already: whether it is the right one. A path may name
/// another one by now; what is opened stays the same.
using FolderCheck = std::function<Status()>;
/// An opened folder: the same one wherever it is moved. On Windows it is what stands under its path; a folder with an
/// open file in it is not moved there.
class Folder {
 public:
  /// None yet.
  Folder() = default;
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  /// Opens the folder and then asks `is_ours`: its error, or kDataLoss or kResourceExhausted where it cannot be opened.
  Status Open(const std::string& path, const FolderCheck& is_ours);
  /// Removes a file in it, if that can be done.
  void Remove(const std::string& name) const;

 private:
  friend class AtomicFile;
  std::FILE* Create(const std::string& name) const;
  bool Rename(const std::string& from, const std::string& to) const;
  void Sync() const;
  Status OpenUnasked(const std::string& path);
  void Close();

  std::string path_;
  [[maybe_unused]] int folder_ = -1;  // not on Windows
};
/// Writes `bytes` under `path` by temporary file, sync and rename. kResourceExhausted when the disk is full,
/// kDataLoss when it cannot be written, or `path` is no regular file. An error of `may_write` ends it with nothing
/// written.
Status WriteFileAtomically(const std::string& path, std::span<const std::byte> bytes,
                           const FolderCheck& may_write = {});
/// A file that is written piece by piece in the same way: what has not been committed leaves nothing behind.
class AtomicFile {
 public:
  /// Nothing yet.
  AtomicFile() = default;
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  /// Begins a file that will stand under `path`. Errors as WriteFileAtomically, here and below.
  Status Open(const std::string& path, const FolderCheck& may_write = {});
  /// Appends; after a failure nothing further is written and Commit tells it again.
  Status Write(std::span<const std::byte> bytes);
  /// Syncs and renames.
  Status Commit();

 private:
  void Drop();

  std::string path_, name_, temporary_;  // the latter two in the folder
  Folder folder_;
  std::FILE* file_ = nullptr;
  Status status_;
};
/// A regular file that is read piece by piece.
class FileReader {
 public:
  /// Nothing yet.
  FileReader() = default;
  ~FileReader();
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;
  /// Begins at the file's start. Errors as ReadRegularFile.
  Status Open(const std::string& path);
  /// The next bytes.size() bytes; kDataLoss where there are fewer.
  Status Read(std::span<std::byte> bytes);
  /// Whether the latest failure was the system's, or the file no regular one: what it holds may be whole. False where
  /// there is no such file and where it ends too early.
  bool refused() const { return refused_; }

 private:
  std::string path_;
  std::FILE* file_ = nullptr;
  bool refused_ = false;
};
#if defined(_WIN32)
/// A path as Windows takes it.
std::wstring WidePath(std::string_view path);
#endif

}  // namespace consac
