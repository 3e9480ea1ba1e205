"""How a release's files are unpacked and run while they are tried: what trial.py and its parts share."""
import os
import pathlib
import subprocess
import tarfile
import zipfile
import zlib


class Failed(Exception):
    """A program that did not do what it should; the text is its last line."""


def run(command: list[str], folder: pathlib.Path, limit: float = 900) -> str:
    """What a command printed. It sees nothing of our environment."""
    environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/tmp", "WINEDEBUG": "-all", "WINEPREFIX": os.environ.get("WINEPREFIX", "/tmp/consac-wine")}
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=limit, env=environment, check=False)
    except subprocess.TimeoutExpired:
        raise Failed(f"nothing after {limit:.0f} s") from None
    if done.returncode:
        raise Failed(f"exit code {done.returncode}: {(done.stderr or done.stdout).strip().splitlines()[-1:]}")
    return done.stdout


def first(found, what: str):
    """The first that is found, whose absence is a failure of what is tried, not of the trial."""
    for each in found:
        return each
    raise Failed(f"there is no {what} inside")


def unpack(archive: pathlib.Path, into: pathlib.Path) -> pathlib.Path:
    """The folder that an archive holds, unpacked into another. Failed where it is damaged."""
    try:
        with zipfile.ZipFile(archive) if archive.suffix == ".zip" else tarfile.open(archive) as opened:
            opened.extractall(into)
    except (zipfile.BadZipFile, tarfile.TarError, zlib.error, EOFError) as error:
        raise Failed(f"{archive.name} is damaged: {error}") from error
    return first((path for path in into.iterdir() if path.name.startswith("consac-")), "folder consac-...")


def the(dist: pathlib.Path, pattern: str) -> pathlib.Path:
    """The one file of a release that is called so."""
    found = sorted(dist.glob(pattern))
    if not found:
        raise Failed(f"there is no {pattern} in {dist.name}; run make release")
    return found[0]
