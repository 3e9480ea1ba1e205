# Writes the commit that a build is made from into a source file, and only where it has changed: cmake -DSOURCE= -DINTO= -P this.
# CONSAC_COMMIT in the environment says it where there is no repository (a tarball).
cmake_minimum_required(VERSION 3.25)
set(commit "$ENV{CONSAC_COMMIT}")
if(commit STREQUAL "")
  execute_process(COMMAND git describe --always --dirty=+ --abbrev=12 --exclude=* WORKING_DIRECTORY ${SOURCE}
                  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT commit MATCHES "^[0-9a-f]+[+]?$")
  set(commit "unknown")
endif()
file(CONFIGURE OUTPUT ${INTO} CONTENT "#include \"cli/commit.h\"

namespace consac::cli {

const char* Commit() {
  return \"${commit}\";
}

}  // namespace consac::cli
")
