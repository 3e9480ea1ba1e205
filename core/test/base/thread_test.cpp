#include "consac/base/thread.h"

#include <gtest/gtest.h>

#if defined(__GLIBC__)
#include <pthread.h>
#endif

namespace consac {
namespace {

/// Touches so many kibibytes of the stack; how many times 64 there were.
int TouchStack(int kibibytes) {
  volatile char room[64 << 10];
  room[0] = 1;
  room[sizeof(room) - 1] = 1;
  return kibibytes <= 64 ? room[0] : TouchStack(kibibytes - 64) + room[0];
}

// macOS has 512 KiB for a thread unless asked, Windows what the program's file says; Linux is made to here.
TEST(Thread, HasTheSameStackEverywhere) {
#if defined(__GLIBC__)
  pthread_attr_t before, small;
  ASSERT_EQ(pthread_getattr_default_np(&before), 0);
  ASSERT_EQ(pthread_getattr_default_np(&small), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&small, 512 << 10), 0);
  ASSERT_EQ(pthread_setattr_default_np(&small), 0);
#endif
  int touched = 0;
  Thread thread;
  const Status status = thread.Start([&touched] { touched = TouchStack(4096); });
#if defined(__GLIBC__)
  ASSERT_EQ(pthread_setattr_default_np(&before), 0);
#endif
  ASSERT_TRUE(status.ok()) << status.message();
  thread.Join();
  EXPECT_EQ(touched, 64);
}

}  // namespace
}  // namespace consac
