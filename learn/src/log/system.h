#pragma once
// What logs ask of the operating system, the same on every one: of an open file by its number, of folders and names.
// Private to learn.

#include <cstddef>
#include <cstdint>
#include <string>

namespace consac::learn {

/// Opens a file for reading and for writing at its end, making it where it is not. -1 and errno when that fails;
/// a link is not followed (ELOOP; Windows does).
int OpenToAppend(const std::string& path);
/// Whether an open file has another name (a hard link), and so may be somebody else's too.
bool HasOtherNames(int descriptor);
/// Whether it is a pipe, which keeps nothing and stops whoever fills it.
bool IsPipe(int descriptor);
/// Writes some of `bytes` at the end; how many, or -1 and errno.
std::int64_t WriteSome(int descriptor, const char* bytes, std::size_t count);
/// Reads the `count` bytes from `position` on; false where it gets less.
bool ReadAt(int descriptor, std::uint64_t position, char* bytes, std::size_t count);
/// Bytes in the file, or -1 and errno.
std::int64_t BytesIn(int descriptor);
/// Cuts the file to `bytes`.
bool CutTo(int descriptor, std::uint64_t bytes);
/// Gives the file back.
void CloseDescriptor(int descriptor);

/// Removes a file, if that can be done.
void RemoveFile(const std::string& path);
/// What became of a folder that was to be made.
enum class FolderMade : std::uint8_t { kNew, kThereAlready, kFailed };
/// Makes a folder in one that is there. errno says why with kFailed.
FolderMade MakeFolder(const std::string& path);
/// Name of this machine; "localhost" where it has none.
std::string HostName();

}  // namespace consac::learn
