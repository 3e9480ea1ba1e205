#pragma once
// System calls of Linux by number. Unreal's compilers for Linux bring the headers of glibc 2.17, older than these calls
// and their constants; the kernel beneath knows them, or answers ENOSYS. Private to core.

#if defined(__linux__)

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#if !defined(SYS_getrandom) && defined(__x86_64__)
#define SYS_getrandom 318
#elif !defined(SYS_getrandom) && defined(__aarch64__)
#define SYS_getrandom 278
#endif
#if !defined(SYS_memfd_create) && defined(__x86_64__)
#define SYS_memfd_create 319
#elif !defined(SYS_memfd_create) && defined(__aarch64__)
#define SYS_memfd_create 279
#endif

#if !defined(MFD_CLOEXEC)
#define MFD_CLOEXEC 1U
#define MFD_ALLOW_SEALING 2U
#endif
#if !defined(F_ADD_SEALS)
#define F_ADD_SEALS 1033
#define F_GET_SEALS 1034
#define F_SEAL_SEAL 1
#define F_SEAL_SHRINK 2
#define F_SEAL_GROW 4
#endif

#endif
