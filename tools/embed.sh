#!/usr/bin/env bash
# Compiles core and learn as an engine does, with g++ and clang++: no exceptions, no RTTI, warnings as errors, all
# sources concatenated, every public header after the macros that Unreal defines; the Unreal plugin, concatenated, with
# clang++ (make test takes it so with g++, tools/unreal_compilers.sh file by file); and the sources that are staged into it,
# which are linked with nothing missing and run. With g++ these are compiled as they lie there and optimised, since it warns
# of what it finds then; clang++ takes two dozen at a time and optimises nothing.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/setup.sh unreal
command -v ccache >/dev/null && export CONSAC_COMPILER_LAUNCHER=ccache
for compiler in g++ clang++; do
  options=()
  [ "$compiler" = g++ ] || options=(-DCONSAC_STAGED_JOINED=ON -DCMAKE_CXX_FLAGS_RELEASE="-O0 -DNDEBUG")
  cmake --preset embed -B "build/embed-$compiler" -DCMAKE_CXX_COMPILER="$compiler" -DCONSAC_BUILD_TESTS=OFF --log-level=WARNING "${options[@]}"
  cmake --build "build/embed-$compiler" -j "$(nproc)" --target consac_as_engines_do
  plugin="the plugin, "
  [ "$compiler" != g++ ] || plugin=
  echo "embed: $compiler compiles core and learn concatenated, every public header, ${plugin}and what is staged into it"
done
