# Toolchain: programs for another system by zig. tools/cross.sh uses it: CONSAC_CROSS_TARGET says which system,
# CONSAC_CROSS_COMPILERS is the folder of zig's compilers, CONSAC_CROSS_PREFIX has what CONSAC stands on.
string(REGEX MATCH "^([a-z]+)-([a-z0-9_]+)" ignored ${CONSAC_CROSS_TARGET})
set(CMAKE_SYSTEM_PROCESSOR ${CMAKE_MATCH_2})
if(CMAKE_MATCH_1 STREQUAL "macos")
  set(CMAKE_SYSTEM_NAME Darwin)
  set(CMAKE_OSX_DEPLOYMENT_TARGET "" CACHE STRING "Said by the compiler's own target")
  set(dead_code -Wl,-dead_strip)
else()
  set(CMAKE_SYSTEM_NAME Linux)
  set(dead_code -Wl,--gc-sections)
endif()
set(CMAKE_C_COMPILER ${CONSAC_CROSS_COMPILERS}/cc)
set(CMAKE_CXX_COMPILER ${CONSAC_CROSS_COMPILERS}/c++)
set(CMAKE_AR ${CONSAC_CROSS_COMPILERS}/ar)
set(CMAKE_RANLIB ${CONSAC_CROSS_COMPILERS}/ranlib)

# No contraction: the same bits on ARM as on x86. The folder that something is built in is nowhere said.
get_filename_component(root ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)
set(flags "-ffp-contract=off -ffunction-sections -fdata-sections -ffile-prefix-map=${root}=.")
set(CMAKE_C_FLAGS_INIT "${flags}")
set(CMAKE_CXX_FLAGS_INIT "${flags}")
foreach(what EXE SHARED MODULE)
  set(CMAKE_${what}_LINKER_FLAGS_INIT "${dead_code}")
endforeach()

set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES CONSAC_CROSS_TARGET CONSAC_CROSS_COMPILERS CONSAC_CROSS_PREFIX)
set(CMAKE_FIND_ROOT_PATH ${CONSAC_CROSS_PREFIX})
foreach(what LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${what} ONLY)
endforeach()
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(ENV{PKG_CONFIG_LIBDIR} ${CONSAC_CROSS_PREFIX}/lib/pkgconfig)
set(PKG_CONFIG_ARGN --static)  # also what a static library stands on
set(CMAKE_GTEST_DISCOVER_TESTS_DISCOVERY_MODE PRE_TEST)  # the programs do not run while they are built
