#!/usr/bin/env bash
# Runs every fuzz target on a copy of its seeds: SECONDS of a core in all, shared evenly by however many there are.
#   tools/fuzz.sh SECONDS
set -euo pipefail
cd "$(dirname "$0")/.."
in_all=${1:-480}
command -v ccache >/dev/null && export CONSAC_COMPILER_LAUNCHER=ccache
# What a model computes is fuzzed for its shapes, so that one instruction set does.
cmake --preset release -B build/fuzz -DCMAKE_CXX_COMPILER=clang++ -DCONSAC_BUILD_FUZZ=ON -DCONSAC_BUILD_TESTS=OFF \
  -DCONSAC_BUILD_BENCH=OFF -DCMAKE_UNITY_BUILD_BATCH_SIZE=48 -DCONSAC_LITTLE=-O0 --log-level=WARNING \
  -DCMAKE_CXX_FLAGS_RELEASE="-O1 -g1 -DNDEBUG -DHWY_COMPILE_ONLY_STATIC" >/dev/null
cmake --build build/fuzz -j "$(nproc)" --target consac_fuzz_targets

# One target; its last lines, and its exit status.
fuzz_one() {
  local target=$1 seconds=$2 name corpus log status=0
  name=$(basename "$target" _fuzz)
  corpus=build/fuzz/corpus/$name
  log=build/fuzz/$name.log
  mkdir -p "$corpus"
  "$target" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 "$corpus" "fuzz/seeds/$name" >"$log" 2>&1 || status=$?
  printf 'fuzz: %s for %s s: %s\n' "$name" "$seconds" "$(grep -oE 'number_of_executed_units: [0-9]+' "$log" | tail -n 1)"
  ((status == 0)) || grep -E 'ERROR|SUMMARY|Test unit written' "$log" | tail -n 5
  return "$status"
}
export -f fuzz_one

# All at once, so that no core is left over at the end.
targets=(build/fuzz/fuzz/*_fuzz)
cores=$(($(nproc) < ${#targets[@]} ? $(nproc) : ${#targets[@]}))
printf '%s\n' "${targets[@]}" | xargs -P 0 -I{} bash -c 'fuzz_one {} '"$((in_all / cores))"
