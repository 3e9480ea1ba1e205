#include "interrupts.h"

#include <atomic>
#include <csignal>

#ifdef _WIN32
#include <windows.h>
#endif

namespace consac::godot {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler takes no lock");
bool catching = false;

#ifdef _WIN32

// The system calls it on a thread of its own. The second one is not taken, so it ends the program.
BOOL WINAPI Note(DWORD) {
  return interrupted.exchange(true) ? FALSE : TRUE;
}

#else

constexpr int kSignals[] = {SIGINT, SIGTERM};
struct sigaction before[2];
bool ours[2] = {false, false};

void Note(int) {
  interrupted.store(true);
}

#endif

}  // namespace

void CatchInterrupts() {
  if (catching) return;
  catching = true;
  interrupted.store(false);
#ifdef _WIN32
  SetConsoleCtrlHandler(&Note, TRUE);
#else
  for (int i = 0; i < 2; ++i) {
    if (sigaction(kSignals[i], nullptr, &before[i]) != 0 || before[i].sa_handler != SIG_DFL) continue;
    struct sigaction note {};
    note.sa_handler = &Note;
    note.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);  // the second one ends the program
    ours[i] = sigaction(kSignals[i], &note, nullptr) == 0;
  }
#endif
}

bool Interrupted() {
  return interrupted.load();
}

void ForgetInterrupts() {
  if (!catching) return;
  catching = false;
#ifdef _WIN32
  SetConsoleCtrlHandler(&Note, FALSE);
#else
  for (int i = 0; i < 2; ++i) {
    if (ours[i]) sigaction(kSignals[i], &before[i], nullptr);
    ours[i] = false;
  }
#endif
}

}  // namespace consac::godot
