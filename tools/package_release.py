#!/usr/bin/env python3
"""Packs what tools/release.sh has compiled into archives, one for each system, with checksums.

  tools/package_release.py [--out dist] [--epoch SECONDS] [--targets linux-x86_64-musl ...]

The program: a .tar.gz or .zip for each target, and a .deb for Linux. The library of consac.h with its header, for each. consac-cad: a .deb and a .tar.gz for Debian 12. Godot's
add-on with its native extension for every system. Each with the licences of all that is linked into it
and a bill of materials, which also lies beside it. SHA256SUMS is of all that is in the folder. The same inputs give the same bytes.
"""
import argparse
import pathlib
import subprocess
import sys

from release import archives, cad, godot, library, program
from release.components import Missing
from version import version_of

ROOT = pathlib.Path(__file__).resolve().parents[1]


def commit_time(root: pathlib.Path) -> int:
    return int(subprocess.run(["git", "log", "-1", "--format=%ct"], cwd=root, capture_output=True, text=True, check=True).stdout)


def pack_program(root: pathlib.Path, target: str, out: pathlib.Path, epoch: int) -> list[pathlib.Path]:
    version = version_of(root)
    name = f"consac-{version}-{target.removesuffix('-musl')}"
    told = program.of(root, target, "consac", epoch)
    files = {f"{name}/{inside}": text for inside, text in told.files.items()}
    programs = {f"{name}/{told.program}"}
    made = [out / (name + (".zip" if target.startswith("windows") else ".tar.gz")), out / f"{name}.cdx.json"]
    write = archives.zip_of if target.startswith("windows") else archives.tar_gz
    write(files, programs, made[0], epoch)
    made[1].write_bytes(told.files["sbom.cdx.json"])
    if target.startswith("linux"):
        architecture = {"x86_64": "amd64", "aarch64": "arm64"}[target.split("-")[1]]
        made.append(out / f"consac_{version}_{architecture}.deb")
        control, files = program.debian(told, version, architecture)
        archives.deb(control, files, {"usr/bin/consac"}, made[2], epoch)
    return made


def main() -> int:
    parser = argparse.ArgumentParser(description="Packs what has been compiled for each system.")
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, help="CONSAC's folder, in whose build/cross-TARGET all is")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "dist", help="where the archives go")
    parser.add_argument("--epoch", type=int, help="the time of all files; the commit's, unless given")
    parser.add_argument("--targets", nargs="*", default=program.TARGETS, help="whose program is packed: " + " ".join(program.TARGETS))
    parser.add_argument("--libraries", nargs="*", default=library.TARGETS, help="whose library of consac.h is packed: " + " ".join(library.TARGETS))
    parser.add_argument("--no-cad", action="store_true", help="without consac-cad")
    parser.add_argument("--no-godot", action="store_true", help="without Godot's add-on")
    options = parser.parse_args()
    epoch = options.epoch or commit_time(options.root)
    options.out.mkdir(parents=True, exist_ok=True)
    made: list[pathlib.Path] = []
    try:
        for target in options.targets:
            made += pack_program(options.root, target, options.out, epoch)
        for target in options.libraries:
            made += library.pack(options.root, target, options.out, epoch)
        if not options.no_cad:
            made += cad.pack(options.root, options.out, epoch)
        if not options.no_godot:
            made += godot.pack(options.root, options.out, epoch)
    except Missing as error:
        print(f"package_release: {error}", file=sys.stderr)
        return 1
    for path in made:
        print(f"{path}: {path.stat().st_size / 1e6:.1f} MB")
    (options.out / "SHA256SUMS").write_text(archives.checksums(options.out))
    return 0


if __name__ == "__main__":
    sys.exit(main())
