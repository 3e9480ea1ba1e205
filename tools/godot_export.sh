#!/usr/bin/env bash
# Makes a game of one scene: FOLDER/NAME (the release template) and FOLDER/NAME.pck beside it.
#   tools/godot_export.sh road build/games                        an example of engines/godot
#   tools/godot_export.sh res://levels/one.tscn build/games PROJECT   a scene of any project; NAME is the scene's, "one"
# Files of the project that end in .consac (models) go along. The game takes the same arguments as a scene in the editor
# binary, for instance:  build/games/road --headless -- --consac-port=0
# Exit codes: 0 made, 1 the export failed, 2 usage, 3 no engine (tools/godot.sh fetches it).
set -euo pipefail
mkdir -p "${2:-.}"
folder=$(cd "${2:-.}" && pwd)
own=""
if [ $# -eq 3 ]; then own=$(cd "$3" && pwd); fi
cd "$(dirname "$0")/.."
source=${own:-engines/godot}
scene=${1:-}
case $scene in res://*) ;; *) scene=res://examples/$scene/$scene.tscn ;; esac

if [ $# -lt 2 ] || [ $# -gt 3 ] || [ ! -f "$source/${scene#res://}" ] || [ ! -f "$source/project.godot" ]; then
  echo "usage: tools/godot_export.sh EXAMPLE FOLDER, or SCENE FOLDER PROJECT; examples: $(cd engines/godot/examples && echo *)" >&2
  exit 2
fi
name=$(basename "$scene" .tscn)
engine=$(tools/godot.sh where)

# A copy, so that the project of whoever has it open stays as it is: the example becomes what the game starts with.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp -r "$source" "$work/project"
rm -rf "$work/project/.godot"  # what an editor knows of another state
if [ -f "$source/addons/consac/bin/consac.gdextension" ]; then
  # An editor without a window that meets an extension for the first time may crash when it ends (Godot's issue 111048).
  mkdir "$work/project/.godot"
  echo res://addons/consac/bin/consac.gdextension >"$work/project/.godot/extension_list.cfg"
fi
sed -i "s|^run/main_scene=.*|run/main_scene=\"$scene\"|" "$work/project/project.godot"
export XDG_DATA_HOME=$work/data XDG_CONFIG_HOME=$work/config XDG_CACHE_HOME=$work/cache  # nobody's editor settings
limit_s=${CONSAC_GODOT_EXPORT_S:-300}  # for each of the engine's two runs
run() {
  local code=0 why error
  timeout "$limit_s" "$engine/godot" --headless --path "$work/project" "$@" >"$work/log" 2>&1 || code=$?
  error=$(grep -m 1 '^\(SCRIPT \)\?ERROR' "$work/log" || true)
  if [ "$code" -eq 0 ] && [ -z "$error" ]; then return; fi
  tail -n 20 "$work/log" >&2
  why="exit code $code"
  if [ "$code" -eq 124 ]; then why="it was not done after $limit_s s (CONSAC_GODOT_EXPORT_S sets another time)"; fi
  echo "godot_export: the engine could not do: $* ($why${error:+; $error})" >&2
  exit 1
}
# A project of somebody's own may have no preset for Linux yet.
[ -f "$work/project/export_presets.cfg" ] || cp engines/godot/export_presets.cfg "$work/project"
run --import
run --export-pack Linux "$work/$name.pck"
cp -L "$engine/godot-template" "$folder/$name.part"
mv "$folder/$name.part" "$folder/$name"
mv "$work/$name.pck" "$folder/$name.pck"
for library in "$source"/addons/consac/bin/lib*; do  # the engine looks beside the game
  if [ -e "$library" ]; then cp "$library" "$folder"; fi
done
echo "godot_export: $folder/$name"
