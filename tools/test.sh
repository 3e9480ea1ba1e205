#!/usr/bin/env bash
# Builds one preset and runs its tests; leaves build/PRESET/tests.xml for the counts.
#   tools/test.sh dev|release|asan|tsan
set -euo pipefail
cd "$(dirname "$0")/.."
preset=$1
command -v ccache >/dev/null && export CONSAC_COMPILER_LAUNCHER=ccache
export PATH="$PWD/.venv/bin:$PATH"
cmake --preset "$preset" --log-level=WARNING
cmake --build --preset "$preset" -j "$(nproc)"
ctest --preset "$preset" -j "$(($(nproc) + 1))" --output-junit tests.xml  # one more than cores: many wait
