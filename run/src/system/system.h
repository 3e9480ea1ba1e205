#pragma once
// What a run asks of the operating system, the same on Linux (system_posix.cpp) and on Windows (system_windows.cpp).

#include <cstdint>
#include <cstdio>
#include <string>

namespace consac::run {

/// Whether `stream` is shown by a terminal that redraws a line on escape codes; makes it do so where it must be asked.
bool UnderstandsEscapeCodes(std::FILE* stream);
/// Characters beside each other on the terminal that shows `stream`; 0 when none does.
int TerminalColumns(std::FILE* stream);

/// What this process writes to standard error goes nowhere while this lives: for a library that talks there.
class StandardErrorAside {
 public:
  StandardErrorAside();
  ~StandardErrorAside();
  StandardErrorAside(const StandardErrorAside&) = delete;
  StandardErrorAside& operator=(const StandardErrorAside&) = delete;

 private:
  int kept_ = -1;
};

/// Whether nothing can be removed from the folder, or renamed out of it, though something may be put there: Linux's
/// append-only attribute.
bool LetsNothingGo(const std::string& folder);
/// What was renamed in the folder survives a power cut from now on; nothing where it cannot be done.
void SyncFolder(const std::string& folder);
/// Gives a lock back.
void Close(int descriptor);

/// What became of a wish for a lock.
enum class Locked : std::uint8_t { kByUs, kByOthers, kFailed };
/// Makes the file `path` and keeps every other process from locking it, until Close(*descriptor) or the end of this
/// process. errno says why with kFailed.
Locked LockFile(const std::string& path, int* descriptor);

}  // namespace consac::run
