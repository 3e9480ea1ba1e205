#!/usr/bin/env bash
# Compiles what Unreal's build tool compiles, with compilers as near to Unreal's as can be had without Unreal, and with
# the warnings that it turns into errors.
#   tools/unreal_compilers.sh linux   clang 16 and libc++ 16 on the headers of glibc 2.17, which is what Unreal 5.3 and 5.4
#                                     bring: all that is staged, and the plugin, its samples and its tests against the shim;
#                                     linked with nothing that this glibc has not
#   tools/unreal_compilers.sh macos   clang and libc++ of zig for Apple's ARM64: all that is staged. Not run.
#   tools/unreal_compilers.sh         both
# zig's compiled libraries are kept in the user's cache, or where ZIG_GLOBAL_CACHE_DIR says.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/setup.sh unreal-compilers
what=("$@")
[ ${#what[@]} -gt 0 ] || what=(linux macos)
build=$PWD/build/unreal-compilers
staged=$build/plugin/Source
zig=$(.venv/bin/python -c 'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).parent / "zig")')
libc=$(dirname "$zig")/lib/libc/include
export ZIG_GLOBAL_CACHE_DIR=${ZIG_GLOBAL_CACHE_DIR:-${XDG_CACHE_HOME:-$HOME/.cache}/consac-zig} ZIG_LOCAL_CACHE_DIR=$build/zig
ccache=$(command -v ccache || true)
mkdir -p "$build"

python3 tools/stage_unreal.py --into "$build/plugin"
python3 engines/unreal/shim/generate.py engines/unreal/Consac "$build/generated"

common=(-std=c++20 -fno-exceptions -fno-rtti -ffp-contract=off -fPIC -fvisibility=hidden -O0)
# What Unreal's build tool turns into errors for clang, and what its newer compilers find by themselves.
warnings=(-Wall -Wextra -Wshadow -Wundef -Wdeprecated -Wdeprecated-declarations -Wdelete-non-virtual-dtor -Wenum-conversion
  -Wno-unused-command-line-argument -Werror)
parts=(-I"$staged/ConsacCore/Public" -I"$staged/ConsacCore/Private" -I"$staged/ConsacLearn/Public" -I"$staged/ConsacLearn/Private")
for library in "$staged"/ConsacCore/ThirdParty/*/; do parts+=(-isystem "$library"); done

# compile FOLDER COMPILER... -- SOURCE...: an object in the folder for each source, as many at once as there are processors.
compile() {
  local folder=$1 command=()
  shift
  while [ "$1" != -- ]; do command+=("$1"); shift; done
  shift
  mkdir -p "$folder"
  printf '%s\0' "$@" | COMMAND=$(printf '%q ' "${command[@]}") FOLDER=$folder xargs -0 -P "$(nproc)" -I{} bash -c '
    object=$FOLDER/$(basename "$1" .cpp).o
    eval "$COMMAND" -c \"\$1\" -o \"\$object\" || { echo "unreal_compilers: $1 does not compile"; exit 1; }' - {}
}

linux() {
  local glibc=(--target=x86_64-unknown-linux-gnu -nostdlibinc -D__GLIBC_MINOR__=17 -isystem /usr/lib/llvm-16/include/c++/v1
    -isystem "$libc/x86-linux-gnu" -isystem "$libc/generic-glibc" -isystem "$libc/x86-linux-any" -isystem "$libc/any-linux-any")
  local clang=($ccache clang++-16 "${glibc[@]}" "${common[@]}" "${warnings[@]}")
  local plugin=engines/unreal/Consac/Source
  compile "$build/linux" "${clang[@]}" -DCONSAC_ALL_WARNINGS "${parts[@]}" -- "$staged"/Consac/Private/Staged/*.cpp
  echo "unreal_compilers: clang 16, libc++ 16, glibc 2.17: what is staged compiles"
  local folders=() module
  for module in Consac ConsacSamples ConsacTests; do folders+=(-I"$plugin/$module/Public" -I"$plugin/$module/Private"); done
  compile "$build/linux-plugin" "${clang[@]}" -Wsuggest-override -Iengines/unreal/shim/include -I"$build/generated" "${folders[@]}" "${parts[@]}" -- \
    "$plugin"/Consac*/Private/*.cpp "$build/generated/generated.cpp" engines/unreal/shim/src/*.cpp
  echo "unreal_compilers: clang 16, libc++ 16, glibc 2.17: the plugin, its samples and its tests compile against the shim"
  # An engine's editor loads a module with its own copies of nothing: whatever is missing in this glibc is missing here.
  "$zig" c++ -target x86_64-linux-gnu.2.17 -shared -Wl,-z,defs -o "$build/linux/libconsac.so" "$build"/linux/*.o
  echo "unreal_compilers: it links with glibc 2.17"
}

macos() {
  local target=aarch64-macos
  compile "$build/$target" "$zig" c++ -target "$target" "${common[@]}" "${warnings[@]}" -DCONSAC_ALL_WARNINGS "${parts[@]}" -- \
    "$staged"/Consac/Private/Staged/*.cpp
  "$zig" c++ -target "$target" -shared -o "$build/$target/libconsac.dylib" "$build/$target"/*.o
  echo "unreal_compilers: what is staged compiles and links for $target; nothing of it was run"
}

for one in "${what[@]}"; do
  case $one in
    linux|macos) "$one" ;;
    *) echo "unreal_compilers: unknown '$one': linux, macos, or nothing for both"; exit 2 ;;
  esac
done
