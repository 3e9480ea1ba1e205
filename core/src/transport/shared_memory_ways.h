#pragma once
// The rows of SharedMemoryWays(), one a file. A file holds nothing where its system is not; that is decided here, so
// that whoever compiles all files of the folder (an engine's build does) gets the right ones. Private to core.

#include "transport/shared_memory.h"

#if defined(_WIN32)
#define CONSAC_SHARED_SECTION 1
#else
#define CONSAC_SHARED_SECTION 0
#endif

#if defined(__linux__)
#define CONSAC_SHARED_MEMFD 1
#else
#define CONSAC_SHARED_MEMFD 0
#endif

// Linux has it too, and tests it. Android has no shm_open.
#if (defined(__unix__) || defined(__APPLE__)) && !defined(__ANDROID__)
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
