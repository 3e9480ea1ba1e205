#!/usr/bin/env python3
"""Runs what is in a release on this machine, in other systems' roots, by an emulator and under Wine, and writes a table.

  python3 tools/release/trial.py dist build/release-roots bench/results/release.md

Used by tools/release_check.sh. Exit code 1 where something did not run; the table says what.
"""
import json
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from release import addon_trial, asks, library_trial, wheel_trial  # noqa: E402
from release.running import Failed, first, run, the, unpack  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
QUIET = ["--no-table", "--no-progress", "--no-tensorboard", "--json"]
TRAININGS = {"ppo2, CartPole": ["train", "cartpole-v1", "--envs", "8", "--steps", "8192", "--seed", "1"],
             "sac, Pendulum": ["train", "pendulum-v1", "--algo", "sac", "--steps", "300", "--seed", "1", "--set", "net_arch=[32,32]",
                              "--set", "batch_size=64"]}  # small: an emulator takes a hundred times as long
HEAD = """# What a release was tried on

Written by `make release-check` over what `make release` had put into `dist`; {date}, commit {commit}, {machine}.
A root is the required packages of that suite of Debian, unpacked: its C library, no Python; the empty one holds the program alone.
A program that is static uses none of it; that it starts there at all is what is shown. The last columns are hashes of the weights
after a short training: equal ones are the same training, bit for bit.

| what | where | `--version` | `demo` | {trainings} |
|---|---|---|---|{lines}
"""
NOT_RUN = """
Not run anywhere: what is for macOS (there is no Mac here), anything on Windows itself, ARM64 on a processor of that kind, the plug-in in Unreal
(`make test` tries what it is packed from).
"""


@dataclass
class Place:
    """Where a program runs: a folder in which it is unpacked, how it is started, and what it calls that folder."""
    what: str
    where: str
    folder: pathlib.Path
    command: list[str]
    inside: str = "."


def attempt(place: Place) -> list[str]:
    """The cells of one row, as far as it came."""
    cells = []
    try:
        cells.append(", ".join(run([*place.command, "--version"], place.folder).splitlines()[:2]))
        run([*place.command, "demo", "--steps", "2000", "--dir", f"{place.inside}/demo"], place.folder)
        cells.append("yes")
        for name, arguments in TRAININGS.items():
            told = run([*place.command, *arguments, "--dir", f"{place.inside}/{arguments[1]}", *QUIET], place.folder)
            cells.append(json.loads(told.splitlines()[-1])["weights_hash"])
    except Failed as error:
        cells.append(f"FAILED: {error}")
    return cells + [""] * (2 + len(TRAININGS) - len(cells))


def in_root(archive: pathlib.Path, root: pathlib.Path, emulator: list[str]) -> Place:
    inside = root / "tmp/consac"
    shutil.rmtree(inside, ignore_errors=True)
    inside.mkdir(parents=True)
    folder = unpack(archive, inside)
    for tool in emulator:
        shutil.copy(tool, root / "usr/bin")
    within = "/" + folder.relative_to(root).as_posix()
    suite, _, architecture = root.name.rpartition("-")
    where = f"Debian {suite}'s root, {architecture}" + (", emulated" if emulator else "")
    return Place(archive.name, where, folder, ["chroot", root.as_posix(), *emulator, f"{within}/consac"], within)


def in_nothing(archive: pathlib.Path, folder: pathlib.Path) -> Place:
    """A root that holds the program and nothing else: no shell, no C library, no /tmp, no /proc."""
    program = unpack(archive, folder / "unpacked") / "consac"
    root = folder / "root"
    root.mkdir()
    shutil.copy(program, root)
    return Place(archive.name, "an empty root", root, ["chroot", root.as_posix(), "/consac"], "")


def linux(dist: pathlib.Path, roots: pathlib.Path, scratch: pathlib.Path, architecture: str, debian: str, emulator: list[str]) -> list[Place]:
    archive = the(dist, f"consac-[0-9]*-linux-{architecture}.tar.gz")
    here = unpack(archive, scratch / architecture)
    found = [Place(archive.name, "this machine" + (", emulated" if emulator else ""), here, [*emulator, str(here / "consac")])]
    found += [in_root(archive, root, emulator) for root in sorted(roots.glob(f"*-{debian}")) if (root / "whole").exists()]
    return found + ([] if emulator else [in_nothing(archive, scratch / "nothing")])


def package(dist: pathlib.Path, roots: pathlib.Path, scratch: pathlib.Path) -> list[Place]:
    """Installed by each root's own dpkg, of which nothing but unpacking is asked: the package depends on none."""
    deb, found = the(dist, "consac_*_amd64.deb"), []
    for root in sorted(roots.glob("*-amd64")):
        if not (root / "whole").exists():
            continue
        shutil.copy(deb, root / "tmp/consac.deb")
        for name in ("status", "available"):
            (root / "var/lib/dpkg" / name).touch()
        for name in ("updates", "info"):
            (root / "var/lib/dpkg" / name).mkdir(exist_ok=True)
        run(["chroot", root.as_posix(), "dpkg", "-i", "/tmp/consac.deb"], scratch)
        shutil.rmtree(root / "tmp/of-deb", ignore_errors=True)
        (root / "tmp/of-deb").mkdir()
        suite = root.name.rpartition("-")[0]
        found.append(Place(deb.name, f"installed by dpkg in Debian {suite}'s root", root, ["chroot", root.as_posix(), "consac"], "/tmp/of-deb"))
    if not found:
        raise Failed(f"no root of Debian in {roots} to install {deb.name} in")
    return found


def windows(dist: pathlib.Path, scratch: pathlib.Path) -> list[Place]:
    archive = the(dist, "consac-[0-9]*-windows-x86_64.zip")
    here = unpack(archive, scratch / "windows")
    return [Place(archive.name, "Wine, this machine", here, ["wine", str(here / "consac.exe")])]


def rows_of(dist: pathlib.Path, roots: pathlib.Path, scratch: pathlib.Path) -> Iterator[list[str]]:
    """A row for each place; one that says so where there is nothing to try."""
    groups = {"linux-x86_64": lambda: linux(dist, roots, scratch, "x86_64", "amd64", []),
              "linux-aarch64": lambda: linux(dist, roots, scratch, "aarch64", "arm64", ["/usr/bin/qemu-aarch64-static"]),
              ".deb": lambda: package(dist, roots, scratch), "windows-x86_64": lambda: windows(dist, scratch)}
    for name, group in groups.items():
        try:
            for place in group():
                yield [place.what, place.where, *attempt(place)]
        except Failed as error:
            yield [name, "", f"FAILED: {error}", "", *[""] * len(TRAININGS)]
    yield cad(dist, scratch)


def cad(dist: pathlib.Path, scratch: pathlib.Path) -> list[str]:
    """consac-cad beside the program reads a STEP file."""
    name = "consac-cad"
    try:
        archive = the(dist, "consac-cad-*.tar.gz")
        name, here = archive.name, unpack(archive, scratch / "cad")
        shutil.copy(unpack(the(dist, "consac-[0-9]*-linux-x86_64.tar.gz"), scratch / "beside") / "consac", here)
        step = sorted(path for path in ROOT.glob("examples/**/*.step"))[0]
        run([str(here / "consac"), "twin", "import", str(step), "--output", str(here / "twin")], here)
        run(["apt-get", "install", "-s", "--reinstall", str(the(dist, "consac-cad_*_amd64.deb").resolve())], here)
        told = f"imports {step.name}; apt would install the .deb here"
    except Failed as error:
        told = f"FAILED: {error}"
    return [name, "beside consac, this machine", told, "", *[""] * len(TRAININGS)]


def who_agree(rows: list[list[str]]) -> str:
    """Which of these places trained the same, bit for bit."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, where, *told in rows:
        groups.setdefault(tuple(told[-len(TRAININGS):]), []).append(f"{name} ({where})")
    lines = [f"- {' and '.join(hashes)}: {'; '.join(places)}\n" for hashes, places in groups.items() if all(hashes)]
    return "\nWhich agree, bit for bit:\n\n" + "".join(lines)


def inside(archives: list[pathlib.Path], scratch: pathlib.Path, pick: Callable[[pathlib.Path], Iterable[pathlib.Path]], what: str) -> dict[str, bytes]:
    """The archives, and of each the file that is picked from its folder; of one without it nothing, which `asked` says FAILED of."""
    found = {}
    for archive in sorted(archives):
        try:
            found[archive.name] = first(pick(unpack(archive, scratch / archive.name)), what).read_bytes()
        except Failed as error:
            print(f"release_check: {archive.name} | FAILED: {error}", flush=True)
            found[archive.name] = b""
    return found


def programs_of(dist: pathlib.Path, scratch: pathlib.Path) -> dict[str, bytes]:
    """The archives of programs, and each one's program."""
    archives = [*dist.glob("consac-[0-9]*-linux-*.tar.gz"), *dist.glob("consac-[0-9]*-macos-*.tar.gz"), *dist.glob("consac-[0-9]*-windows-*.zip")]
    return inside(archives, scratch, lambda folder: (path for path in folder.iterdir() if path.stem == "consac"), "program")


def libraries_of(dist: pathlib.Path, scratch: pathlib.Path) -> dict[str, bytes]:
    """The archives of the library of consac.h, and each one's library."""
    archives = [*dist.glob("consac-c-*.tar.gz"), *dist.glob("consac-c-*.zip")]
    return inside(archives, scratch, lambda folder: (path for path in folder.glob("lib/*") if path.is_file() and path.suffix != ".a"), "library")


def asked(files: dict[str, bytes]) -> str:
    """What each loads from its system, read from the file; all that can be said of what is not run here."""
    def loads(text: bytes) -> str:
        try:
            return asks.of(text)
        except Failed as error:
            return f"FAILED: {error}"

    rows = "".join(f"| {name} | {len(text) / 1e6:.2f} | {loads(text)} |\n" for name, text in files.items())
    return f"\n## What they ask of a system\n\n| the program or library in | MB unpacked | loads |\n|---|---|---|\n{rows}"


def beside(notes: pathlib.Path) -> str:
    """What tools/release.sh and `release_check.sh again` have noted: times, and whether two folders gave the same bytes."""
    text = ""
    for title, name in (("What making it took", "times.md"), ("Two folders, the same bytes", "again.md")):
        path = notes / name
        text += f"\n## {title}\n\n" + (path.read_text(encoding="utf-8") if path.is_file() else "Not noted.\n")
    return text


def main() -> int:
    dist, roots, page = (pathlib.Path(name).resolve() for name in sys.argv[1:4])
    commit = subprocess.run(["git", "describe", "--always", "--abbrev=12"], capture_output=True, text=True, check=True).stdout.strip()
    model = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text())
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        scratch = pathlib.Path(folder)
        for row in rows_of(dist, roots, scratch):
            rows.append(row)
            print("release_check: " + " | ".join(row), flush=True)
        programs = programs_of(dist, scratch / "programs")
        libraries = libraries_of(dist, scratch / "libraries")
        parts = library_trial.page(dist, scratch, roots) + addon_trial.page(dist, scratch, programs)
        parts += wheel_trial.pages(ROOT, dist, programs | libraries, scratch) + asked(programs | libraries)
    sizes = sorted((path.stat().st_size, path.name) for path in dist.iterdir() if path.is_file() and path.suffix != ".json")
    text = HEAD.format(date=time.strftime("%Y-%m-%d"), commit=commit, machine=model[1] if model else platform.machine(), trainings=" | ".join(TRAININGS),
                       lines="---|" * len(TRAININGS))
    text += "".join(f"| {' | '.join(row)} |\n" for row in rows) + who_agree(rows) + NOT_RUN + parts
    text += "\n## Sizes\n\n| file | MB |\n|---|---|\n" + "".join(f"| {name} | {size / 1e6:.2f}{' (more than 15)' * (size > 15e6)} |\n" for size, name in sizes)
    page.write_text(text + beside(ROOT / "build/release-notes"), encoding="utf-8")
    return int("FAILED" in text)


if __name__ == "__main__":
    sys.exit(main())
