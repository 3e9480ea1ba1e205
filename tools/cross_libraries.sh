# The systems that CONSAC is compiled for on this machine, and the libraries that it stands on there: static, into $prefix,
# with a licence of each in $prefix/licenses. Definitions alone, sourced by tools/cross.sh, tools/windows.sh and
# tools/setup.sh, which fetches the sources. A library is built once, and again when its source or its recipe here has changed.

# musl: a program of one file for every Linux. Without: glibc 2.17 of 2012 and later, for what others load (wheels, Godot).
cross_targets=(linux-x86_64-musl linux-aarch64-musl linux-x86_64 linux-aarch64 windows-x86_64 macos-arm64 macos-x86_64)

# Debian's source packages, in the order to build them; the program needs all, the libraries of CONSAC only the first.
cross_plain=(highway fmtlib yaml-cpp pugixml)
cross_pictures=(zlib libpng1.6 pixman cairo)
cross_sources=("${cross_plain[@]}" "${cross_pictures[@]}")
# Debian's packages of headers alone: copied, since /usr/include itself holds another system's.
cross_headers=(libeigen3-dev libasio-dev libfast-float-dev nlohmann-json3-dev libcli11-dev)

# choose_target TARGET: sets what the rest here, and a build, works with.
#   needs      folder of this target's libraries     prefix      where they are installed
#   toolchain  arguments for CMake                   configure   arguments for a configure script
#   compiler   what makes them be built again        fonts       cairo's arguments
#   made       what is compiled unless something else is asked for
choose_target() {
  target=$1
  archives=$PWD/build/windows-needs
  needs=$archives/$target
  prefix=$needs/prefix
  flags="-O1 -w -ffile-prefix-map=$PWD=."  # of C libraries that are configured; pictures are small
  fonts=(--disable-{win32,win32-font})     # cairo's own: letters drawn as lines
  made=consac
  mkdir -p "$needs"
  case $target in
    linux-x86_64-musl) by_zig x86_64-linux-musl ;;
    linux-aarch64-musl) by_zig aarch64-linux-musl ;;
    linux-x86_64) by_zig x86_64-linux-gnu.2.17 && loaded_alone ;;
    linux-aarch64) by_zig aarch64-linux-gnu.2.17 && loaded_alone ;;
    # Older libraries take a name that newer compilers define for a Macintosh of the nineties.
    macos-arm64) by_zig aarch64-macos.11.0 -fno-define-target-os-macros ;;
    macos-x86_64) by_zig x86_64-macos.11.0 -fno-define-target-os-macros ;;
    windows-x86_64) by_mingw ;;
    *) echo "cross: unknown target '$target': one of ${cross_targets[*]}"; exit 2 ;;
  esac
  toolchain+=(-G Ninja -DCONSAC_CROSS_PREFIX="$prefix" -DCMAKE_BUILD_TYPE=Release --log-level=WARNING
    -DCMAKE_C_COMPILER_LAUNCHER="${CONSAC_COMPILER_LAUNCHER:-}" -DCMAKE_CXX_COMPILER_LAUNCHER="${CONSAC_COMPILER_LAUNCHER:-}")
}

# No program, nor what that alone stands on.
loaded_alone() {
  cross_plain=(highway) cross_pictures=() made=consac_godot
  toolchain+=(-DCONSAC_BUILD_PROGRAM=OFF)
}

# Debian's compiler. Without GCC's checked copies, which stand in one more library.
by_mingw() {
  flags+=" -Wp,-U_FORTIFY_SOURCE -Wa,-muse-unaligned-vector-move"
  fonts=(CPPFLAGS=-DCAIRO_WIN32_STATIC_BUILD --enable-win32=yes --enable-win32-font=yes)  # Windows' own
  toolchain=(-DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/mingw.cmake")
  configure=(--host=x86_64-w64-mingw32 CC="${CONSAC_COMPILER_LAUNCHER:-} x86_64-w64-mingw32-gcc-posix" AR=x86_64-w64-mingw32-ar RANLIB=x86_64-w64-mingw32-ranlib)
  compiler=$(cat cmake/mingw.cmake; dpkg-query -W -f='${Package} ${Version}\n' g++-mingw-w64-x86-64-posix)
}

# by_zig TARGET OPTION...: zig, which brings each system's C library and clang's C++ library. By names that a configure script and CMake take for
# a compiler's, OPTIONs for C alone; its compiled libraries are kept in the user's cache, or where ZIG_GLOBAL_CACHE_DIR says.
by_zig() {
  local zig tool name=${1%%.*}
  zig=$(.venv/bin/python -c 'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).parent / "zig")')
  mkdir -p "$needs/bin"
  for tool in "cc -target $1 -fno-sanitize=undefined ${*:2}" "c++ -target $1 -fno-sanitize=undefined" ar ranlib; do
    printf '#!/bin/sh\n%s\nexec "%s" %s "$@"\n' \
      "export ZIG_LOCAL_CACHE_DIR='$needs/zig' ZIG_GLOBAL_CACHE_DIR=\"\${ZIG_GLOBAL_CACHE_DIR:-\${XDG_CACHE_HOME:-\$HOME/.cache}/consac-zig}\"" \
      "$zig" "$tool" >"$needs/bin/new"
    chmod +x "$needs/bin/new"
    cmp -s "$needs/bin/new" "$needs/bin/${tool%% *}" || cp "$needs/bin/new" "$needs/bin/${tool%% *}"
  done
  toolchain=(-DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/zig.cmake" -DCONSAC_CROSS_TARGET="$target" -DCONSAC_CROSS_COMPILERS="$needs/bin")
  configure=(--host="${name/macos/apple-darwin}" CC="${CONSAC_COMPILER_LAUNCHER:-} $needs/bin/cc" AR="$needs/bin/ar" RANLIB="$needs/bin/ranlib")
  compiler=$(cat cmake/zig.cmake; "$zig" version; echo "$@")
}

# build_libraries NAME...: what the program stands on, and those beside. Half of the work is scripts that look at the system,
# one after another: the pictures' libraries beside the others.
build_libraries() {
  local library plain
  for library in headers runtime; do build_library "$library"; done
  set -m  # in a group of its own: nothing of it outlives a failure of the others
  (for library in "${cross_plain[@]}" "$@"; do build_library "$library"; done) </dev/null &
  plain=$!
  set +m
  trap "kill -- -$plain 2>/dev/null && wait $plain || true" EXIT
  for library in "${cross_pictures[@]}"; do build_library "$library"; done
  wait "$plain"
  trap - EXIT
}

# build_library NAME: runs build_NAME in a shell of its own, with a log.
build_library() {
  local name=$1 log=$needs/$1.log stamp=$needs/done/$1 recipe failed=0
  recipe=$(declare -f "build_$name" by_cmake by_configure licence; source_of "$name" || true; echo "$compiler" "$flags" "${fonts[@]}"
    dpkg-query -W -f='${Package} ${Version}\n' "${cross_headers[@]}")
  if [ -f "$stamp" ] && [ "$recipe" = "$(cat "$stamp")" ]; then return; fi
  mkdir -p "$needs/done" "$prefix/licenses"
  rm -rf "${needs:?}/$name" "$needs/build-$name"
  set +e
  (set -e; unpack "$name"; "build_$name") >"$log" 2>&1
  failed=$?
  set -e
  if [ "$failed" -ne 0 ]; then
    tail -n 30 "$log"
    echo "$target: $name does not build; the whole log is $log"
    exit 1
  fi
  printf '%s\n' "$recipe" >"$stamp"
  echo "$target: $name is in its place"
}

# source_of NAME: its archive, which may have a signature beside it.
source_of() { find "$archives/" -maxdepth 1 -name "$1_*.orig.tar.?z*" ! -name '*.asc' | sort -V | tail -n 1 | grep .; }

unpack() {
  local archive
  archive=$(source_of "$1") || return 0  # not one of the sources
  mkdir -p "$needs/$1"
  tar -xf "$archive" -C "$needs/$1" --strip-components=1
}

# by_cmake NAME SOURCE OPTION...
by_cmake() {
  local name=$1 source=$2
  cmake -S "$source" -B "$needs/build-$name" "${toolchain[@]}" -DCMAKE_INSTALL_PREFIX="$prefix" -DCMAKE_INSTALL_LIBDIR=lib \
    -DBUILD_SHARED_LIBS=OFF -DCMAKE_POSITION_INDEPENDENT_CODE=ON -Wno-dev "${@:3}"
  cmake --build "$needs/build-$name" -j "$(nproc)" --target install
}

# by_configure NAME FOLDER OPTION...: only what is in one folder of the source.
by_configure() {
  local name=$1 folder=$2
  mkdir -p "$needs/build-$name"
  cd "$needs/build-$name"
  export CONFIG_SHELL=/bin/sh  # the faster shell
  PKG_CONFIG_LIBDIR=$prefix/lib/pkgconfig "$CONFIG_SHELL" "../$name/configure" --prefix="$prefix" "${configure[@]}" CFLAGS="$flags" \
    --enable-static --disable-shared --with-pic --disable-dependency-tracking "${@:3}"
  make -C "$folder" -j "$(nproc)" install
}

# licence NAME FILE...
licence() { cat "${@:2}" >"$prefix/licenses/$1.txt"; }

build_highway() {
  by_cmake highway "$needs/highway" -DBUILD_TESTING=OFF -DHWY_ENABLE_EXAMPLES=OFF -DHWY_ENABLE_CONTRIB=OFF -DHWY_ENABLE_TESTS=OFF
  licence highway "$needs/highway/LICENSE"
  mkdir -p "$prefix/lib/cmake/hwy"  # this version of Highway installs none
  cat >"$prefix/lib/cmake/hwy/hwy-config.cmake" <<'CONFIG'
add_library(hwy::hwy STATIC IMPORTED)
set_target_properties(hwy::hwy PROPERTIES IMPORTED_LOCATION ${CMAKE_CURRENT_LIST_DIR}/../../libhwy.a
                      INTERFACE_INCLUDE_DIRECTORIES ${CMAKE_CURRENT_LIST_DIR}/../../../include)
CONFIG
}

build_fmtlib() {
  by_cmake fmtlib "$needs/fmtlib" -DFMT_TEST=OFF -DFMT_DOC=OFF
  licence fmtlib "$needs/fmtlib/LICENSE.rst"
}

build_yaml-cpp() {
  by_cmake yaml-cpp "$needs/yaml-cpp" -DYAML_CPP_BUILD_TESTS=OFF -DYAML_CPP_BUILD_TOOLS=OFF -DYAML_CPP_BUILD_CONTRIB=OFF
  licence yaml-cpp "$needs/yaml-cpp/LICENSE"
}

build_pugixml() {
  by_cmake pugixml "$needs/pugixml" -DPUGIXML_BUILD_TESTS=OFF
  licence pugixml "$needs/pugixml/LICENSE.md"
}

# Its configure script is its own, and takes what others take as arguments from the environment.
build_zlib() {
  cd "$needs/zlib"
  env "${configure[@]:1}" CFLAGS="$flags -O2" ./configure --static --prefix="$prefix"
  make -j "$(nproc)" install
  licence zlib "$needs/zlib/LICENSE"
}

build_libpng1.6() {
  by_cmake libpng1.6 "$needs/libpng1.6" -DPNG_SHARED=OFF -DPNG_TESTS=OFF -DPNG_EXECUTABLES=OFF
  licence libpng "$needs/libpng1.6/LICENSE"
}

# Its assembler for ARM is not clang's.
build_pixman() {
  by_configure pixman pixman --disable-{gtk,libpng,openmp,arm-a64-neon}
  make install-pkgconfigDATA
  licence pixman "$needs/pixman/COPYING"
}

# Pictures to PNG and SVG, and nothing else. Its look at the order of a number's bytes finds none in what zig compiles.
build_cairo() {
  by_configure cairo src ax_cv_c_float_words_bigendian=no --enable-svg=yes --enable-png=yes "${fonts[@]}" \
    --disable-{ft,fc,quartz,quartz-font,gobject,xlib,xcb,ps,pdf,script,tee,xml,interpreter,trace,valgrind,gtk-doc}
  if [[ $target == windows-* ]]; then sed -i 's/^Libs.private:.*/& -lgdi32 -lmsimg32/' "$prefix/lib/pkgconfig/cairo.pc"; fi
  licence cairo "$needs"/cairo/COPYING{,-MPL-1.1,-LGPL-2.1}
}

build_headers() {
  local package name
  for package in "${cross_headers[@]}"; do
    dpkg -L "$package" | grep -E '^/usr/(include|share/(cmake|eigen3))/' | while read -r name; do
      [ -d "$name" ] || printf '%s\n' "${name#/usr/}"
    done | (cd /usr && xargs cp --parents -t "$prefix")
    name=${package#lib}
    licence "${name%-dev}" "/usr/share/doc/$package/copyright"
  done
}

# What the compiler itself puts into every program.
build_runtime() {
  local lib library
  if [[ $target == windows-* ]]; then  # GCC's runtime, the C runtime's stubs and winpthreads
    licence gcc-runtime /usr/share/doc/gcc-mingw-w64-base/copyright
    licence mingw-w64-runtime /usr/share/doc/mingw-w64-common/copyright
    return
  fi
  lib=$(.venv/bin/python -c 'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).parent)')
  licence zig-compiler-rt "$lib/LICENSE"
  for library in libcxx libcxxabi libunwind; do licence "$library" "$lib/lib/$library/LICENSE.TXT"; done
  if [[ $target == *-musl ]]; then licence musl "$lib/lib/libc/musl/COPYRIGHT"; fi
}

build_googletest() { by_cmake googletest /usr/src/googletest; }
