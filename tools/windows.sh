#!/usr/bin/env bash
# Cross-compiles everything for Windows with its tests, which run under Wine where that is installed, and what is staged into
# the Unreal plugin. The program alone: tools/cross.sh windows-x86_64.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/setup.sh windows
command -v ccache >/dev/null && export CONSAC_COMPILER_LAUNCHER=ccache
. tools/cross_libraries.sh
choose_target windows-x86_64
build_libraries googletest

# Less optimised than what people run: its tests are soon done. Not with -O0, which MinGW's linker takes minutes over.
cmake -S . -B build/windows "${toolchain[@]}" -DCONSAC_BUILD_BENCH=OFF -DCMAKE_UNITY_BUILD_BATCH_SIZE=48 -DCONSAC_LITTLE=-O1 \
  -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG"
cmake --build build/windows -j "$(nproc)"
echo "windows: the program, the extension for Godot and their tests compile"

cmake -S . -B build/windows-staged "${toolchain[@]}" -DCONSAC_EMBED=ON -DCONSAC_BUILD_TESTS=OFF -DCONSAC_EMBED_JOINED=ON \
  -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG"
cmake --build build/windows-staged -j "$(nproc)" --target consac_staged
echo "windows: what is staged into the Unreal plugin compiles, and links with nothing missing"

if ! command -v wine >/dev/null; then
  echo "windows: no wine here, so the tests do not run"
  exit 0
fi
export WINEPREFIX=$archives/wine WINEDEBUG=-all
wine wineboot --init >/dev/null 2>&1  # once, before two programs at a time want it
printf '%s\0' build/windows/tests/consac_{run,core,learn,host,worlds}_tests.exe |
  xargs -0 -P "$(nproc)" -I{} bash -c 'log=$(timeout 400 wine "$1" --gtest_brief=1 2>&1); status=$?; echo "$log"; exit $status' - {}
# The program of this system, where it is built, meets its sister.
for program in "$PWD"/build/{dev,release}/cli/consac; do [ -x "$program" ] && export CONSAC_PROGRAM=$program && break; done
CONSAC_WINDOWS_PROGRAM=$PWD/build/windows/cli/consac.exe .venv/bin/python -m pytest -q -rs tests/windows
