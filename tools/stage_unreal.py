#!/usr/bin/env python3
"""Puts core, learn and engines/host with what they stand on into the Unreal plugin, which then compiles from source.

  tools/stage_unreal.py [--into PLUGIN_FOLDER]           writes; what is there already and equal is left alone
  tools/stage_unreal.py --check [--into PLUGIN_FOLDER]   exit code 1 where the staged files differ from the repository's

Needs nothing but Python and what `tools/setup.sh unreal` installs. Staged files are not committed.
"""
import argparse
import pathlib
import sys

from unreal_stage.layout import FOLDERS, plan
from unreal_stage.third_party import Missing

ROOT = pathlib.Path(__file__).resolve().parents[1]


def there(into: pathlib.Path) -> set[str]:
    """The files of the staged folders."""
    return {path.relative_to(into).as_posix() for folder in FOLDERS for path in (into / folder).rglob("*") if path.is_file()}


def differences(files: dict[str, bytes], into: pathlib.Path) -> list[str]:
    """One line for each file that is missing, differs, or is there without being staged."""
    found = [f"{name}: not staged by tools/stage_unreal.py; remove it" for name in sorted(there(into) - set(files))]
    for name, text in sorted(files.items()):
        path = into / name
        if not path.is_file():
            found.append(f"{name}: missing; run tools/stage_unreal.py")
        elif path.read_bytes() != text:
            found.append(f"{name}: differs from the repository; change it there and run tools/stage_unreal.py")
    return found


def stage(files: dict[str, bytes], into: pathlib.Path) -> int:
    """Writes what differs, removes what is stale; how many files changed."""
    changed = 0
    for name in there(into) - set(files):
        (into / name).unlink()
        changed += 1
    for name, text in files.items():
        path = into / name
        if not path.is_file() or path.read_bytes() != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
            changed += 1
    return changed


def main() -> int:
    parser = argparse.ArgumentParser(description="Puts core, learn and engines/host into the Unreal plugin.")
    parser.add_argument("--into", type=pathlib.Path, default=ROOT / "engines/unreal/Consac", help="the plugin's folder")
    parser.add_argument("--system", type=pathlib.Path, default=pathlib.Path("/usr/include"), help="where the libraries' headers are")
    parser.add_argument("--check", action="store_true", help="write nothing; compare")
    options = parser.parse_args()
    try:
        files = plan(ROOT, options.system)
    except Missing as error:
        print(f"stage_unreal: {error}", file=sys.stderr)
        return 1
    if options.check:
        found = differences(files, options.into)
        print("\n".join(found) or f"{len(files)} staged files equal the repository's")
        return 1 if found else 0
    changed = stage(files, options.into)
    print(f"staged {len(files)} files into {options.into} ({changed} changed)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
