"""The library of consac.h for one system, with its header: what programs in C, C#, Rust, Lua and Java bind to."""
import pathlib

from version import version_of

from . import program
from .archives import tar_gz, zip_of

TARGETS = ("linux-x86_64", "linux-aarch64", "windows-x86_64", "macos-arm64", "macos-x86_64")
HEADER = "engines/c/include/consac.h"
NAMES = {"linux": "libconsac.so.0", "windows": "consac.dll", "macos": "libconsac.0.dylib"}  # by which a loader asks for it
README = """CONSAC {version}, the library of consac.h: models act, learners learn and worlds are served inside of any program that calls C.

include/consac.h says what each function does. The library asks for nothing but the system's C library. Programs of an older consac.h of the same major number go on with a newer library.

"""
LINUX = """For glibc 2.17 (2012) and later:

  cc -std=c11 -Iinclude program.c lib/libconsac.so.0 -Wl,-rpath,'$ORIGIN' -lm -o program    (libconsac.so.0 beside the program)
"""
WINDOWS = """For 64-bit Windows 10 (1903) and later. Programs load consac.dll from their own folder; lib/libconsac.dll.a is what MinGW links.
Its authors have no Windows to try it on.
"""
MACOS = """For macOS 11 and later. It was compiled on Linux; its authors have had no Mac to run it on. It is not signed by a registered developer:

  xattr -d com.apple.quarantine lib/libconsac.0.dylib
"""


def pack(root: pathlib.Path, target: str, out: pathlib.Path, epoch: int) -> list[pathlib.Path]:
    system, release = target.split("-")[0], version_of(root)
    told = program.of(root, target, "consac_c", epoch, README + {"linux": LINUX, "windows": WINDOWS, "macos": MACOS}[system])
    name = f"consac-c-{release}-{target}"
    files = {inside: text for inside, text in told.files.items() if inside != told.program}
    files |= {"include/consac.h": (root / HEADER).read_bytes(), f"lib/{NAMES[system]}": told.files[told.program]}
    files |= {f"lib/{path.name}": path.read_bytes() for path in (root / f"build/cross-{target}/engines/c").glob("*.dll.a")}
    made = [out / (name + (".zip" if system == "windows" else ".tar.gz")), out / f"{name}.cdx.json"]
    write = zip_of if system == "windows" else tar_gz
    write({f"{name}/{inside}": text for inside, text in files.items()}, {f"{name}/lib/{NAMES[system]}"}, made[0], epoch)
    made[1].write_bytes(told.files["sbom.cdx.json"])
    return made
