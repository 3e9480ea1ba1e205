"""tools/release: what is said of a release's files without running them."""
import hashlib
import pathlib
import shutil
import struct
import sys
import zipfile

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from release import addon_trial, asks, godot, trial, wheel_trial  # noqa: E402
from release.running import Failed  # noqa: E402

LIBRARY = b"/usr/lib/libSystem.B.dylib\0\0\0\0\0\0"


def macho(signed):
    """The head of a program for macOS 11.0 that loads one library."""
    commands = [struct.pack("<6I", asks.DYLIB, 24 + len(LIBRARY), 24, 0, 0, 0) + LIBRARY, struct.pack("<6I", asks.BUILT_FOR, 24, 1, 11 << 16, 0, 0)]
    commands += [struct.pack("<4I", asks.SIGNATURE, 16, 0, 0)] if signed else []
    return asks.MACHO + struct.pack("<7I", 0, 0, 2, len(commands), 0, 0, 0) + b"".join(commands)


def packed(path, files):
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return path


def test_what_a_program_asks_for_is_read_from_it():
    said = asks.of(pathlib.Path(shutil.which("true")).read_bytes())
    assert said.startswith("libc.so.6") and "(glibc 2." in said
    assert asks.of(macho(True)) == "/usr/lib/libSystem.B.dylib (macOS 11.0, signed by the linker)"
    both = godot.universal({"macos-arm64": macho(True), "macos-x86_64": macho(False)})
    assert asks.of(both) == "/usr/lib/libSystem.B.dylib (macOS 11.0, signed by the linker); /usr/lib/libSystem.B.dylib (macOS 11.0, no signature)"
    with pytest.raises(Failed, match="no program of a known system"):
        asks.of(b"#!/bin/sh")


def test_a_zip_that_carries_another_program_fails(tmp_path):
    path = packed(tmp_path / "x.zip", {"Consac/Programs/Linux/consac": b"one", "Consac/Programs/Win64/consac.exe": b"two", "Consac/consac.txt": b"none"})
    assert addon_trial.carried(path, {"a.tar.gz": b"one", "b.zip": b"two"}) == "2, those of the archives above"
    assert addon_trial.carried(packed(tmp_path / "empty.zip", {"Consac/file": b""}), {}) == "FAILED: none inside"
    assert addon_trial.carried(path, {"a.tar.gz": b"one"}) == "FAILED: of no archive here: Consac/Programs/Win64/consac.exe"


def test_a_zip_that_is_not_as_its_manifest_says_fails(tmp_path):
    row = f"{hashlib.sha256(b'text').hexdigest()}  file\n"
    assert addon_trial.unreal(packed(tmp_path / "x.zip", {"Consac/file": b"text", "Consac/MANIFEST.sha256": row})) == "1 files as its manifest says"
    assert addon_trial.unreal(packed(tmp_path / "y.zip", {"Consac/file": b"other", "Consac/MANIFEST.sha256": row})).startswith("FAILED: not as its manifest says: ['file']")
    assert addon_trial.unreal(packed(tmp_path / "w.zip", {"Consac/file": b"text"})) == "FAILED: it has no manifest"
    more = packed(tmp_path / "z.zip", {"Consac/file": b"text", "Consac/more": b"", "Consac/MANIFEST.sha256": row})
    assert addon_trial.unreal(more) == "FAILED: not as its manifest says: ['more']"


def test_an_archive_without_its_program_ends_no_trial(tmp_path, capsys):
    packed(tmp_path / "consac-1-windows-x86_64.zip", {"consac-1/consac.exe": b"one"})
    packed(tmp_path / "consac-2-windows-x86_64.zip", {"consac-2/README": b""})
    (tmp_path / "consac-3-windows-x86_64.zip").write_bytes(b"cut off")
    found = trial.programs_of(tmp_path, tmp_path / "scratch")
    assert found == {"consac-1-windows-x86_64.zip": b"one", "consac-2-windows-x86_64.zip": b"", "consac-3-windows-x86_64.zip": b""}
    assert "| consac-2-windows-x86_64.zip | 0.00 | FAILED: no program of a known system" in trial.asked(found)
    assert "consac-2-windows-x86_64.zip | FAILED: there is no program inside" in capsys.readouterr().out
    assert "| x | 0.00 | FAILED: no program of a known system" in trial.asked({"x": b"#!/bin/sh"})


def test_a_wheel_that_carries_another_library_fails(tmp_path):
    path = packed(tmp_path / "x.whl", {"consac-1.data/scripts/consac.exe": b"one", "consac/lib/consac.dll": b"two", "consac/native.py": b""})
    assert wheel_trial.carried(path, {"p.zip": b"one", "c.zip": b"two"}) == "that of p.zip, that of c.zip"
    assert wheel_trial.carried(path, {"p.zip": b"one"}) == "that of p.zip, FAILED: consac/lib/consac.dll is of no archive here"
    assert wheel_trial.carried(packed(tmp_path / "y.whl", {"consac/native.py": b""}), {}) == "none"


def test_places_that_trained_alike_are_told_together():
    rows = [["a", "here", "1.0", "yes", "f00d", "beef"], ["b", "there", "1.0", "yes", "f00d", "beef"], ["c", "there", "1.0", "yes", "f00d", "dead"],
            ["d", "", "FAILED: no archive", "", "", ""]]
    assert trial.who_agree(rows).splitlines()[3:] == ["- f00d and beef: a (here); b (there)", "- f00d and dead: c (there)"]
