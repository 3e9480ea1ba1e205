# Toolchain: 64-bit Windows programs from Linux, with Debian's mingw-w64. tools/windows.sh uses it and puts what CONSAC
# stands on into CONSAC_WINDOWS_PREFIX.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)

# GCC aligns stacks to 16 bytes on Windows, yet spills vectors of 32 and 64 with aligned moves (GCC bug 54412): the
# assembler makes them unaligned ones. Templates need more sections than the old object format has.
set(CMAKE_C_FLAGS_INIT "-Wa,-muse-unaligned-vector-move")
set(CMAKE_CXX_FLAGS_INIT "-Wa,-muse-unaligned-vector-move -Wa,-mbig-obj")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")  # a program without libraries beside it

set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES CONSAC_WINDOWS_PREFIX)
set(CMAKE_FIND_ROOT_PATH ${CONSAC_WINDOWS_PREFIX} /usr/x86_64-w64-mingw32)  # the first has no library but static ones
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} ${CONSAC_WINDOWS_PREFIX}/lib/pkgconfig)
set(PKG_CONFIG_ARGN --static)  # also what a static library stands on
set(CMAKE_GTEST_DISCOVER_TESTS_DISCOVERY_MODE PRE_TEST)  # the programs do not run while they are built
