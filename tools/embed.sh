#!/usr/bin/env bash
# Compiles core and learn as an engine does, with g++ and clang++: no exceptions, no RTTI, warnings as errors, all
# sources concatenated, every public header after the macros that Unreal defines; and the sources that are staged into
# the Unreal plugin, as they lie there.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/setup.sh unreal
command -v ccache >/dev/null && export CONSAC_COMPILER_LAUNCHER=ccache
for compiler in g++ clang++; do
  cmake --preset embed -B "build/embed-$compiler" -DCMAKE_CXX_COMPILER="$compiler" -DCONSAC_BUILD_TESTS=OFF --log-level=WARNING
  cmake --build "build/embed-$compiler" -j "$(nproc)"
  echo "embed: $compiler compiles core and learn per file, concatenated, every public header, and the staged plugin"
done
