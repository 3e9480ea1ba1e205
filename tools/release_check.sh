#!/usr/bin/env bash
# Tries what tools/release.sh has put into dist, and writes down what came of it.
#   tools/release_check.sh                      the programs for Linux in the roots of other systems, ARM64's by an emulator, Windows'
#                                               under Wine, consac-cad here; writes bench/results/release.md
#   tools/release_check.sh again [TARGET...]    compiles the programs once more from a clone in another folder, without ccache,
#                                               and compares the bytes (of linux-x86_64 and linux-aarch64 the library of consac.h)
# Roots are the required packages of a suite, unpacked and not set up: a C library, a shell, no Python. They come from the
# mirror that this machine uses itself, and are kept in build/release-roots. Needs to be root (debootstrap, chroot).
set -euo pipefail
cd "$(dirname "$0")/.."
roots=$PWD/build/release-roots
suites=(bullseye:amd64 bookworm:amd64 testing:amd64 bookworm:arm64)

root_of() {
  local suite=${1%:*} architecture=${1#*:} folder=$roots/${1/:/-} mirror
  if [ -e "$folder/whole" ]; then return; fi
  mirror=$(sed -n 's/^URIs: *//p; s/^deb \(\[[^]]*\] \)\?\([^ ]*\) .*/\2/p' /etc/apt/sources.list.d/debian.sources /etc/apt/sources.list 2>/dev/null | head -n 1)
  echo "release_check: unpacking Debian $suite for $architecture"
  rm -rf "$folder"
  mkdir -p "$roots"
  if debootstrap --foreign --variant=minbase --arch="$architecture" "$suite" "$folder" "${mirror:-no mirror here}" >"$folder.log" 2>&1; then
    touch "$folder/whole"
  else
    echo "release_check: Debian $suite for $architecture cannot be had here: $(tail -n 1 "$folder.log")"
  fi
}

# again TARGET...: two folders, the same bytes. Without ccache, which would give the first's objects.
again() {
  local other target program made said differs=0
  other=$(mktemp -d)
  trap "rm -rf '$other'" EXIT
  git clone -q . "$other/another-folder"
  ln -s "$PWD/.venv" "$other/another-folder/.venv"
  mkdir -p "$other/another-folder/build/windows-needs"
  cp build/windows-needs/*.orig.tar.* "$other/another-folder/build/windows-needs"
  for target in "$@"; do
    case $target in linux-x86_64 | linux-aarch64) made=consac_c ;; *) made=consac ;; esac  # those have no program
    (cd "$other/another-folder" && CCACHE_DISABLE=1 tools/cross.sh "$target" "$made") | tail -n 1
    for program in build/cross-"$target"/{cli/consac{,.exe},engines/c/libconsac.so.[0-9]*.[0-9]*}; do
      [ -f "$program" ] || continue
      if cmp "$program" "$other/another-folder/$program"; then
        echo "release_check: $target: the same bytes in another folder"
        said="the same bytes, $(sha256sum <"$program" | cut -c1-16)"
      else
        differs=1 said="FAILED: other bytes"
      fi
      mkdir -p build/release-notes
      echo "- $target, ${program##*/}, commit $(git describe --always --abbrev=12): $said" >>build/release-notes/again.md
    done
  done
  return $differs
}

if [ "${1:-}" = again ]; then
  shift
  [ $# -gt 0 ] || set -- linux-x86_64-musl linux-aarch64-musl windows-x86_64 macos-arm64 macos-x86_64
  again "$@"
  exit
fi
tools/setup.sh release-check
for suite in "${suites[@]}"; do root_of "$suite"; done
python3 tools/release/trial.py dist "$roots" bench/results/release.md
