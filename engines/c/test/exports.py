#!/usr/bin/env python3
"""Fails unless the shared library shows exactly what consac.h declares. Usage: exports.py HEADER LIBRARY NM"""
import pathlib
import re
import subprocess
import sys


def declared(header: str) -> set[str]:
    return set(re.findall(r"^CONSAC_API [^;]*?\b(consac_\w+)\(", header, re.MULTILINE))


def shown(listing: str) -> set[str]:
    """Names of `nm -D --defined-only`, without the version's own (type A)."""
    symbols = (line.split() for line in listing.splitlines())
    return {fields[2].split("@")[0] for fields in symbols if len(fields) == 3 and fields[1] != "A"}


if __name__ == "__main__":
    header, library, nm = sys.argv[1:]
    listing = subprocess.run([nm, "-D", "--defined-only", library], capture_output=True, text=True, check=True).stdout
    expected, found = declared(pathlib.Path(header).read_text()), shown(listing)
    if len(expected) < 40 or expected != found:
        sys.exit(f"declared alone: {sorted(expected - found)}; shown alone: {sorted(found - expected)}")
    print(f"{len(found)} functions, and nothing else")
