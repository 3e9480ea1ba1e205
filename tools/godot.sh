#!/usr/bin/env bash
# Fetches the engine Godot 4 (editor binary and release template) for tests and examples, without installing anything.
#   tools/godot.sh           fetch it unless it is there; prints its version and its folder
#   tools/godot.sh where     only print the folder; exit code 3 when it is not there
#   tools/godot.sh refresh   fetch it anew
# The packages are Debian's, of a suite newer than Debian 12, so they are unpacked beside the system with the C library
# that they were built for. They come from the mirror that this machine uses itself. The folder is $CONSAC_GODOT_CACHE,
# or ~/.cache/consac/godot, and then holds:
#   godot                     the editor binary:  godot --headless --path PROJECT
#   godot-template            the release template: a copy named X is the game in X.pck (tools/godot_export.sh)
#   gdextension_interface.h, extension_api.json   what a native extension is built against
#   version                   one line
# Exit codes: 0 ready, 2 usage or a folder of somebody else's, 3 not there (and, unless asked `where`, it cannot be fetched).
set -euo pipefail

cache=${CONSAC_GODOT_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/consac/godot}
cache=$(realpath -ms -- "$cache")
fresh=$cache.new
suites=(testing sid)
packages=(godot godot-template-release patchelf libgl1 libegl1 libgl1-mesa-dri)  # Mesa draws without a graphics card

fail() { printf 'godot: %s\n' "$*" >&2; exit 3; }
ready() { grep -qs '^Godot' "$cache/version"; }
report() { printf 'godot: %s in %s\n' "$(cat "$cache/version")" "$cache"; }

# Whatever is deleted here was made here: a whole fetch has `version`, one that broke off the status of a private apt.
check_own() {
  local folder
  for folder in "$cache" "$fresh"; do
    [ -e "$folder" ] && [ -n "$(ls -A "$folder")" ] || continue
    grep -qs '^Godot' "$folder/version" || [ -f "$folder/apt/status" ] && continue
    echo "godot: $folder holds something else; set CONSAC_GODOT_CACHE to a folder that is empty or does not exist" >&2
    exit 2
  done
}

# The address from which this machine takes its own release of Debian.
mirror() {
  local release
  release=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
  apt-get indextargets --format '$(REPO_URI) $(RELEASE)' |
    awk -v release="$release" '$2 == release && !found { print $1; found = 1 }'
}

# apt with sources, lists and a status of its own: it believes that nothing is installed, so it takes every library too.
private_apt() {
  apt-get -qq -o Dir::Etc::sourcelist="$fresh/apt/sources.list" -o Dir::Etc::sourceparts=/dev/null \
    -o Dir::Etc::preferences=/dev/null -o Dir::Etc::preferencesparts=/dev/null -o Dir::State="$fresh/apt" \
    -o Dir::State::lists="$fresh/apt/lists" -o Dir::State::status="$fresh/apt/status" -o Dir::Cache="$fresh/apt/cache" \
    -o Debug::NoLocking=1 -o APT::Sandbox::User= -o APT::Install-Recommends=0 -o Acquire::Languages=none \
    -o Acquire::Retries=3 -o Acquire::http::Timeout=30 "$@"
}

download() {
  local from=$1 suite why
  for suite in "${suites[@]}"; do
    rm -rf "$fresh/apt"
    mkdir -p "$fresh/apt/lists/partial" "$fresh/apt/cache/archives/partial"
    : >"$fresh/apt/status"
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $from $suite main" >"$fresh/apt/sources.list"
    echo "godot: fetching ${packages[0]} of $suite"
    if private_apt update >"$fresh/log" 2>&1 && grep -q . "$fresh"/apt/lists/*Packages* 2>/dev/null \
      && private_apt install --download-only --yes "${packages[@]}" >>"$fresh/log" 2>&1; then
      return
    fi
  done
  why=$(grep '^[EW]:' "$fresh/log" | head -n 1)
  fail "cannot fetch ${packages[0]} of ${suites[*]} from this machine's Debian mirror: $why (log: $fresh/log)"
}

# The two programs get the place of their own C library and libraries written into them: that after the rename.
unpack() {
  local deb program library own loader libraries
  for deb in "$fresh"/apt/cache/archives/*.deb; do dpkg-deb -x "$deb" "$fresh/tree"; done
  own=usr/lib/$(basename "$(dirname "$(find "$fresh/tree/usr/lib" -name libc.so.6 | head -n 1)")")
  loader=$(cd "$fresh/tree" && find "$own" -name 'ld-linux*' | head -n 1)
  [ -n "$loader" ] || fail "the packages hold no loader ld-linux any more"
  libraries=$cache/tree/$own:$cache/tree/$own/pulseaudio
  patch() { "$fresh/tree/$loader" --library-path "$fresh/tree/$own" "$fresh/tree/usr/bin/patchelf" "$@"; }
  for program in godot godot-template-release; do
    [ -x "$fresh/tree/usr/bin/$program" ] || fail "the package $program does not hold usr/bin/$program any more"
    patch --set-interpreter "$cache/tree/$loader" --force-rpath --set-rpath "$libraries" "$fresh/tree/usr/bin/$program"
  done
  # A library that says where it looks itself would look in the system.
  find "$fresh/tree/$own" -name '*.so*' -type f | while read -r library; do
    [ -z "$(patch --print-rpath "$library" 2>/dev/null)" ] || patch --force-rpath --set-rpath "$libraries" "$library"
  done
  ln -s tree/usr/bin/godot-template-release "$fresh/godot-template"
  cat >"$fresh/godot" <<WRAPPER
#!/bin/sh
export LIBGL_DRIVERS_PATH='$cache/tree/$own/dri' __EGL_VENDOR_LIBRARY_DIRS='$cache/tree/usr/share/glvnd/egl_vendor.d'
exec '$cache/tree/usr/bin/godot' "\$@"
WRAPPER
  chmod +x "$fresh/godot"
  # Its own settings belong to nobody, so a dump never sees a person's.
  mkdir "$fresh/dump"
  (cd "$fresh/dump" && for dump in --dump-gdextension-interface --dump-extension-api; do
    HOME=$PWD XDG_DATA_HOME=$PWD/d XDG_CONFIG_HOME=$PWD/d XDG_CACHE_HOME=$PWD/d "$fresh/tree/$loader" \
      --library-path "$fresh/tree/$own:$fresh/tree/$own/pulseaudio" "$fresh/tree/usr/bin/godot" --headless $dump
  done) >>"$fresh/log" 2>&1 || true
  mv "$fresh/dump/gdextension_interface.h" "$fresh/dump/extension_api.json" "$fresh" 2>/dev/null ||
    fail "the unpacked engine does not start (log: $fresh/log)"
}

command=${1:-fetch}
case $command in
  where) ready || fail "not fetched yet: run tools/godot.sh"; echo "$cache"; exit ;;
  fetch) if ready; then report; exit; fi ;;
  refresh) ;;
  *) echo "usage: tools/godot.sh [where|refresh]" >&2; exit 2 ;;
esac

check_own
command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null || fail "this is no Debian: install Godot 4 by hand"
from=$(mirror)
[ -n "$from" ] || fail "apt names no mirror for this machine's release of Debian"
mkdir -p "$(dirname "$cache")"
exec 9>"$cache.lock"
flock 9  # two sessions that start at once fetch it once
if [ "$command" = fetch ] && ready; then report; exit; fi
check_own  # again: all that came between is waiting
rm -rf "$fresh"
mkdir -p "$fresh"
download "$from"
unpack
sed -n 's/.*"version_full_name": "\(.*\)".*/\1/p' "$fresh/extension_api.json" | head -n 1 >"$fresh/version"
[ -s "$fresh/version" ] || fail "extension_api.json names no version (in $fresh)"
rm -rf "$fresh/apt" "$fresh/dump" "$cache"
mv "$fresh" "$cache"
report
