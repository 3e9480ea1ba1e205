#!/usr/bin/env bash
# Cross-compiles core, learn, engines/host and the worlds with their tests for Windows (installing what that needs)
# and runs the tests of the first three under Wine where that is installed. run and cli need cairo and POSIX: not yet.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/setup.sh windows
command -v ccache >/dev/null && export CONSAC_COMPILER_LAUNCHER=ccache
needs=build/windows-needs
prefix=$PWD/$needs/prefix
toolchain=(-G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/mingw.cmake" -DCONSAC_WINDOWS_PREFIX="$prefix" -DCMAKE_BUILD_TYPE=Release
  -DCMAKE_CXX_COMPILER_LAUNCHER="${CONSAC_COMPILER_LAUNCHER:-}" --log-level=WARNING)

# Libraries that are compiled, then those that are headers only: copied, since /usr/include itself holds another system's.
if [ ! -f "$needs/ready" ]; then
  mkdir -p "$needs/highway" "$prefix/include" "$prefix/share/cmake"
  tar -xf "$needs"/highway_*.orig.tar.gz -C "$needs/highway" --strip-components=1
  cmake -S "$needs/highway" -B "$needs/build-highway" "${toolchain[@]}" -DCMAKE_INSTALL_PREFIX="$prefix" -DBUILD_TESTING=OFF \
    -DHWY_ENABLE_EXAMPLES=OFF -DHWY_ENABLE_CONTRIB=OFF -DHWY_ENABLE_TESTS=OFF -Wno-dev
  cmake --build "$needs/build-highway" -j "$(nproc)" --target install >"$needs/highway.log"
  mkdir -p "$prefix/lib/cmake/hwy"  # this version of Highway installs none
  cat >"$prefix/lib/cmake/hwy/hwy-config.cmake" <<'CONFIG'
add_library(hwy::hwy STATIC IMPORTED)
set_target_properties(hwy::hwy PROPERTIES IMPORTED_LOCATION ${CMAKE_CURRENT_LIST_DIR}/../../libhwy.a
                      INTERFACE_INCLUDE_DIRECTORIES ${CMAKE_CURRENT_LIST_DIR}/../../../include)
CONFIG
  cmake -S /usr/src/googletest -B "$needs/build-googletest" "${toolchain[@]}" -DCMAKE_INSTALL_PREFIX="$prefix" -Wno-dev
  cmake --build "$needs/build-googletest" -j "$(nproc)" --target install >"$needs/googletest.log"
  cp -r /usr/include/{asio,asio.hpp,eigen3,fast_float,nlohmann} "$prefix/include/"
  cp -r /usr/share/cmake/nlohmann_json "$prefix/share/cmake/"
  cp -r /usr/share/eigen3 "$prefix/share/"
  touch "$needs/ready"
fi

cmake -S . -B build/windows "${toolchain[@]}" -DCONSAC_BUILD_PROGRAM=OFF -DCONSAC_BUILD_BENCH=OFF
cmake --build build/windows -j "$(nproc)"
echo "windows: core, learn, engines/host and the worlds compile with their tests"

cmake -S . -B build/windows-staged "${toolchain[@]}" -DCONSAC_EMBED=ON -DCONSAC_BUILD_TESTS=OFF
cmake --build build/windows-staged -j "$(nproc)" --target consac_staged
echo "windows: what is staged into the Unreal plugin compiles, and links with nothing missing"

if ! command -v wine >/dev/null; then
  echo "windows: no wine here, so the tests do not run"
  exit 0
fi
export WINEPREFIX=$PWD/$needs/wine WINEDEBUG=-all
for part in core learn host; do
  timeout 300 wine "build/windows/tests/consac_${part}_tests.exe" --gtest_brief=1
done
