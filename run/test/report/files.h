#pragma once
// What the tests of reports share: a folder of their own, a clock that they set, and a limit.

#include "consac/base/hooks.h"
#include "tests/files.h"
#include "tests/folder.h"

namespace consac::run {

using testing::Put;
using testing::TestFolder;
using testing::TextOf;
#if !defined(_WIN32)
using testing::FileSizeLimit;
#endif

/// Time stands still until the test moves it.
class FakeClock {
 public:
  FakeClock() {
    Hooks hooks;
    hooks.now = [](void* user) { return static_cast<FakeClock*>(user)->now; };
    hooks.user = this;
    SetHooks(hooks);
  }
  ~FakeClock() { SetHooks({}); }
  FakeClock(const FakeClock&) = delete;
  FakeClock& operator=(const FakeClock&) = delete;
  double now = 1000.0;  ///< seconds
};

}  // namespace consac::run
