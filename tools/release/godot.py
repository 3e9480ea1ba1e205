"""Godot's add-on as its asset library wants it: addons/consac with the native extension for every system, and the trainer for the two of
most people: with all five it would be of 20 MB."""
import pathlib
import re
import struct

from version import version_of

from . import program
from .archives import Files, zip_of

ADDON = "engines/godot/addons/consac"
EXTENSION = "consac_godot"
LIBRARIES = {"linux-x86_64": "libconsac.linux.x86_64.so", "linux-aarch64": "libconsac.linux.arm64.so",
             "windows-x86_64": "libconsac.windows.x86_64.dll"}
MACOS, UNIVERSAL = ("macos-arm64", "macos-x86_64"), "libconsac.macos.universal.dylib"
PROGRAMS = ("linux-x86_64-musl", "windows-x86_64")
README = """CONSAC {version} for Godot 4.4 and later: reinforcement learning in the engine, or by the trainer outside of it.

Put the folder addons into your project, and turn the plugin on in Project Settings. The trainer for Linux and Windows on
x86_64 is in addons/consac/programs; Godot does not look into it, and no exported game holds it. For macOS and for Linux on
ARM64 it is a file of its own: consac-{version}-SYSTEM.tar.gz.

What is in bin and programs is not signed. Where macOS refuses it: xattr -dr com.apple.quarantine addons/consac. Nothing for
macOS has been run by its authors; what is for Linux was, in the real engine.
"""
CPUS = {"macos-arm64": (0x0100000C, 0), "macos-x86_64": (0x01000007, 3)}  # Mach-O's type and kind of a processor
ALIGNED = 14  # a page of Apple's processors, as a power of two


def universal(slices: dict[str, bytes]) -> bytes:
    """Apple's file of several files, one for each processor, each as it was signed."""
    at, table, body = 1 << ALIGNED, b"", b""
    for target, text in slices.items():
        table += struct.pack(">5I", *CPUS[target], at, len(text), ALIGNED)
        body = body.ljust(at - (1 << ALIGNED), b"\0") + text
        at = -(-(at + len(text)) // (1 << ALIGNED)) * (1 << ALIGNED)
    return (struct.pack(">2I", 0xCAFEBABE, len(slices)) + table).ljust(1 << ALIGNED, b"\0") + body


def description(root: pathlib.Path) -> bytes:
    """What tells Godot of the libraries, of which none has another beside it here."""
    text = (root / "engines/godot/extension/consac.gdextension.in").read_text(encoding="utf-8")
    text, count = re.subn(r"^macos = .*$", f'macos = "{UNIVERSAL}"', text.replace("@dependencies@", ""), flags=re.M)
    absent = [name for name in (*LIBRARIES.values(), UNIVERSAL) if f'"{name}"' not in text]
    if count != 1 or absent:
        raise ValueError(f"consac.gdextension.in does not name {absent or 'macos'}")
    return text.encode()


def addon(root: pathlib.Path) -> Files:
    """As it is committed, without what a build puts into it."""
    paths = [path for path in sorted((root / ADDON).rglob("*")) if path.is_file()]
    names = {path.relative_to(root / ADDON).as_posix(): path for path in paths}
    return {name: path.read_bytes() for name, path in names.items() if not name.startswith("bin/")}


def pack(root: pathlib.Path, out: pathlib.Path, epoch: int) -> list[pathlib.Path]:
    files = addon(root)
    native = {target: program.of(root, target, EXTENSION, epoch) for target in (*LIBRARIES, *MACOS)}
    for target, packed in native.items():
        files |= {f"bin/{name}": text for name, text in packed.files.items() if name.startswith("licenses/")}
        files[f"bin/sbom/{target}.cdx.json"] = packed.files["sbom.cdx.json"]
    files |= {f"bin/{name}": native[target].files[native[target].program] for target, name in LIBRARIES.items()}
    files[f"bin/{UNIVERSAL}"] = universal({target: native[target].files[native[target].program] for target in MACOS})
    files["bin/consac.gdextension"] = description(root)
    files["bin/licenses/.gdignore"] = files["bin/sbom/.gdignore"] = files["programs/.gdignore"] = b""
    executables = set()
    for target in PROGRAMS:
        packed, folder = program.of(root, target, "consac", epoch), f"programs/{target.removesuffix('-musl')}/"
        files |= {folder + name: text for name, text in packed.files.items()}
        executables.add(f"addons/consac/{folder}{packed.program}")
    files["LICENSE"] = (root / "LICENSE").read_bytes()
    files["README.txt"] = README.format(version=version_of(root)).encode()
    path = out / f"consac-godot-{version_of(root)}.zip"
    zip_of({"addons/consac/" + name: text for name, text in files.items()}, executables, path, epoch)
    return [path]
