#include "consac/base/thread.h"

#include <cstring>

#if defined(_WIN32)
#include <process.h>
#include <windows.h>

#include <cerrno>
#include <cstdint>
#else
#include <pthread.h>
#endif

namespace consac {
namespace {

/// As Linux gives unless told otherwise. Unless asked, macOS gives 512 KiB and Windows what the program's file says.
/// Address space: only what is touched of it takes memory.
constexpr std::size_t kStackBytes = std::size_t{8} << 20;

Status NoThread(int error) {
  return {StatusCode::kResourceExhausted, std::string("cannot start a thread: ") + std::strerror(error) +
                                              "; end other programs, or raise the limits of processes and of memory"};
}

#if defined(_WIN32)
using ThreadHandle = std::uintptr_t;

unsigned __stdcall RunThreadBody(void* body) {
  (*static_cast<std::function<void()>*>(body))();
  return 0;
}
#else
using ThreadHandle = pthread_t;

void* RunThreadBody(void* body) {
  (*static_cast<std::function<void()>*>(body))();
  return nullptr;
}
#endif

}  // namespace

Status Thread::Start(std::function<void()> body) {
  static_assert(sizeof(ThreadHandle) <= sizeof(handle_));
  if (started_) return {StatusCode::kFailedPrecondition, "a thread runs already; wait for it first"};
  body_ = std::move(body);
  ThreadHandle handle{};
#if defined(_WIN32)
  handle = _beginthreadex(nullptr, static_cast<unsigned>(kStackBytes), RunThreadBody, &body_,
                          STACK_SIZE_PARAM_IS_A_RESERVATION, nullptr);
  const int error = handle == 0 ? errno : 0;
#else
  pthread_attr_t attributes;
  int error = pthread_attr_init(&attributes);
  if (error == 0) {
    (void)pthread_attr_setstacksize(&attributes, kStackBytes);
    error = pthread_create(&handle, &attributes, RunThreadBody, &body_);
    (void)pthread_attr_destroy(&attributes);
  }
#endif
  if (error != 0) {
    body_ = nullptr;  // with what it holds
    return NoThread(error);
  }
  std::memcpy(handle_, &handle, sizeof(handle));
  started_ = true;
  return Status::Ok();
}

void Thread::Join() {
  if (!started_) return;
  ThreadHandle handle{};
  std::memcpy(&handle, handle_, sizeof(handle));
#if defined(_WIN32)
  (void)WaitForSingleObject(reinterpret_cast<HANDLE>(handle), INFINITE);
  (void)CloseHandle(reinterpret_cast<HANDLE>(handle));
#else
  (void)pthread_join(handle, nullptr);
#endif
  started_ = false;
  body_ = nullptr;
}

}  // namespace consac
