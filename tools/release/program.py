"""One program for one system, with all that it may not travel without: its licence, those of what is linked into it, a bill
of materials, and what to do where the system holds it up."""
import pathlib
from dataclasses import dataclass

from version import version_of

from .archives import Files
from .components import Component, Missing, link_of, linked, runtime, version
from .sbom import sbom

TARGETS = ("linux-x86_64-musl", "linux-aarch64-musl", "windows-x86_64", "macos-arm64", "macos-x86_64")
FIRST_STEPS = """CONSAC {version}, the trainer: reinforcement learning for Unreal Engine, Godot and any other engine.

  consac demo                              the whole story in seconds
  consac train cartpole-v1 --envs 8        learn a world that is built in
  consac train tcp://127.0.0.1:5005        learn the world of an engine
  consac --help                            and each verb has its own

"""
LINUX = """One file, which asks for no library: any Linux should run it. Put it where your shell looks for programs:

  install consac ~/.local/bin/

Pictures of learning curves have letters of their own, of which there are those of English. STEP and IGES files are read by
consac-cad, a package of its own for Debian 12.
"""
WINDOWS = """One file, for 64-bit Windows 10 (1903) and later. It is not signed, so Windows may say "Windows protected your PC" when it is
first started: compare its checksum with SHA256SUMS (certutil -hashfile consac.exe SHA256 is of the file here, Get-FileHash of the
.zip), then choose "More info" and "Run anyway", or in PowerShell:

  Unblock-File consac.exe

Its authors have no Windows to try it on.
"""
MACOS = """One file, for macOS 11 and later. It was compiled on Linux; its authors have had no Mac to run it on. Please tell how it goes.

It is not signed by a registered developer, so macOS may refuse it ("cannot be opened because the developer cannot be
verified"). Compare its checksum with SHA256SUMS (shasum -a 256), then take it out of quarantine:

  xattr -d com.apple.quarantine consac

or open System Settings, Privacy & Security, and choose "Open Anyway". Pictures of learning curves have letters of their own, of
which there are those of English.
"""
LICENCES = """
LICENSE is CONSAC's. What is linked into it has its licences in the folder licenses:

"""


@dataclass(frozen=True)
class Packed:
    """What one program travels as."""
    program: str  # its name in files
    files: Files


def licence_texts(parts: list[Component], folder: pathlib.Path) -> Files:
    absent = [part.name for part in parts if not (folder / part.text).is_file()]
    if absent:
        raise Missing(f"no licence of {', '.join(absent)} in {folder}; run tools/cross.sh")
    return {f"licenses/{part.name}.txt": (folder / part.text).read_bytes() for part in parts}


def table(parts: list[tuple[Component, str]]) -> str:
    rows = [f"  {part.name} {number}, {part.licence}." + (f" {part.note}." if part.note else "") for part, number in parts]
    return LICENCES + "\n".join(rows) + "\n"


def of(root: pathlib.Path, target: str, name: str, epoch: int, words: str = "") -> Packed:
    """What a CMake target has become for a system: the program, or a library that others load. words: of its README, the trainer's unless given."""
    build, needs = root / f"build/cross-{target}", root / "build/windows-needs"
    if not (build / "build.ninja").is_file():
        raise Missing(f"nothing is compiled for {target}; run tools/cross.sh {target}")
    file, _ = link_of(build, name)
    if not file.is_file():
        raise Missing(f"no {file}; run tools/cross.sh {target} {name}")
    parts = [*linked(build, name), *runtime(target)]
    versions = [(part, version(part, needs)) for part in parts]
    release = version_of(root)
    words = words or FIRST_STEPS + {"linux": LINUX, "windows": WINDOWS, "macos": MACOS}[target.split("-")[0]]
    text = file.read_bytes()
    return Packed(file.name, {
        file.name: text,
        "LICENSE": (root / "LICENSE").read_bytes(),
        "README.txt": (words.replace("{version}", release) + table(versions)).encode(),
        "sbom.cdx.json": sbom(name, release, target, text, versions, epoch),
    } | licence_texts(parts, needs / target / "prefix/licenses"))


def debian(packed: Packed, release: str, architecture: str) -> tuple[dict[str, str], Files]:
    """The fields and files of a Debian package."""
    control = {
        "Package": "consac", "Version": release, "Architecture": architecture, "Maintainer": "The CONSAC authors <consac@localhost>",
        "Section": "science", "Priority": "optional", "Suggests": "consac-cad",
        "Description": "reinforcement learning for Unreal Engine, Godot and any other engine\n"
                       " The trainer: one native program that learns worlds of engines over TCP or shared\n"
                       " memory, or built-in ones, and saves models that act in an engine by themselves.\n"
                       " It asks for no library and no Python.",
    }
    folder = "usr/share/doc/consac/"
    files = {folder + name: text for name, text in packed.files.items() if name not in (packed.program, "LICENSE")}
    licences = [packed.files["LICENSE"], *(text for name, text in sorted(packed.files.items()) if name.startswith("licenses/"))]
    return control, files | {"usr/bin/consac": packed.files[packed.program], folder + "copyright": b"\n\n".join(licences)}
