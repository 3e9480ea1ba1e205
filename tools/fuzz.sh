#!/usr/bin/env bash
# Runs every fuzz target for SECONDS each on a copy of its seeds.
#   tools/fuzz.sh SECONDS
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:-60}
cmake --preset release -B build/fuzz -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_C_COMPILER=clang -DCONSAC_BUILD_FUZZ=ON \
  -DCONSAC_BUILD_TESTS=OFF -DCONSAC_BUILD_BENCH=OFF --log-level=WARNING
cmake --build build/fuzz -j "$(nproc)"
for target in build/fuzz/fuzz/*_fuzz; do
  name=$(basename "$target" _fuzz)
  corpus=build/fuzz/corpus/$name
  mkdir -p "$corpus"
  echo "fuzz: $name for $seconds s"
  "$target" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 "$corpus" "fuzz/seeds/$name" 2>&1 \
    | grep -E 'ERROR|SUMMARY|stat::number_of_executed_units|cov:' | tail -n 3
  test "${PIPESTATUS[0]}" -eq 0
done
