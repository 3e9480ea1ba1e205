"""Archives whose bytes depend on nothing but what is in them and on one time: sorted, of nobody, readable by all."""
import gzip
import hashlib
import io
import os
import pathlib
import subprocess
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Collection

Files = dict[str, bytes]  # path in the archive -> bytes


def _mode(name: str, programs: Collection[str]) -> int:
    return 0o755 if name in programs else 0o644


def tar_gz(files: Files, programs: Collection[str], path: pathlib.Path, epoch: int) -> None:
    with path.open("wb") as out, gzip.GzipFile("", "wb", 9, out, epoch) as packed, \
            tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for name in sorted(files):
            entry = tarfile.TarInfo(name)
            entry.size, entry.mtime, entry.mode = len(files[name]), epoch, _mode(name, programs)
            archive.addfile(entry, io.BytesIO(files[name]))


def zip_of(files: Files, programs: Collection[str], path: pathlib.Path, epoch: int) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, max(time.gmtime(epoch)[:6], (1980, 1, 1, 0, 0, 0)))
            entry.external_attr = (0o100000 | _mode(name, programs)) << 16
            entry.create_system = 3  # whose modes these are: Unix'
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[name])


def deb(control: dict[str, str], files: Files, programs: Collection[str], path: pathlib.Path, epoch: int) -> None:
    """A Debian package; xz, which Debian 11 reads too, by one thread, since more cut its stream elsewhere."""
    sums = "".join(f"{hashlib.md5(files[n], usedforsecurity=False).hexdigest()}  {n}\n" for n in sorted(files)).encode()
    size = {"Installed-Size": str(sum(-(-len(text) // 1024) for text in files.values()))}
    fields = "".join(f"{key}: {value}\n" for key, value in (control | size).items()).encode()
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder, "tree")
        for name, text in (files | {"DEBIAN/control": fields, "DEBIAN/md5sums": sums}).items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_bytes(text)
            (root / name).chmod(_mode(name, programs))
        for inside in (root, *root.rglob("*")):
            if inside.is_dir():
                inside.chmod(0o755)
            os.utime(inside, (epoch, epoch))
        subprocess.run(["dpkg-deb", "--root-owner-group", "-Zxz", "--threads-max=1", "--build", root, path], check=True,
                       stdout=subprocess.DEVNULL, env=os.environ | {"SOURCE_DATE_EPOCH": str(epoch)})


def checksums(folder: pathlib.Path) -> str:
    """Of all that is in the folder, as `sha256sum -c` reads it."""
    names = sorted(path.name for path in folder.iterdir() if path.is_file() and path.name != "SHA256SUMS")
    return "".join(f"{hashlib.sha256((folder / name).read_bytes()).hexdigest()}  {name}\n" for name in names)
