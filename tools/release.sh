#!/usr/bin/env bash
# Makes what a release page offers, in a folder that is made anew: tools/release.sh [FOLDER], dist unless given.
# Programs for five systems, Godot's native extension and the library of consac.h for five, wheels, consac-cad for Debian 12,
# Unreal's zips. The time of all files is the commit's, or SOURCE_DATE_EPOCH. What of it was tried where: docs/release.md.
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-dist}
notes=build/release-notes
start=$SECONDS last=0 spent=0
# step WHAT: says that it is done, and notes its seconds, by the clock and of processors.
step() {
  local clock=$((SECONDS - start)) before=$spent
  times >"$notes/spent"  # by itself: in a pipe it would be a child's
  spent=$(sed -n '2s/[ms]/ /gp' "$notes/spent" | awk '{printf "%d", $1 * 60 + $2 + $3 * 60 + $4}')
  printf '| %s | %d | %d |\n' "$1" $((clock - last)) $((spent - before)) >>"$notes/times.md"
  printf 'release: %s (after %d min)\n' "$1" $((clock / 60))
  last=$clock
}
mkdir -p "$notes"
printf 'Commit %s, %s, %s processors.\n\n| what | seconds | of processors |\n|---|---|---|\n' "$(git describe --always --dirty=+ --abbrev=12)" "$(date +%F)" "$(nproc)" >"$notes/times.md"

tools/setup.sh release
command -v ccache >/dev/null && export CONSAC_COMPILER_LAUNCHER=ccache
export CCACHE_BASEDIR=  # as in tools/cross.sh
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}

for target in linux-x86_64-musl linux-aarch64-musl; do tools/cross.sh "$target" consac; step "$target"; done
for target in linux-x86_64 linux-aarch64; do tools/cross.sh "$target" consac_godot consac_c; step "$target"; done
for target in windows-x86_64 macos-arm64 macos-x86_64; do tools/cross.sh "$target" consac consac_godot consac_c; step "$target"; done

# By this machine's own compiler, for this machine's own libraries.
cmake -S . -B build/release-cad -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER_LAUNCHER="${CONSAC_COMPILER_LAUNCHER:-}" \
  -DCMAKE_CXX_FLAGS="-ffile-prefix-map=$PWD=." -DCMAKE_EXE_LINKER_FLAGS=-s -DCONSAC_BUILD_TESTS=OFF -DCONSAC_BUILD_BENCH=OFF \
  -DCONSAC_BUILD_GODOT=OFF -DCMAKE_SKIP_RPATH=ON --log-level=WARNING
cmake --build build/release-cad -j "$(nproc)" --target consac-cad
step consac-cad

rm -rf "$out"
mkdir -p "$out"
tools/package_unreal.py --out "$out"
.venv/bin/python tools/wheels.py --out "$out" --epoch "$SOURCE_DATE_EPOCH"
tools/package_release.py --out "$out" --epoch "$SOURCE_DATE_EPOCH"
step packing
printf '| all | %d | %d |\n' $((SECONDS - start)) "$spent" >>"$notes/times.md"
echo "release: all is in $out"
