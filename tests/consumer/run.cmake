# Installs the build into a fresh prefix, builds consumers against it, by find_package and by pkg-config, and runs them.
#   cmake -DBUILD=... -DSOURCE=... -DWORK=... -P run.cmake
file(REMOVE_RECURSE ${WORK})
set(by_pkg_config "export PKG_CONFIG_PATH=$(dirname $(find ${WORK}/prefix -name consac.pc)) && c++ -std=c++20 ${SOURCE}/main.cpp $(pkg-config --cflags --libs consac) -o ${WORK}/cpp && ${WORK}/cpp && cc -std=c11 ${SOURCE}/main.c $(pkg-config --cflags --libs consac-c) -Wl,-rpath,$(pkg-config --variable=libdir consac-c) -o ${WORK}/c && ${WORK}/c")
foreach(step
    "${CMAKE_COMMAND};--install;${BUILD};--prefix;${WORK}/prefix"
    "${CMAKE_COMMAND};-S;${SOURCE};-B;${WORK}/build;-G;Ninja;-DCMAKE_PREFIX_PATH=${WORK}/prefix;-DCMAKE_BUILD_TYPE=Release"
    "${CMAKE_COMMAND};--build;${WORK}/build"
    "${WORK}/build/consumer"
    "${WORK}/build/c_consumer"
    "sh;-ec;${by_pkg_config}")
  execute_process(COMMAND ${step} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  message("${output}")
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "failed: ${step}")
  endif()
  string(APPEND said "${output}")
endforeach()
string(REGEX MATCHALL "road-v0 has 2 agents" cpp "${said}")
string(REGEX MATCHALL "the C interface has ppo2" c "${said}")
list(LENGTH cpp cpp)
list(LENGTH c c)
if(NOT cpp EQUAL 2 OR NOT c EQUAL 2)
  message(FATAL_ERROR "the consumers printed something else")
endif()
