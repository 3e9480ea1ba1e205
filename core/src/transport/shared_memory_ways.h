#pragma once
// The rows of SharedMemoryWays(), one a file. A file holds nothing where its system is not; that is decided here, so
// that whoever compiles all files of the folder (an engine's build does) gets the right ones. Private to core.

#include <cstdlib>  // glibc's version

#include "base/linux_calls.h"
#include "transport/shared_memory.h"

#if defined(_WIN32)
#define CONSAC_SHARED_SECTION 1
#else
#define CONSAC_SHARED_SECTION 0
#endif

#if defined(__linux__) && defined(SYS_memfd_create)
#define CONSAC_SHARED_MEMFD 1
#else
#define CONSAC_SHARED_MEMFD 0
#endif

// Linux has it too, and tests it. Android has no shm_open; glibc before 2.34 has it in a library of its own, which an
// engine's build does not link.
#if defined(__GLIBC__)
#define CONSAC_SHM_OPEN_NEEDS_LIBRARY !__GLIBC_PREREQ(2, 34)
#else
#define CONSAC_SHM_OPEN_NEEDS_LIBRARY 0
#endif
#if (defined(__unix__) || defined(__APPLE__)) && !defined(__ANDROID__) && !CONSAC_SHM_OPEN_NEEDS_LIBRARY
#define CONSAC_SHARED_POSIX 1
#else
#define CONSAC_SHARED_POSIX 0
#endif

namespace consac {

#if CONSAC_SHARED_MEMFD
extern const SharedMemoryWay kMemfdWay;
#endif
#if CONSAC_SHARED_POSIX
extern const SharedMemoryWay kPosixWay;
#endif
#if CONSAC_SHARED_SECTION
extern const SharedMemoryWay kSectionWay;
#endif

}  // namespace consac
