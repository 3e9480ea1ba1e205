// --force: each change of what is said of the run that is set aside comes after what it says is on the disk.
#if defined(__linux__)
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <set>

#include "old_run.h"
#include "replaced_run.h"
#include "tests/support.h"

namespace consac::run {
namespace {

/// What a power cut would find.
struct Disk {
  bool watched = false;
  std::set<std::string> unsynced;  // folders in which something was renamed since they were synced
  std::string too_early;           // what was not on the disk when ".replaced*" was renamed
  int changes = 0;                 // of that name
};

Disk disk;

void Renamed(const std::string& from, const std::string& to) {
  const auto folder = [](const std::string& path) { return path.substr(0, path.rfind('/')); };
  if (from.substr(from.rfind('/') + 1).starts_with(".replaced")) {
    ++disk.changes;
    for (const std::string& unsynced : disk.unsynced)
      disk.too_early += std::filesystem::exists(unsynced) ? unsynced + " " : "";
  }
  disk.unsynced.insert(folder(from));
  disk.unsynced.insert(folder(to));
}

}  // namespace
}  // namespace consac::run

// In the place of the system's own, for this program.
extern "C" int rename(const char* from, const char* to) noexcept {
  const auto renamed = static_cast<int>(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
  if (renamed == 0 && consac::run::disk.watched) consac::run::Renamed(from, to);
  return renamed;
}

extern "C" int fsync(int descriptor) {
  if (consac::run::disk.watched) {
    std::error_code ignored;
    const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
    consac::run::disk.unsynced.erase(std::filesystem::read_symlink(link, ignored).string());
  }
  return static_cast<int>(syscall(SYS_fsync, descriptor));
}

namespace consac::run {
namespace {

void ExpectSynced(int changes, const char* when) {
  EXPECT_EQ(disk.too_early, "") << when;
  EXPECT_EQ(disk.changes, changes) << when;
  for (const std::string& folder : disk.unsynced) EXPECT_FALSE(std::filesystem::exists(folder)) << folder << when;
  disk = {true, {}, {}, 0};
}

TEST(ReplacedRun, IsOnTheDiskBeforeItIsSaidToBeAndAfter) {
  testing::ScratchFolder scratch("synced");
  const std::string run = OldRun(scratch.path()), path = scratch.path() + "/run";
  disk = {true, {}, {}, 0};
  EXPECT_TRUE(SetRunAside(path).ok());
  ExpectSynced(1, " set aside");
  for (const char* file : kNewFiles) Put(run + file, "new");
  EXPECT_TRUE(PutRunBack(path).ok());
  ExpectSynced(1, " put back");
  EXPECT_TRUE(SetRunAside(path).ok());
  ExpectSynced(1, " set aside again");
  EXPECT_TRUE(RemoveRunAside(path).ok());
  ExpectSynced(1, " removed");
  disk = {};
}

}  // namespace
}  // namespace consac::run
#endif
