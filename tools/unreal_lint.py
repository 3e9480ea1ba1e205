#!/usr/bin/env python3
"""Checks an Unreal plugin folder by its text: no Unreal needed. Exit code 1 where a rule is broken.

  tools/unreal_lint.py PLUGIN_FOLDER [--symbols TABLE.csv] [--core FOLDER_OF_CORE_HEADERS ...]
  tools/unreal_lint.py --rules      writes the table of rules (docs/unreal-rules.md)
"""
import argparse
import pathlib
import sys

from unreal_lint.check import check
from unreal_lint.rules import markdown

ROOT = pathlib.Path(__file__).resolve().parents[1]


def main() -> int:
    parser = argparse.ArgumentParser(description="Checks an Unreal plugin folder by its text.")
    parser.add_argument("plugin", nargs="?", type=pathlib.Path, help="folder with the .uplugin")
    parser.add_argument("--symbols", type=pathlib.Path, default=ROOT / "engines/unreal/symbols.csv", help="table of allowed symbols")
    parser.add_argument("--core", type=pathlib.Path, nargs="+", default=[*(ROOT / part / "include" for part in ("core", "learn", "engines/host")), ROOT / "worlds/robot_reach", ROOT / "worlds/yumi_reach"],
                        help="public headers of what is staged into the plugin")
    parser.add_argument("--rules", action="store_true", help="write the table of rules and stop")
    options = parser.parse_args()
    if options.rules:
        print(markdown(), end="")
        return 0
    if options.plugin is None or not options.plugin.is_dir():
        parser.error(f"no plugin folder '{options.plugin}'; give the folder that holds the .uplugin")
    found = check(options.plugin, options.symbols, options.core)
    for path, line, rule, message in found:
        print(f"{options.plugin / path}:{line}: {rule} {message}")
    print(f"{len(found)} findings" if found else "the plugin follows the rules")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
