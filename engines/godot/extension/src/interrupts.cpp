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
int watchers = 0;

#ifdef _WIN32

// The system calls it on a thread of its own. The second one is not taken, so it ends the program.
BOOL WINAPI Note(DWORD) {
  return interrupted.exchange(true) ? FALSE : TRUE;
}

#else

constexpr int kSignals[] = {SIGINT, SIGTERM};
std::atomic<bool> ours[2] = {false, false};  // where nobody else had asked for them

// The second one, whichever of them, ends the program.
void Note(int) {
  interrupted.store(true);
  for (int i = 0; i < 2; ++i)
    if (ours[i].exchange(false)) std::signal(kSignals[i], SIG_DFL);
}

#endif

void Release() {
#ifdef _WIN32
  SetConsoleCtrlHandler(&Note, FALSE);
#else
  for (int i = 0; i < 2; ++i)
    if (ours[i].exchange(false)) std::signal(kSignals[i], SIG_DFL);
#endif
}

}  // namespace

void CatchInterrupts() {
  if (watchers++ > 0) return;
  interrupted.store(false);
#ifdef _WIN32
  SetConsoleCtrlHandler(&Note, TRUE);
#else
  for (int i = 0; i < 2; ++i) {
    struct sigaction before {};
    if (sigaction(kSignals[i], nullptr, &before) != 0 || before.sa_handler != SIG_DFL) continue;
    struct sigaction note {};
    note.sa_handler = &Note;
    note.sa_flags = SA_RESTART;
    ours[i].store(true);
    if (sigaction(kSignals[i], &note, nullptr) != 0) ours[i].store(false);
  }
#endif
}

bool Interrupted() {
  return interrupted.load();
}

void ForgetInterrupts() {
  if (watchers > 0 && --watchers == 0) Release();
}

void EndInterrupts() {
  if (watchers > 0) Release();
  watchers = 0;
}

}  // namespace consac::godot
