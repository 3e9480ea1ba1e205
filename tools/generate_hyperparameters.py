#!/usr/bin/env python3
"""Writes the engines' properties for hyperparameters from the program's own table.

  tools/generate_hyperparameters.py [--program build/dev/cli/consac] [--root FOLDER]   writes them
  tools/generate_hyperparameters.py --check ...                                        exit code 1 where they differ
"""
import argparse
import pathlib
import sys

from hyperparameters import godot, unreal
from hyperparameters.table import Algorithm, read

ROOT = pathlib.Path(__file__).resolve().parents[1]
UNREAL = "engines/unreal/Consac/Source/Consac"
GODOT = "engines/godot/addons/consac/hyperparameters"


def generated(algorithms: list[Algorithm]) -> dict[str, str]:
    """path -> text of every generated file."""
    files = {f"{UNREAL}/Public/ConsacHyperparameters.h": unreal.header(algorithms),
             f"{UNREAL}/Private/ConsacHyperparameters.cpp": unreal.source(algorithms),
             f"{GODOT}/consac_hyperparameters.gd": godot.BASE}
    for algorithm in algorithms:
        files[f"{GODOT}/{godot.file_name(algorithm)}"] = godot.script(algorithm)
    return files


def differences(files: dict[str, str], root: pathlib.Path) -> list[str]:
    """One line for each file that is missing, stale, or of an algorithm that is gone."""
    found = [f"{name}: differs from the program's table; run tools/generate_hyperparameters.py" for name, text in files.items()
             if not (root / name).is_file() or (root / name).read_text(encoding="utf-8") != text]
    extra = {path.relative_to(root).as_posix() for path in (root / GODOT).glob("*.gd")} - set(files)
    return found + [f"{name}: the program has no such algorithm; remove it" for name in sorted(extra)]


def main() -> int:
    parser = argparse.ArgumentParser(description="Writes the engines' properties for hyperparameters.")
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/dev/cli/consac", help="the program consac")
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, help="where to write")
    parser.add_argument("--check", action="store_true", help="write nothing; compare")
    options = parser.parse_args()
    if not options.program.is_file():
        parser.error(f"no program '{options.program}'; build it, or give --program")
    files = generated(read(options.program))
    if options.check:
        found = differences(files, options.root)
        print("\n".join(found) or "the engines' hyperparameters equal the program's")
        return 1 if found else 0
    for name, text in files.items():
        path = options.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    print(f"wrote {len(files)} files")
    return 0


if __name__ == "__main__":
    sys.exit(main())
