#!/usr/bin/env bash
# Compiles what Unreal's build tool compiles, with compilers as near to Unreal's as can be had without Unreal, and with
# the warnings that it turns into errors.
#   tools/unreal_compilers.sh linux   clang 16 and libc++ 16 on the headers of glibc 2.17, which is what Unreal 5.3 and 5.4
#                                     bring: all that is staged, and the plugin, its samples and its tests against the shim;
#                                     linked with nothing that this glibc has not
#   tools/unreal_compilers.sh linux18 clang and libc++ 18 on glibc 2.28, which is what Unreal 5.5 and 5.6 bring: all that is staged
#   tools/unreal_compilers.sh windows  clang 16 in Microsoft's dialect of C++, libc++ 16 on the headers of Windows 10's C library: all that
#                                     is staged, and the plugin, its samples and its tests against the shim. Not run.
#   tools/unreal_compilers.sh macos   clang and libc++ of zig for Apple's ARM64: all that is staged, linked
#   tools/unreal_compilers.sh macos11 clang 16 and libc++ 16 for Apple's ARM64 and macOS 11, the first that it has had: all that is
#                                     staged, and the plugin, its samples and its tests against the shim; nothing that a
#                                     later macOS has brought. Not run.
#   tools/unreal_compilers.sh         all of them
# zig's compiled libraries are kept in the user's cache, or where ZIG_GLOBAL_CACHE_DIR says.
set -euo pipefail
cd "$(dirname "$0")/.."
tools/setup.sh unreal-compilers
what=("$@")
[ ${#what[@]} -gt 0 ] || what=(linux macos linux18 windows macos11)
build=$PWD/build/unreal-compilers
staged=$build/plugin/Source
zig=$(.venv/bin/python -c 'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).parent / "zig")')
libc=$(dirname "$zig")/lib/libc/include
export ZIG_GLOBAL_CACHE_DIR=${ZIG_GLOBAL_CACHE_DIR:-${XDG_CACHE_HOME:-$HOME/.cache}/consac-zig} ZIG_LOCAL_CACHE_DIR=$build/zig
ccache=$(command -v ccache || true)
mkdir -p "$build"

python3 tools/stage_unreal.py --into "$build/plugin"
python3 engines/unreal/shim/generate.py engines/unreal/Consac "$build/generated"

# Whether Unreal's build tool has char8_t is nowhere said; the tests' own builds have it.
# Where nothing is optimised zig would look for undefined behaviour, and keep what a debugger needs.
common=(-std=c++20 -fno-char8_t -fno-sanitize=undefined -g0 -fno-exceptions -fno-rtti -ffp-contract=off -fvisibility=hidden -O0)
# What Unreal's build tool turns into errors for clang, and what its newer compilers find by themselves.
warnings=(-Wall -Wextra -Wshadow -Wundef -Wdeprecated -Wdeprecated-declarations -Wdelete-non-virtual-dtor -Wenum-conversion
  -Wno-unused-command-line-argument -Werror)
parts=(-I"$staged/ConsacCore/Public" -I"$staged/ConsacCore/Private" -I"$staged/ConsacLearn/Public" -I"$staged/ConsacLearn/Private")
for library in "$staged"/ConsacCore/ThirdParty/*/; do parts+=(-isystem "$library"); done

# compile FOLDER COMPILER... -- SOURCE...: an object in the folder for each source, as many at once as there are processors.
# Where nothing is linked, `only=syntax compile ...` stops at what a compiler says of the language, all of its warnings
# included (clang does, zig cannot); but for Highway, whose instruction sets are told apart when code is made.
compile() {
  local folder=$1 command=()
  shift
  while [ "$1" != -- ]; do command+=("$1"); shift; done
  shift
  rm -rf "$folder" && mkdir -p "$folder"
  printf '%s\0' "$@" | COMMAND=$(printf '%q ' "${command[@]}") FOLDER=$folder ONLY=${only:-} xargs -0 -P "$(nproc)" -I{} bash -c '
    object=$FOLDER/$(basename "$1" .cpp).o make="-c -o \"\$object\""
    if [ "$ONLY" = syntax ] && [[ $1 != *kernels* ]] && ! grep -q hwy "$1"; then make=-fsyntax-only; fi
    eval "$COMMAND" "$make" \"\$1\" || { echo "unreal_compilers: $1 does not compile"; exit 1; }' - {}
}

# joined FOLDER SOURCE...: the sources, two dozen in a file, as Unreal's build tool joins them; the kernels, which include themselves
# for each instruction set, alone. Prints the files.
joined() {
  local folder=$1 count=0 file= source
  shift
  rm -rf "$folder" && mkdir -p "$folder"
  for source in "$@"; do
    if [[ $source == *kernels* ]]; then echo "$source"; continue; fi
    if ((count++ % 24 == 0)); then file=$folder/joined_$((count / 24)).cpp; echo "$file"; fi
    printf '#include "%s"\n' "$(realpath "$source")" >>"$file"
  done
}
mapfile -t staged_sources < <(joined "$build/joined" "$staged"/Consac/Private/Staged/*.cpp)

# everything FOLDER WHAT COMPILER...: what is staged, and the plugin against the shim, but for the stand-in's own Linux.
# `plugin=joined everything ...` takes the plugin's sources two dozen in a file, for who has seen that each compiles alone.
everything() {
  local folder=$1 said=$2 from=engines/unreal/Consac/Source folders=() sources=() module
  shift 2
  compile "$build/$folder" "$@" -DCONSAC_ALL_WARNINGS "${parts[@]}" -- "${staged_sources[@]}"
  echo "unreal_compilers: $said: what is staged compiles"
  for module in Consac ConsacEditor ConsacSamples ConsacTests; do
    folders+=(-I"$from/$module/Public" -I"$from/$module/Private")
    if [ "${plugin:-}" = joined ]; then mapfile -t -O ${#sources[@]} sources < <(joined "$build/joined-$module" "$from/$module"/Private/*.cpp)
    else sources+=("$from/$module"/Private/*.cpp); fi
  done
  only=syntax compile "$build/$folder-plugin" "$@" -Wsuggest-override -Iengines/unreal/shim/include -I"$build/generated" "${folders[@]}" "${parts[@]}" -- \
    "${sources[@]}" "$build/generated/generated.cpp" engines/unreal/shim/src/{runtime,text}.cpp
  echo "unreal_compilers: $said: the plugin, its samples and its tests compile against the shim"
}

# meanwhile WHAT COMMAND...: runs it beside what follows. A first link by zig makes zig's libraries, a minute of one core.
links=()
trap wait EXIT  # nothing is left behind
meanwhile() {
  local said=$1
  shift
  ("$@" && echo "unreal_compilers: $said" || { echo "unreal_compilers: FAILED: $said"; exit 1; }) &
  links+=($!)
}

linux() {
  local glibc=(--target=x86_64-unknown-linux-gnu -fPIC -nostdlibinc -D__GLIBC_MINOR__=17 -isystem /usr/lib/llvm-16/include/c++/v1
    -isystem "$libc/x86-linux-gnu" -isystem "$libc/generic-glibc" -isystem "$libc/x86-linux-any" -isystem "$libc/any-linux-any")
  everything linux "clang 16, libc++ 16, glibc 2.17" $ccache clang++-16 "${glibc[@]}" "${common[@]}" "${warnings[@]}"
  # An engine's editor loads a module with its own copies of nothing: whatever is missing in this glibc is missing here.
  meanwhile "it links with glibc 2.17" \
    "$zig" c++ -target x86_64-linux-gnu.2.17 -g0 -shared -Wl,-z,defs -o "$build/linux/libconsac.so" "$build"/linux/*.o
}

linux18() {
  local zig18
  zig18=$(.venv-unreal-5.5/bin/python -c 'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).parent / "zig")')
  compile "$build/linux18" "$zig18" c++ -target x86_64-linux-gnu.2.28 -fPIC "${common[@]}" "${warnings[@]}" -DCONSAC_ALL_WARNINGS "${parts[@]}" -- "${staged_sources[@]}"
  echo "unreal_compilers: clang 18, libc++ 18, glibc 2.28: what is staged compiles"
}

# Not over Microsoft's own library, though it is public: it includes headers of the compiler (vcruntime.h and others) that come
# with Visual Studio alone, and may not be passed on. So branches for _MSC_VER are not compiled here; those for _WIN32 are.
windows() {
  local ucrt=(--target=x86_64-w64-windows-gnu -fms-extensions -fms-compatibility -fms-compatibility-version=19.34 -fgnuc-version=4.2.1
    -nostdlibinc -isystem /usr/lib/llvm-16/include/c++/v1 -isystem "$libc/any-windows-any" -D_UCRT -DUNICODE -D_UNICODE)
  only=syntax plugin=joined everything windows "clang 16 in Microsoft's dialect, libc++ 16, Windows' C library" \
    $ccache clang++-16 "${ucrt[@]}" "${common[@]}" "${warnings[@]}"
}

macos() {
  local target=aarch64-macos
  compile "$build/$target" "$zig" c++ -target "$target" -fPIC "${common[@]}" "${warnings[@]}" -DCONSAC_ALL_WARNINGS "${parts[@]}" -- "${staged_sources[@]}"
  echo "unreal_compilers: what is staged compiles for $target"
  meanwhile "it links for $target; nothing of it was run" \
    "$zig" c++ -target "$target" -g0 -shared -o "$build/$target/libconsac.dylib" "$build/$target"/*.o
}

# zig's libc++ is its own, and so has everything on every macOS. Apple's is the system's: it says of each function which macOS
# brought it, and a call of one that is younger than the oldest macOS a program starts on is an error (std::to_chars of a float: 13.3).
macos11() {
  mkdir -p "$build/apple"
  printf '%s\n' '#include_next <__config_site>' '#undef _LIBCPP_HAS_NO_VENDOR_AVAILABILITY_ANNOTATIONS' \
    '#define NAN __builtin_nanf("")' '#define INFINITY __builtin_inff()' >"$build/apple/__config_site"  # a newer clang's float.h has these
  # The system's headers after the compiler's own, as in Apple's SDK.
  local apple=(--target=arm64-apple-macos11.0 -nostdlibinc -isystem "$build/apple" -isystem /usr/lib/llvm-16/include/c++/v1
    -idirafter "$libc/any-darwin-any")
  if echo '#include <charconv>
    char* Text(char* at, float value) { return std::to_chars(at, at + 32, value).ptr; }' |
    clang++-16 "${apple[@]}" "${common[@]}" -fsyntax-only -x c++ - 2>/dev/null; then
    echo "unreal_compilers: macos11: this libc++ takes what macOS 11 has not; the check below would prove nothing"
    return 1
  fi
  only=syntax plugin=joined everything macos11 "clang 16, libc++ 16, macOS 11" $ccache clang++-16 "${apple[@]}" "${common[@]}" "${warnings[@]}"
}

for one in "${what[@]}"; do
  case $one in
    linux|linux18|windows|macos|macos11) "$one" ;;
    *) echo "unreal_compilers: unknown '$one': linux, linux18, windows, macos, macos11, or nothing for all"; exit 2 ;;
  esac
done
failed=0
for link in "${links[@]}"; do wait "$link" || failed=1; done
exit "$failed"
