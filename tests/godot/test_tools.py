"""tools/godot.sh deletes nothing but what it made itself. Needs no engine and no network."""
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
