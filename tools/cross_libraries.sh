# The libraries that CONSAC stands on, for Windows, static, into $prefix with a licence of each in $prefix/licenses.
# Definitions alone, sourced by tools/windows.sh (whose $needs, $prefix and $toolchain they use) and by tools/setup.sh,
# which fetches the sources. A library is built once, and again when its source or its recipe here has changed.

# Debian's source packages, in the order to build them; the program needs all, the libraries of CONSAC only the first.
windows_plain=(highway fmtlib yaml-cpp pugixml)
windows_pictures=(libpng1.6 pixman cairo)
windows_sources=("${windows_plain[@]}" "${windows_pictures[@]}")
# Debian's packages of headers alone: copied, since /usr/include itself holds another system's.
windows_headers=(libeigen3-dev libasio-dev libfast-float-dev nlohmann-json3-dev libcli11-dev)

# build_library NAME: runs build_NAME in a shell of its own, with a log.
build_library() {
  local name=$1 log=$needs/$1.log stamp=$needs/done/$1 recipe failed=0
  recipe=$(declare -f "build_$name" by_cmake by_configure licence; source_of "$name" || true; cat cmake/mingw.cmake
    dpkg-query -W -f='${Package} ${Version}\n' g++-mingw-w64-x86-64-posix libz-mingw-w64-dev "${windows_headers[@]}")
  if [ -f "$stamp" ] && [ "$recipe" = "$(cat "$stamp")" ]; then return; fi
  mkdir -p "$needs/done" "$prefix/licenses"
  rm -rf "${needs:?}/$name" "$needs/build-$name"
  set +e
  (set -e; unpack "$name"; "build_$name") >"$log" 2>&1
  failed=$?
  set -e
  if [ "$failed" -ne 0 ]; then
    tail -n 30 "$log"
    echo "windows: $name does not build; the whole log is $log"
    exit 1
  fi
  printf '%s\n' "$recipe" >"$stamp"
  echo "windows: $name is in its place"
}

# source_of NAME: its archive, which may have a signature beside it.
source_of() { find "$needs" -maxdepth 1 -name "$1_*.orig.tar.?z*" ! -name '*.asc' | sort -V | tail -n 1 | grep .; }

unpack() {
  local archive
  archive=$(source_of "$1") || return 0  # not one of the sources
  mkdir -p "$needs/$1"
  tar -xf "$archive" -C "$needs/$1" --strip-components=1
}

# by_cmake NAME SOURCE OPTION...
by_cmake() {
  local name=$1 source=$2
  cmake -S "$source" -B "$needs/build-$name" "${toolchain[@]}" -DCMAKE_INSTALL_PREFIX="$prefix" -DBUILD_SHARED_LIBS=OFF -Wno-dev "${@:3}"
  cmake --build "$needs/build-$name" -j "$(nproc)" --target install
}

# by_configure NAME FOLDER OPTION...: only what is in one folder of the source. Less optimised: pictures are small. Without
# GCC's checked copies, which stand in one more library.
by_configure() {
  local name=$1 folder=$2
  mkdir -p "$needs/build-$name"
  cd "$needs/build-$name"
  export CONFIG_SHELL=/bin/sh  # the faster shell
  PKG_CONFIG_LIBDIR=$prefix/lib/pkgconfig "$CONFIG_SHELL" "../$name/configure" --host=x86_64-w64-mingw32 --prefix="$prefix" \
    CC="${CONSAC_COMPILER_LAUNCHER:-} x86_64-w64-mingw32-gcc-posix" CFLAGS="-O1 -w -Wp,-U_FORTIFY_SOURCE -Wa,-muse-unaligned-vector-move" \
    --enable-static --disable-shared --disable-dependency-tracking "${@:3}"
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

# Debian's own for Windows; without its DLL, which would be taken first.
build_zlib() {
  local from=/usr/x86_64-w64-mingw32
  mkdir -p "$prefix/include" "$prefix/lib/pkgconfig"
  cp "$from"/include/{zlib,zconf}.h "$prefix/include/"
  cp "$from/lib/libz.a" "$prefix/lib/"
  sed "s|^prefix=.*|prefix=$prefix|; s|$from|\${prefix}|" "$from/lib/pkgconfig/zlib.pc" >"$prefix/lib/pkgconfig/zlib.pc"
  licence zlib /usr/share/doc/libz-mingw-w64-dev/copyright
}

build_libpng1.6() {
  by_cmake libpng1.6 "$needs/libpng1.6" -DPNG_SHARED=OFF -DPNG_TESTS=OFF -DPNG_EXECUTABLES=OFF
  licence libpng "$needs/libpng1.6/LICENSE"
}

build_pixman() {
  by_configure pixman pixman --disable-gtk --disable-libpng --disable-openmp
  make install-pkgconfigDATA
  licence pixman "$needs/pixman/COPYING"
}

# Pictures to PNG and SVG, text by Windows' own fonts, and nothing else.
build_cairo() {
  by_configure cairo src CPPFLAGS=-DCAIRO_WIN32_STATIC_BUILD --enable-svg=yes --enable-png=yes --enable-win32=yes --enable-win32-font=yes \
    --disable-{ft,fc,gobject,xlib,xcb,ps,pdf,script,tee,xml,interpreter,trace,valgrind,gtk-doc}
  sed -i 's/^Libs.private:.*/& -lgdi32 -lmsimg32/' "$prefix/lib/pkgconfig/cairo.pc"
  licence cairo "$needs"/cairo/COPYING{,-MPL-1.1,-LGPL-2.1}
}

build_headers() {
  local package name
  for package in "${windows_headers[@]}"; do
    dpkg -L "$package" | grep -E '^/usr/(include|share/(cmake|eigen3))/' | while read -r name; do
      [ -d "$name" ] || printf '%s\n' "${name#/usr/}"
    done | (cd /usr && xargs cp --parents -t "$prefix")
    name=${package#lib}
    licence "${name%-dev}" "/usr/share/doc/$package/copyright"
  done
}

# What the compiler itself puts into every program: GCC's runtime, the C runtime's stubs and winpthreads.
build_runtime() {
  licence gcc-runtime /usr/share/doc/gcc-mingw-w64-base/copyright
  licence mingw-w64-runtime /usr/share/doc/mingw-w64-common/copyright
}

build_googletest() { by_cmake googletest /usr/src/googletest; }
