#!/usr/bin/env python3
"""Makes the wheels of the Python package: one for each system, with the program and the library of consac.h inside, one without
either, and the source package. The same inputs give the same bytes.

  tools/wheels.py [--out dist] [--epoch SECONDS] [--targets linux-x86_64 ...]   of what tools/cross.sh has compiled
  tools/wheels.py --native build/release [--out dist]                           of a build for this machine, for a trial on it
"""
import argparse
import base64
import gzip
import hashlib
import io
import pathlib
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import time
import zipfile

from release.components import Missing
from release.program import of

ROOT = pathlib.Path(__file__).resolve().parents[1]
# The system's name -> what pip calls it, and whose program and whose library it has (folders build/cross-...). The program for Linux
# asks for no library at all; what Python loads must share Python's C library, that of 2012 or later.
SYSTEMS = {
    "linux-x86_64": ("manylinux_2_17_x86_64.manylinux2014_x86_64", "linux-x86_64-musl", "linux-x86_64"),
    "linux-aarch64": ("manylinux_2_17_aarch64.manylinux2014_aarch64", "linux-aarch64-musl", "linux-aarch64"),
    "windows-x86_64": ("win_amd64", "windows-x86_64", "windows-x86_64"),
    "macos-arm64": ("macosx_11_0_arm64", "macos-arm64", "macos-arm64"),
    "macos-x86_64": ("macosx_11_0_x86_64", "macos-x86_64", "macos-x86_64"),
}
LIBRARIES = ("libconsac.so", "libconsac.dylib", "consac.dll")  # as a build has them, and consac/native.py looks for them
Files = dict[str, bytes]


def pure(root: pathlib.Path, epoch: int) -> tuple[Files, bytes]:
    """What setuptools makes of python/: a wheel's files, and the source package."""
    with tempfile.TemporaryDirectory() as folder:
        source, out = pathlib.Path(folder, "python"), pathlib.Path(folder, "out")
        shutil.copytree(root / "python", source, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info", "build", "tests"))
        shutil.copy(root / "LICENSE", source)
        out.mkdir()
        make = "import sys; from setuptools import build_meta; out = sys.argv[1]; build_meta.build_sdist(out); build_meta.build_wheel(out)"
        done = subprocess.run([sys.executable, "-c", make, out], cwd=source, capture_output=True, text=True)
        if done.returncode != 0:
            raise Missing(f"setuptools makes no wheel of python/ (77 or later is needed): {done.stderr.strip()[-400:]}")
        with zipfile.ZipFile(next(out.glob("*.whl"))) as wheel:
            files = {name: wheel.read(name) for name in wheel.namelist() if not name.endswith("/RECORD")}
        return files, _same_archive(next(out.glob("*.tar.gz")).read_bytes(), epoch)


def _same_archive(packed: bytes, epoch: int) -> bytes:
    """The same source package, of nobody and of one time."""
    out = io.BytesIO()
    with tarfile.open(fileobj=io.BytesIO(packed)) as old, gzip.GzipFile("", "wb", 9, out, epoch) as zipped, \
            tarfile.open(fileobj=zipped, mode="w", format=tarfile.PAX_FORMAT) as new:
        for member in sorted((member for member in old.getmembers() if member.isfile()), key=lambda member: member.name):
            entry = tarfile.TarInfo(member.name)
            entry.size, entry.mtime, entry.mode = member.size, epoch, 0o644
            new.addfile(entry, old.extractfile(member))
    return out.getvalue()


def native(program: pathlib.Path, libraries: pathlib.Path, stripped: bool) -> tuple[bytes, str, bytes]:
    """The program, and the library with its name."""
    found = next((name for name in LIBRARIES if (libraries / name).is_file()), None)
    if found is None or not program.is_file():
        raise Missing(f"no {program}, or no library in {libraries}; build the targets consac and consac_c")
    texts = []
    for path in (program, libraries / found):
        with tempfile.NamedTemporaryFile() as copy:
            if not stripped:
                subprocess.run(["strip", "-o", copy.name, path.resolve()], check=True)
            texts.append(pathlib.Path(path if stripped else copy.name).read_bytes())
    return texts[0], found, texts[1]


def papers_of(root: pathlib.Path, trainer: str, library: str, epoch: int) -> Files:
    """The licences and the bills of materials of what tools/cross.sh has linked into a program and a library, for the systems named."""
    found: Files = {}
    for system, made in ((trainer, "consac"), (library, "consac_c")):
        packed = of(root, system, made, epoch).files
        found |= {f"licenses/linked/{name.removeprefix('licenses/')}": text for name, text in packed.items() if name.startswith("licenses/")}
        found[f"sboms/{made}.cdx.json"] = packed["sbom.cdx.json"]
    return found


def wheel(files: Files, tag: str, epoch: int, inside: tuple[bytes, str, bytes] | None = None, papers: Files | None = None) -> tuple[str, bytes]:
    """A wheel's name and bytes. inside: a program and a library, for the system that `tag` names. papers: what goes beside the licence."""
    info = next(name.split("/")[0] for name in files if name.endswith(".dist-info/WHEEL"))
    stem = info.removesuffix(".dist-info")
    tags = "".join(f"Tag: py3-none-{one}\n" for one in tag.split("."))
    content = dict(files) | {f"{info}/{name}": text for name, text in (papers or {}).items()}
    pure_lib = "true" if inside is None else "false"
    content[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: consac (wheels.py)\nRoot-Is-Purelib: {pure_lib}\n{tags}".encode()
    programs = set()
    if inside is not None:
        script = f"{stem}.data/scripts/consac{'.exe' if tag.startswith('win') else ''}"
        programs = {script, f"consac/lib/{inside[1]}"}
        content |= {script: inside[0], f"consac/lib/{inside[1]}": inside[2]}
    rows = [f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(text).digest()).rstrip(b'=').decode()},{len(text)}"
            for name, text in sorted(content.items())]
    content[f"{info}/RECORD"] = "\n".join([*rows, f"{info}/RECORD,,", ""]).encode()
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        # What an installer reads first stands last, as the format asks for.
        for name in sorted(content, key=lambda name: (name.startswith(info), name)):
            entry = zipfile.ZipInfo(name, max(time.gmtime(epoch)[:6], (1980, 1, 1, 0, 0, 0)))
            entry.external_attr = (0o100000 | (0o755 if name in programs else 0o644)) << 16
            entry.create_system, entry.compress_type = 3, zipfile.ZIP_DEFLATED
            archive.writestr(entry, content[name])
    return f"{stem}-py3-none-{tag}.whl", out.getvalue()


def main() -> int:
    parser = argparse.ArgumentParser(description="Makes the wheels of the Python package.")
    parser.add_argument("--root", type=pathlib.Path, default=ROOT, help="CONSAC's folder")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "dist", help="where they go")
    parser.add_argument("--epoch", type=int, help="the time of all files; the commit's, unless given")
    parser.add_argument("--targets", nargs="*", default=list(SYSTEMS), choices=list(SYSTEMS), help="for which systems")
    parser.add_argument("--native", type=pathlib.Path, help="a build for this machine; then there is a wheel for it alone")
    options = parser.parse_args()
    epoch = options.epoch
    if epoch is None:
        epoch = int(subprocess.run(["git", "log", "-1", "--format=%ct"], cwd=options.root, capture_output=True, text=True, check=True).stdout)
    options.out.mkdir(parents=True, exist_ok=True)
    try:
        files, source = pure(options.root, epoch)
        stem = next(name.split("/")[0] for name in files if name.endswith(".dist-info/WHEEL")).removesuffix(".dist-info")
        made = {f"{stem}.tar.gz": source}
        made.update([wheel(files, "any", epoch)])
        if options.native is not None:
            tag = sysconfig.get_platform().replace("-", "_").replace(".", "_")
            made.update([wheel(files, tag, epoch, native(options.native / "cli/consac", options.native / "engines/c", stripped=False))])
        for target in options.targets if options.native is None else ():
            tag, trainer, library = SYSTEMS[target]
            folders = [options.root / f"build/cross-{name}" for name in (trainer, library)]
            name = "consac.exe" if target.startswith("windows") else "consac"
            inside = native(folders[0] / "cli" / name, folders[1] / "engines/c", stripped=True)
            made.update([wheel(files, tag, epoch, inside, papers_of(options.root, trainer, library, epoch))])
    except Missing as error:
        print(f"wheels: {error}", file=sys.stderr)
        return 1
    for name, text in made.items():
        (options.out / name).write_bytes(text)
        print(f"{options.out / name}: {len(text) / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
