#!/usr/bin/env bash
# Cross-compiles for Windows, installing what that needs.
#   tools/windows.sh          everything with its tests, which run under Wine where that is installed, and what is staged
#                             into the Unreal plugin
#   tools/windows.sh program  only the program: build/windows-program/cli/consac.exe
set -euo pipefail
cd "$(dirname "$0")/.."
what=${1:-all}
case $what in
  all) tools/setup.sh windows ;;
  program) tools/setup.sh windows-program ;;
  *) echo "windows: unknown '$what': program, or nothing for all"; exit 2 ;;
esac
command -v ccache >/dev/null && export CONSAC_COMPILER_LAUNCHER=ccache
needs=$PWD/build/windows-needs
prefix=$needs/prefix
toolchain=(-G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/mingw.cmake" -DCONSAC_WINDOWS_PREFIX="$prefix" -DCMAKE_BUILD_TYPE=Release
  -DCMAKE_C_COMPILER_LAUNCHER="${CONSAC_COMPILER_LAUNCHER:-}" -DCMAKE_CXX_COMPILER_LAUNCHER="${CONSAC_COMPILER_LAUNCHER:-}"
  --log-level=WARNING)

. tools/cross_libraries.sh
# Half of the work is scripts that look at the system, one after another: the pictures' libraries beside the others.
for library in headers runtime zlib; do build_library "$library"; done
[ "$what" = program ] || windows_plain+=(googletest)
set -m  # in a group of its own: nothing of it outlives a failure of the others
(for library in "${windows_plain[@]}"; do build_library "$library"; done) </dev/null &
plain=$!
set +m
trap 'kill -- "-$plain" 2>/dev/null && wait "$plain" || true' EXIT
for library in "${windows_pictures[@]}"; do build_library "$library"; done
wait "$plain"
trap - EXIT

if [ "$what" = program ]; then
  cmake -S . -B build/windows-program "${toolchain[@]}" -DCONSAC_BUILD_TESTS=OFF -DCONSAC_BUILD_BENCH=OFF -DCONSAC_BUILD_GODOT=OFF \
    -DCMAKE_EXE_LINKER_FLAGS_RELEASE=-s
  cmake --build build/windows-program -j "$(nproc)" --target consac
  echo "windows: the program is build/windows-program/cli/consac.exe"
  exit 0
fi

# Less optimised than what people run: its tests are soon done.
cmake -S . -B build/windows "${toolchain[@]}" -DCONSAC_BUILD_BENCH=OFF -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG"
cmake --build build/windows -j "$(nproc)"
echo "windows: the program, the extension for Godot and their tests compile"

cmake -S . -B build/windows-staged "${toolchain[@]}" -DCONSAC_EMBED=ON -DCONSAC_BUILD_TESTS=OFF -DCONSAC_STAGED_JOINED=ON \
  -DCMAKE_CXX_FLAGS_RELEASE="-O0 -DNDEBUG"
cmake --build build/windows-staged -j "$(nproc)" --target consac_staged
echo "windows: what is staged into the Unreal plugin compiles, and links with nothing missing"

if ! command -v wine >/dev/null; then
  echo "windows: no wine here, so the tests do not run"
  exit 0
fi
export WINEPREFIX=$needs/wine WINEDEBUG=-all
wine wineboot --init >/dev/null 2>&1  # once, before two programs at a time want it
printf '%s\0' build/windows/tests/consac_{run,core,learn,host,worlds}_tests.exe |
  xargs -0 -P "$(nproc)" -I{} bash -c 'log=$(timeout 400 wine "$1" --gtest_brief=1 2>&1); status=$?; echo "$log"; exit $status' - {}
# The program of this system, where it is built, meets its sister.
for program in "$PWD"/build/{dev,release}/cli/consac; do [ -x "$program" ] && export CONSAC_PROGRAM=$program && break; done
CONSAC_WINDOWS_PROGRAM=$PWD/build/windows/cli/consac.exe .venv/bin/python -m pytest -q -rs tests/windows
