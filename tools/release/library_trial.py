"""The library of consac.h as it is packed: examples/c are compiled against it, learn and act, here, by an emulator and under Wine; a part
of trial.py."""
import pathlib
import re
import shutil

from .running import Failed, first, run, the, unpack

ROOT = pathlib.Path(__file__).resolve().parents[2]
EMULATOR = "/usr/bin/qemu-aarch64-static"
HEAD = """
## The library of consac.h

`examples/c`, compiled against the archive as it is: `learn.c` trains inside of itself, and `act.c` acts by the model that the other has written.

| what | where | `learn.c` | `act.c` |
|---|---|---|---|
"""


def built(archive: pathlib.Path, into: pathlib.Path, compiler: str, ending: str = "") -> pathlib.Path:
    """The examples, and beside them the library that they load, in one folder."""
    package, folder = unpack(archive, into), into / "run"
    folder.mkdir()
    library = first((path for path in package.glob("lib/*") if path.name.startswith(("libconsac.so", "consac.dll"))), "library")
    shutil.copy(library, folder)
    linked = next(package.glob("lib/*.dll.a"), library)
    for name in ("learn", "act"):
        run([compiler, "-std=c11", f"-I{package / 'include'}", f"{ROOT}/examples/c/{name}.c", str(linked), "-Wl,-rpath,$ORIGIN", "-lm", "-o",
             str(folder / (name + ending))], folder)
    return folder


def said(folder: pathlib.Path, start: list[str], inside: str, ending: str = "") -> list[str]:
    """What both print. start: what runs a program. inside: how that calls the folder."""
    trained, acted = (run([*start, f"{inside}/{name}{ending}", f"{inside}/ball.consac"], folder).strip() for name in ("learn", "act"))
    reward = re.search(r"mean reward ([\d.]+)", trained)
    # A ball that is held in the middle pays up to 1 in each of its 50 steps; one that stays where it begins, half of that.
    return [trained if reward and float(reward[1]) > 35 else f"FAILED: {trained}", acted]


def here(dist: pathlib.Path, scratch: pathlib.Path, roots: pathlib.Path) -> list[str]:
    folder = built(the(dist, "consac-c-*-linux-x86_64.tar.gz"), scratch / "c-x86_64", "cc")
    return ["this machine", *said(folder, [], str(folder))]


def emulated(dist: pathlib.Path, scratch: pathlib.Path, roots: pathlib.Path) -> list[str]:
    """In the root of an ARM64 system, whose C library it asks for."""
    root = next((path.parent for path in roots.glob("*-arm64/whole")), None)
    if root is None:
        raise Failed(f"no root of Debian for arm64 in {roots}")
    folder = built(the(dist, "consac-c-*-linux-aarch64.tar.gz"), scratch / "c-aarch64", str(ROOT / "build/windows-needs/linux-aarch64/bin/cc"))
    inside = root / "tmp/consac-c"
    shutil.rmtree(inside, ignore_errors=True)
    shutil.copytree(folder, inside)
    shutil.copy(EMULATOR, root / "usr/bin")
    return [f"Debian {root.name.rpartition('-')[0]}'s root, arm64, emulated", *said(inside, ["chroot", str(root), EMULATOR], "/tmp/consac-c")]


def wine(dist: pathlib.Path, scratch: pathlib.Path, roots: pathlib.Path) -> list[str]:
    folder = built(the(dist, "consac-c-*-windows-x86_64.zip"), scratch / "c-windows", "x86_64-w64-mingw32-gcc-posix", ".exe")
    return ["Wine, this machine", *said(folder, ["wine"], ".", ".exe")]


def page(dist: pathlib.Path, scratch: pathlib.Path, roots: pathlib.Path) -> str:
    text = HEAD
    for system, attempt in (("linux-x86_64", here), ("linux-aarch64", emulated), ("windows-x86_64", wine)):
        try:
            row = attempt(dist, scratch, roots)
        except Failed as error:
            row = ["", f"FAILED: {error}", ""]
        print(f"release_check: library of consac.h, {system} | " + " | ".join(row), flush=True)
        text += f"| consac-c, {system} | {' | '.join(row)} |\n"
    return text
