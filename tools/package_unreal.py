#!/usr/bin/env python3
"""Packs the Unreal plugin: one zip of sources for each engine version, ready to be put into a project's Plugins folder.

  tools/package_unreal.py [--out build/unreal] [--linux build/cross-linux-x86_64-musl/cli/consac]
                          [--windows build/cross-windows-x86_64/cli/consac.exe] [--no-programs] [--engines 5.3 5.4 5.5 5.6]

In each zip: the plugin with core and learn staged into it, the graphs, the documents, all licences, the programs that are
built, and MANIFEST.sha256. The same inputs give the same bytes.
"""
import argparse
import hashlib
import pathlib
import re
import subprocess
import sys

from release.archives import zip_of
from unreal_lint.build import strict
from unreal_stage.layout import FOLDERS, plan, version_of
from unreal_stage.third_party import Missing

ROOT = pathlib.Path(__file__).resolve().parents[1]
PLUGIN = "engines/unreal/Consac"
ENGINES = ("5.3", "5.4", "5.5", "5.6")
LEFT_OUT = tuple(folder + "/" for folder in FOLDERS) + ("Binaries/", "Intermediate/", "Saved/", "Programs/", ".clang-format")
DOCUMENTS = tuple(f"docs/{name}.md" for name in ("unreal", "unreal-nodes", "unreal-rules", "program", "runs", "logs", "configuration"))
LINUX, WINDOWS = "Programs/Linux/consac", "Programs/Win64/consac.exe"  # where the node Start Trainer Program looks
BUILT = {LINUX: "build/cross-linux-x86_64-musl/cli/consac", WINDOWS: "build/cross-windows-x86_64/cli/consac.exe"}
LICENCES = {LINUX: "build/windows-needs/linux-x86_64-musl/prefix/licenses",  # of what is linked into each program
            WINDOWS: "build/windows-needs/windows-x86_64/prefix/licenses"}
MANIFEST = "MANIFEST.sha256"
README = """CONSAC {version} for Unreal Engine {engine}: reinforcement learning for Blueprints.

Put this folder into the folder Plugins of a C++ project (make one of both where there is none), open the project, and let
it compile. Then read Docs/unreal.md.

Not compiled against Unreal by its authors: see "How far this is tested" in Docs/unreal.md.
"""
TRAINER = "The trainer, started by the node Start Trainer Program, or by hand in a terminal.\n"
SYSTEMS = {LINUX: "It runs by itself on every 64-bit Linux of the last ten years.\n",
           WINDOWS: "It runs by itself on 64-bit Windows 10 (1903) and later.\n"}
NEEDS = "It needs these libraries of the system:\n"
LINKED = """What is linked into it has its licences in the folder Licenses. Of cairo's two, the Mozilla Public License 1.1 is used; its
source, version 1.16.0, unchanged: https://cairographics.org/releases/cairo-1.16.0.tar.xz
"""


def plugin_files(root: pathlib.Path) -> dict[str, bytes]:
    """The plugin as it is committed, without what is staged or built."""
    folder = root / PLUGIN
    names = [path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*")) if path.is_file()]
    return {name: (folder / name).read_bytes() for name in names if not name.startswith(LEFT_OUT)}


def documents(root: pathlib.Path) -> dict[str, bytes]:
    paths = [root / name for name in DOCUMENTS] + sorted((root / "docs/images").glob("*.svg"))
    return {"Docs/" + path.relative_to(root / "docs").as_posix(): path.read_bytes() for path in paths}


def needs(program: pathlib.Path) -> list[str]:
    """The shared libraries that a program for Linux asks for: none, unless somebody gives one of his own."""
    asked = subprocess.run(["readelf", "-d", program], capture_output=True, text=True, check=True).stdout
    return re.findall(r"NEEDED.*\[(.+)\]", asked)


def program_files(place: str, program: pathlib.Path, licences: pathlib.Path) -> dict[str, bytes]:
    """A program where the node looks for it, with the licences of all that is linked into it."""
    texts = sorted(licences.glob("*.txt"))
    if not texts:
        raise Missing(f"no licences in {licences}; build the program with tools/cross.sh")
    asked = needs(program) if place == LINUX else []
    readme = TRAINER + (NEEDS + "\n".join(asked) + "\n" if asked else SYSTEMS[place]) + LINKED
    folder = place.rpartition("/")[0]
    files = {place: program.read_bytes(), f"{folder}/README.txt": readme.encode()}
    return files | {f"{folder}/Licenses/{text.name}": text.read_bytes() for text in texts}


def stamped(descriptor: bytes, engine: str) -> bytes:
    """The descriptor with its engine version, which the repository leaves out."""
    text, count = re.subn(r'(\n\s*"VersionName": "[^"]*",)', rf'\1\n  "EngineVersion": "{engine}.0",', descriptor.decode(), count=1)
    if count != 1:
        raise Missing("Consac.uplugin has no VersionName to put EngineVersion behind")
    strict(text)
    return text.encode()


def contents(root: pathlib.Path, staged: dict[str, bytes], engine: str, programs: dict[str, bytes]) -> dict[str, bytes]:
    """path in the plugin -> bytes of one package."""
    files = plugin_files(root) | staged | documents(root) | programs
    files["LICENSE"] = (root / "LICENSE").read_bytes()
    files["README.txt"] = README.format(version=version_of(root), engine=engine).encode()
    files["Consac.uplugin"] = stamped(files["Consac.uplugin"], engine)
    filters = files["Config/FilterPlugin.ini"].decode().rstrip("\n")
    extra = ["/LICENSE", "/README.txt", f"/{MANIFEST}", "/Docs/...", "/graphs/..."] + (["/Programs/..."] if programs else [])
    files["Config/FilterPlugin.ini"] = "\n".join([filters, *extra, ""]).encode()
    files[MANIFEST] = "".join(f"{hashlib.sha256(files[n]).hexdigest()}  {n}\n" for n in sorted(files)).encode()
    return files


def pack(files: dict[str, bytes], path: pathlib.Path) -> None:
    zip_of({"Consac/" + name: text for name, text in files.items()}, {"Consac/" + name for name in BUILT}, path, epoch=0)


def main() -> int:
    parser = argparse.ArgumentParser(description="Packs the Unreal plugin, one zip for each engine version.")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build/unreal", help="where the zips go")
    for system, place in (("linux", LINUX), ("windows", WINDOWS)):
        parser.add_argument(f"--{system}", dest=place, type=pathlib.Path, help=f"the program; {BUILT[place]} where that is built")
    parser.add_argument("--no-programs", action="store_true", help="without them, for a shop that takes no executables")
    parser.add_argument("--licences", type=pathlib.Path, help="of what is linked into the programs, where they are others than are built here")
    parser.add_argument("--engines", nargs="+", default=list(ENGINES), help="engine versions")
    parser.add_argument("--system", type=pathlib.Path, default=pathlib.Path("/usr/include"), help="where the libraries' headers are")
    options = parser.parse_args()
    found = {}
    for place, built in BUILT.items():
        asked = getattr(options, place)
        if asked is not None and not asked.is_file():
            parser.error(f"no program '{asked}'; build it, or leave it out")
        if not options.no_programs and (asked or (ROOT / built).is_file()):
            found[place] = asked or ROOT / built
    absent = "".join(f", without {place}" for place in BUILT if place not in found)
    try:
        programs: dict[str, bytes] = {}
        for place, program in found.items():
            programs |= program_files(place, program, options.licences or ROOT / LICENCES[place])
        staged = plan(ROOT, options.system)
        options.out.mkdir(parents=True, exist_ok=True)
        for engine in options.engines:
            path = options.out / f"Consac-{version_of(ROOT)}-UE{engine}.zip"
            files = contents(ROOT, staged, engine, programs)
            pack(files, path)
            print(f"{path}: {len(files)} files, {path.stat().st_size / 1e6:.1f} MB{absent}")
    except Missing as error:
        print(f"package_unreal: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
