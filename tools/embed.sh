#!/usr/bin/env bash
# Compiles core and learn as an engine does, with g++ and clang++: no exceptions, no RTTI, warnings as errors, all
# sources concatenated, every public header after the macros that Unreal defines; the Unreal plugin, concatenated, with
# clang++ (make test takes it so with g++, tools/unreal_compilers.sh file by file); and the sources that are staged into it.
# g++ takes headers and these two dozen at a time, as Unreal's build tool joins them, and optimised, since it warns of what it
# finds then; they are linked with nothing missing and run. clang++ takes each by itself, and stops at what it says of the
# language, all of its warnings included: that its objects link, and Highway's instruction sets, are seen by tools/unreal_compilers.sh.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/setup.sh unreal
command -v ccache >/dev/null && export CONSAC_COMPILER_LAUNCHER=ccache
for compiler in g++ clang++; do
  if [ "$compiler" = g++ ]; then
    options=(-DCONSAC_EMBED_JOINED=ON)
    targets=(consac_as_engines_do)
    said="and what is staged into the plugin, which links and runs"
  else
    options=(-DCONSAC_EMBED_JOINED=OFF -DCMAKE_CXX_FLAGS_RELEASE="-fsyntax-only -DNDEBUG")
    targets=(consac_embed consac_staged_objects consac_unreal_plugin)
    said="the plugin, and each source that is staged into it"
  fi
  cmake --preset embed -B "build/embed-$compiler" -DCMAKE_CXX_COMPILER="$compiler" -DCONSAC_BUILD_TESTS=OFF --log-level=WARNING "${options[@]}"
  cmake --build "build/embed-$compiler" -j "$(nproc)" --target "${targets[@]}"
  echo "embed: $compiler compiles core and learn concatenated, every public header, $said"
done
