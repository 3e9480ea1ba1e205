#!/usr/bin/env bash
# Compiles for another system, installing what that needs.
#   tools/cross.sh TARGET                      the program: build/cross-TARGET/cli/consac (.exe)
#   tools/cross.sh TARGET CMAKE-TARGET...      these instead
#   tools/cross.sh targets                     what TARGET can be
# For Linux with musl a program of one file for every Linux; without it no program, but what others load (consac_godot unless
# said otherwise), for glibc 2.17 of 2012 and later. Nothing that is compiled says when or where that was done.
set -euo pipefail
cd "$(dirname "$0")/.."
. tools/cross_libraries.sh
what=${1:-}
if [ "$what" = targets ]; then printf '%s\n' "${cross_targets[@]}"; exit; fi
[[ " ${cross_targets[*]} " == *" ${what:-?} "* ]] || { echo "cross: unknown target '$what': one of ${cross_targets[*]}"; exit 2; }
shift
tools/setup.sh cross
command -v ccache >/dev/null && export CONSAC_COMPILER_LAUNCHER=ccache
export CCACHE_BASEDIR=  # a user's own would make paths relative, which the compiler is not told to leave out
choose_target "$what"
[ $# -gt 0 ] || set -- "$made"
exec 9>"$needs.lock"
flock 9  # two that begin at once build the libraries once
build_libraries
exec 9>&-

stripped=(-DCMAKE_{EXE,SHARED,MODULE}_LINKER_FLAGS_RELEASE=-s)
cmake -S . -B "build/cross-$target" "${toolchain[@]}" "${stripped[@]}" -DCONSAC_BUILD_TESTS=OFF -DCONSAC_BUILD_BENCH=OFF
cmake --build "build/cross-$target" -j "$(nproc)" --target "$@"
echo "cross: $* for $target in build/cross-$target"
