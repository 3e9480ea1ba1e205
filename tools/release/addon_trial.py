"""The zips for Unreal and Godot: whose programs they carry, and whether the real Godot loads the extension; a part of trial.py."""
import hashlib
import pathlib
import re
import subprocess
import zipfile

from .running import Failed, run, the

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEAD = """
## What engines take

| what | its programs | what was seen |
|---|---|---|
"""
PROJECT = """config_version=5
[application]
config/name="trial"
[editor_plugins]
enabled=PackedStringArray("res://addons/consac/plugin.cfg")
"""
ASKS = """extends SceneTree
func _init() -> void:
\tprint("trial: ", " ".join(["ConsacWorld", "ConsacModel"].filter(func(name): return ClassDB.can_instantiate(name))))
\tquit()
"""


def carried(archive: pathlib.Path, programs: dict[str, bytes]) -> str:
    """How many of the programs inside are those of the archives, which have been tried on their own."""
    with zipfile.ZipFile(archive) as opened:
        inside = {name: opened.read(name) for name in opened.namelist() if re.search(r"/consac(\.exe)?$", name)}
    if not inside:
        return "FAILED: none inside"
    odd = [name for name, text in inside.items() if text not in programs.values()]
    return f"FAILED: of no archive here: {', '.join(odd)}" if odd else f"{len(inside)}, those of the archives above"


def unreal(archive: pathlib.Path) -> str:
    """Its own manifest: the only thing that can be looked at where there is no engine."""
    with zipfile.ZipFile(archive) as opened:
        if "Consac/MANIFEST.sha256" not in opened.namelist():
            return "FAILED: it has no manifest"
        rows = [line.split("  ", 1) for line in opened.read("Consac/MANIFEST.sha256").decode().splitlines()]
        inside = {name.removeprefix("Consac/") for name in opened.namelist()} - {"MANIFEST.sha256"}
        wrong = sorted(inside ^ {name for _, name in rows})
        wrong += [name for digest, name in rows if name in inside and hashlib.sha256(opened.read(f"Consac/{name}")).hexdigest() != digest]
    return f"FAILED: not as its manifest says: {wrong}" if wrong else f"{len(rows)} files as its manifest says"


def godot(archive: pathlib.Path, scratch: pathlib.Path) -> str:
    """Unpacked into a new project, as the asset library does it."""
    asked = subprocess.run([ROOT / "tools/godot.sh", "where"], capture_output=True, text=True)
    if asked.returncode:
        raise Failed("no Godot here; run tools/godot.sh")
    engine, project = asked.stdout.strip() + "/godot", scratch / "godot"
    with zipfile.ZipFile(archive) as opened:
        opened.extractall(project)
    (project / "project.godot").write_text(PROJECT)
    (project / "ask.gd").write_text(ASKS)
    # An editor without a window that meets an extension for the first time may crash when it ends (Godot's issue 111048).
    (project / ".godot").mkdir()
    (project / ".godot/extension_list.cfg").write_text("res://addons/consac/bin/consac.gdextension\n")
    run([engine, "--headless", "--path", str(project), "--import"], project)
    told = run([engine, "--headless", "--path", str(project), "--script", "res://ask.gd"], project)
    version = run([engine, "--version"], project).strip()
    found = re.search(r"^trial: ConsacWorld ConsacModel$", told, re.M)
    return f"Godot {version} loads the extension for linux-x86_64" if found else f"FAILED: Godot {version} does not know its classes: {told.split()[-20:]}"


def page(dist: pathlib.Path, scratch: pathlib.Path, programs: dict[str, bytes]) -> str:
    text = HEAD
    unreals = sorted(dist.glob("Consac-*-UE*.zip")) or [dist / "Consac-VERSION-UE5.x.zip"]
    for archive in (*unreals, next(dist.glob("consac-godot-*.zip"), dist / "consac-godot-VERSION.zip")):
        try:
            the(dist, archive.name)
            seen = godot(archive, scratch) if "godot" in archive.name else unreal(archive)
            row = [archive.name, carried(archive, programs), seen]
        except Failed as error:
            row = [archive.name, "", f"FAILED: {error}"]
        print("release_check: " + " | ".join(row), flush=True)
        text += f"| {' | '.join(row)} |\n"
    return text
