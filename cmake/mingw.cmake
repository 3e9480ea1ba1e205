# Toolchain: 64-bit Windows programs from Linux, with Debian's mingw-w64. tools/cross.sh uses it and puts what CONSAC
# stands on into CONSAC_CROSS_PREFIX.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)

# GCC aligns stacks to 16 bytes on Windows, yet spills vectors of 32 and 64 with aligned moves (GCC bug 54412): the
# assembler makes them unaligned ones. Templates need more sections than the old object format has.
# The folder that something is built in, and when, is nowhere said.
get_filename_component(root ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)
set(CMAKE_C_FLAGS_INIT "-Wa,-muse-unaligned-vector-move -ffile-prefix-map=${root}=.")
set(CMAKE_CXX_FLAGS_INIT "${CMAKE_C_FLAGS_INIT} -Wa,-mbig-obj")
foreach(what EXE SHARED MODULE)  # nothing has libraries beside it
  set(CMAKE_${what}_LINKER_FLAGS_INIT "-static -Wl,--no-insert-timestamp")
endforeach()

set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES CONSAC_CROSS_PREFIX)
set(CMAKE_FIND_ROOT_PATH ${CONSAC_CROSS_PREFIX} /usr/x86_64-w64-mingw32)  # the first has no library but static ones
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} ${CONSAC_CROSS_PREFIX}/lib/pkgconfig)
set(PKG_CONFIG_ARGN --static)  # also what a static library stands on
set(CMAKE_GTEST_DISCOVER_TESTS_DISCOVERY_MODE PRE_TEST)  # the programs do not run while they are built
