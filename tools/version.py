#!/usr/bin/env python3
"""The version of CONSAC: core/include/consac/base/version.h has it, CMake reads it there, and the files of PLACES, whose formats want a
number of their own, repeat it.

    tools/version.py          print it
    tools/version.py 0.3.0    raise it: the header and every place that repeats it
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
HEADER = "core/include/consac/base/version.h"
# What stands before the number, and the number.
PLACES = {
    HEADER: r'(kVersion = ")([^"]+)',
    "python/consac/__init__.py": r'(__version__ = ")([^"]+)',
    "engines/unreal/Consac/Consac.uplugin": r'("VersionName": ")([^"]+)',
    "engines/godot/addons/consac/plugin.cfg": r'(^version=")([^"]+)',
    "ports/consac/vcpkg.json": r'("version": ")([^"]+)',
    "spec/model_file.md": r'("producer": \{"name": "consac", "version": ")([^"]+)',
    "CHANGELOG.md": r"(^## )(\S+)",
}


def at(root: pathlib.Path, place: str) -> str:
    """The version that one place names."""
    found = re.search(PLACES[place], (root / place).read_text(encoding="utf-8"), re.M)
    if not found:
        raise SystemExit(f"version: {place} names none; it is looked for by {PLACES[place]}")
    return found[2]


def version_of(root: pathlib.Path) -> str:
    return at(root, HEADER)


def raised(place: str, text: str, version: str) -> str:
    """What a place says then. The changes of a version that is released keep their heading."""
    if place == "CHANGELOG.md" and not re.search(r"^## .*", text, re.M)[0].endswith("(unreleased)"):
        return re.sub(r"^## ", f"## {version} (unreleased)\n\n### Changed\n\n## ", text, count=1, flags=re.M)
    return re.sub(PLACES[place], rf"\g<1>{version}", text, count=1, flags=re.M)


def raise_to(root: pathlib.Path, version: str) -> None:
    for place in PLACES:
        if at(root, place) != version:
            text = (root / place).read_text(encoding="utf-8")
            (root / place).write_text(raised(place, text, version), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    if len(sys.argv) > 2 or (len(sys.argv) == 2 and not re.fullmatch(r"\d+\.\d+\.\d+", sys.argv[1])):
        sys.exit("version: give one version of three numbers, as 0.3.0, or nothing to print the one there is")
    if len(sys.argv) == 2:
        raise_to(ROOT, sys.argv[1])
    print(version_of(ROOT))
