#!/usr/bin/env bash
# Takes the picture of each example of engines/godot that stands in its README: drawn by the real engine under Xvfb,
# without a graphics card, three seconds after the start, with the example's own rule playing.
#   tools/godot_screenshots.sh            all into engines/godot/examples/NAME/NAME.png
#   tools/godot_screenshots.sh FOLDER     all into FOLDER/NAME.png
# Needs tools/setup.sh godot. Exit codes: 0 made, 1 a picture failed, 3 no engine or no Xvfb.
set -euo pipefail
cd "$(dirname "$0")/.."
frames=180

engine=$(tools/godot.sh where)
command -v Xvfb >/dev/null || { echo "godot_screenshots: no Xvfb here: run tools/setup.sh godot" >&2; exit 3; }
target=""
if [ $# -gt 0 ]; then mkdir -p "$1"; target=$(cd "$1" && pwd); fi
work=$(mktemp -d)
Xvfb -displayfd 3 -screen 0 800x600x24 -nolisten tcp 3>"$work/display" >/dev/null 2>&1 &
server=$!
trap 'kill $server 2>/dev/null || true; rm -rf "$work"' EXIT
for _ in $(seq 100); do [ -s "$work/display" ] && break; sleep 0.1; done
display=:$(cat "$work/display")

cp -r engines/godot "$work/project"
export XDG_DATA_HOME=$work/data XDG_CONFIG_HOME=$work/config XDG_CACHE_HOME=$work/cache  # nobody's editor settings
run() { timeout 300 env DISPLAY="$display" "$engine/godot" --path "$work/project" "$@" >>"$work/log" 2>&1; }
run --headless --import || { tail -n 20 "$work/log" >&2; exit 1; }
for folder in engines/godot/examples/*/; do
  name=$(basename "$folder")
  [ -f "$folder/$name.tscn" ] || continue  # what the examples share
  if [ "$name" = yumi_reach ] && [ ! -f "$folder/yumi/twin.glb" ]; then
    echo "godot_screenshots: $name shows a twin that is not made yet: see ${folder}README.md" >&2
    exit 1
  fi
  mkdir "$work/$name"
  run --rendering-driver opengl3 --audio-driver Dummy --resolution 640x360 --fixed-fps 60 --quit-after $frames \
    --write-movie "$work/$name/frame.png" "res://examples/$name/$name.tscn" -- --consac-mode=by_hand || true
  picture=$(find "$work/$name" -name 'frame*.png' | sort | tail -n 1)
  if [ -z "$picture" ]; then
    tail -n 20 "$work/log" >&2
    echo "godot_screenshots: no picture of $name" >&2
    exit 1
  fi
  cp "$picture" "${target:-$folder}/$name.png"
  echo "godot_screenshots: ${target:-${folder%/}}/$name.png"
done
