"""tools/godot.sh deletes nothing but what it made itself; tools/godot_export.sh says why it could not. Needs no engine and no network."""
import os
import subprocess

import pytest

from engine import DEADLINE_S, ROOT


def refresh(folder, tmp_path):
    """Its exit code and what it said, with an apt that knows no mirror: so far and no further."""
    programs = tmp_path / "programs"
    programs.mkdir(exist_ok=True)
    (programs / "apt-get").write_text("#!/bin/sh\nexit 0\n")
    (programs / "apt-get").chmod(0o755)
    done = subprocess.run([ROOT / "tools/godot.sh", "refresh"], capture_output=True, text=True, timeout=DEADLINE_S, cwd=tmp_path,
                          env={**os.environ, "CONSAC_GODOT_CACHE": str(folder), "PATH": f"{programs}:{os.environ['PATH']}"})
    return done.returncode, done.stderr


@pytest.mark.parametrize("name, suffix", [("home", ""), ("home", "/"), ("home.new", ""), ("home", "/../home")])
def test_a_folder_of_somebody_else_is_not_touched(tmp_path, name, suffix):
    letter = tmp_path / name / "letter"
    letter.parent.mkdir()
    letter.write_text("dear")
    (letter.parent / "version").write_text("2.1\n")
    code, said = refresh(f"{tmp_path}/home{suffix}", tmp_path)
    assert code == 2 and said.count("\n") == 1 and f"{letter.parent} holds something else" in said
    assert letter.read_text() == "dear"


@pytest.mark.parametrize("file, text", [(None, ""), ("home/version", "Godot Engine v4.6\n"), ("home.new/apt/status", "")])
def test_its_own_folders_and_empty_ones_are_taken(tmp_path, file, text):
    (tmp_path / "home").mkdir()
    if file:
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text)
    code, said = refresh(tmp_path / "home", tmp_path)
    assert code == 3 and "apt names no mirror" in said  # it went on, as far as this apt lets it


def export(tmp_path, engine, **environment):
    """Exit code and what it said, with an engine that is a script, of a project whose folder for the extension is empty."""
    cache, project = tmp_path / "cache", tmp_path / "own"
    for folder in (cache, project / "addons/consac/bin"):
        folder.mkdir(parents=True)
    (cache / "version").write_text("Godot Engine v4.6\n")
    (cache / "godot-template").write_text("")
    (cache / "godot").write_text(f'#!/bin/sh\neval pack=\\$$#\n{engine}\n')  # its last argument: what is to be made
    (cache / "godot").chmod(0o755)
    (project / "project.godot").write_text('run/main_scene=""\n')
    (project / "one.tscn").write_text("")
    done = subprocess.run([ROOT / "tools/godot_export.sh", "res://one.tscn", tmp_path / "games", project], capture_output=True,
                          text=True, timeout=DEADLINE_S, env={**os.environ, "CONSAC_GODOT_CACHE": str(cache), **environment})
    return done.returncode, done.stdout + done.stderr


MAKES = 'case $pack in *.pck) echo game >"$pack" ;; esac'


def test_a_game_is_made_without_the_extension(tmp_path):
    code, said = export(tmp_path, MAKES)
    assert code == 0 and said == f"godot_export: {tmp_path}/games/one\n", said
    assert sorted(path.name for path in (tmp_path / "games").iterdir()) == ["one", "one.pck"]


@pytest.mark.parametrize("engine, why", [
    ("exit 7", "(exit code 7)"), ("echo ERROR: no preset; echo ERROR: two", "(exit code 0; ERROR: no preset)"),
    ("exec sleep 60", "(it was not done after 0.2 s (CONSAC_GODOT_EXPORT_S sets another time))"),
])
def test_an_export_that_failed_says_why(tmp_path, engine, why):
    code, said = export(tmp_path, engine, CONSAC_GODOT_EXPORT_S="0.2" if "sleep" in engine else "60")
    assert code == 1 and said.splitlines()[-1] == "godot_export: the engine could not do: --import " + why, said
