# How CONSAC's parts become targets: consac_part(NAME ... DEPENDS ...) makes the library consac_NAME from every .cpp below
# the folder, consac_tests(NAME ...) one GoogleTest program from every *_test.cpp. Files are found, never listed twice.

set(CONSAC_WARNINGS -Wall -Wextra -Wshadow -Wundef -Wnon-virtual-dtor)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC 12 at -O3 warns of overlaps inside std::string's own concatenation (GCC bugs 105329, 105651).
  list(APPEND CONSAC_WARNINGS -Wno-restrict)
endif()

# A test's own code need not be fast, but there is much of it, and what is tested is optimised: without -O1 a third of the
# compile time goes, and lines in a debugger cost less than variables.
set(CONSAC_TEST_OPTIONS -O0 -g1)
if(CMAKE_CROSSCOMPILING)
  # No debugger comes here. With -O0, where nothing is inlined, an object has ten thousand sections of one function each, and for each
  # MinGW's linker and archiver read all symbols anew: a minute for what takes a second.
  set(CONSAC_TEST_OPTIONS -O1)
endif()

function(consac_part NAME)
  cmake_parse_arguments(ARG "" "" "DEPENDS;PRIVATE" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "_test\\.cpp$|/test/")
  add_library(consac_${NAME} STATIC ${sources})
  add_library(consac::${NAME} ALIAS consac_${NAME})
  set_target_properties(consac_${NAME} PROPERTIES EXPORT_NAME ${NAME})
  target_compile_features(consac_${NAME} PUBLIC cxx_std_20)
  target_compile_options(consac_${NAME} PRIVATE ${CONSAC_WARNINGS})
  if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/include)
    target_include_directories(consac_${NAME} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
                                                     $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  endif()
  target_include_directories(consac_${NAME} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  foreach(dependency ${ARG_DEPENDS})
    target_link_libraries(consac_${NAME} PUBLIC consac_${dependency})
  endforeach()
  foreach(library ${ARG_PRIVATE})
    target_link_libraries(consac_${NAME} PRIVATE $<BUILD_INTERFACE:${library}>)
  endforeach()
endfunction()

# Where no time is spent: a third of the compiler's time is saved. With -O0, for builds that are tested and go to
# nobody, more than half of clang's.
set(CONSAC_LITTLE -O1 CACHE STRING "How cli and run are optimised, where no time is spent")
function(consac_optimise_little TARGET LEVEL)
  set(optimised $<AND:$<CONFIG:Release,RelWithDebInfo>,$<NOT:$<CXX_COMPILER_ID:MSVC>>>)
  target_compile_options(${TARGET} PRIVATE $<${optimised}:${LEVEL}>)
endfunction()

# Defines NAME="value" for those SOURCES that mention NAME alone: a path on every command line would keep a compiler's cache
# from serving two checkouts.
function(consac_define_where_used DEFINITION)
  cmake_parse_arguments(ARG "" "" "SOURCES" ${ARGN})
  string(REGEX REPLACE "=.*" "" name "${DEFINITION}")
  foreach(source ${ARG_SOURCES})
    file(STRINGS ${source} mentions REGEX "${name}" LIMIT_COUNT 1)
    if(mentions)
      set_property(SOURCE ${source} APPEND PROPERTY COMPILE_DEFINITIONS "${DEFINITION}")
    endif()
  endforeach()
endfunction()

# One test program per part; private headers of the part may be included. EXCLUDE: a folder that is a program of its own.
# WITH_THREADS: which of its tests have threads; ThreadSanitizer runs those alone. COMPUTES: they compute references in
# float64, and without -O1 that takes longer than is saved.
function(consac_tests NAME FOLDER)
  cmake_parse_arguments(ARG "COMPUTES" "EXCLUDE;WITH_THREADS" "LINK" ${ARGN})
  set(options ${CONSAC_TEST_OPTIONS})
  if(ARG_COMPUTES AND NOT CMAKE_CXX_FLAGS MATCHES "sanitize")
    list(APPEND options -O1)
  endif()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${FOLDER}/*_test.cpp)
  if(ARG_EXCLUDE)
    list(FILTER sources EXCLUDE REGEX "/${ARG_EXCLUDE}/")
  endif()
  if(NOT sources)
    message(FATAL_ERROR "consac_tests(${NAME}): there is no *_test.cpp below ${FOLDER}")
  endif()
  add_executable(consac_${NAME}_tests ${sources})
  target_compile_options(consac_${NAME}_tests PRIVATE ${CONSAC_WARNINGS} ${options})
  set_target_properties(consac_${NAME}_tests PROPERTIES UNITY_BUILD_BATCH_SIZE 12)
  target_include_directories(consac_${NAME}_tests PRIVATE ${FOLDER}/src ${PROJECT_SOURCE_DIR})
  consac_define_where_used(CONSAC_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SOURCES ${sources})
  target_link_libraries(consac_${NAME}_tests PRIVATE ${ARG_LINK} GTest::gtest GTest::gmock GTest::gtest_main)
  set(filter "")
  if(ARG_WITH_THREADS AND CMAKE_CXX_FLAGS MATCHES "sanitize=thread")
    set(filter TEST_FILTER ${ARG_WITH_THREADS})
  endif()
  gtest_discover_tests(consac_${NAME}_tests TEST_PREFIX ${NAME}. DISCOVERY_TIMEOUT 60 ${filter} PROPERTIES TIMEOUT 300)
endfunction()

# What is loaded at run time, and may be unloaded before the program ends.
function(consac_loaded TARGET)
  if(CONSAC_CROSS_TARGET MATCHES "^linux")  # by zig
    target_sources(${TARGET} PRIVATE ${PROJECT_SOURCE_DIR}/cmake/unload.cpp)
    set_source_files_properties(${PROJECT_SOURCE_DIR}/cmake/unload.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()
