"""consac-cad for Debian 12: a program that asks Debian for its many libraries, OpenCASCADE among them."""
import pathlib
import re
import subprocess

from version import version_of

from .archives import Files, deb, tar_gz
from .components import Component, Missing, linked, version
from .program import table
from .sbom import sbom

BUILD = "build/release-cad"
README = """consac-cad {version}: reads STEP and IGES files for `consac twin`, which finds it beside itself or where the shell looks for programs.

It is Debian 12's: it asks for that system's libraries. Elsewhere, build it (tools/setup.sh cad).

  apt install {packages}
"""


def needed(program: pathlib.Path) -> list[tuple[str, str]]:
    """The packages of Debian that a program asks for, with their versions here."""
    asked = subprocess.run(["readelf", "-d", program], capture_output=True, text=True, check=True).stdout
    libraries = re.findall(r"NEEDED.*\[(.+)\]", asked)
    owners = subprocess.run(["dpkg", "-S", *(f"*/{library}" for library in libraries)], capture_output=True, text=True, check=True).stdout
    packages = {line.split(":")[0] for line in owners.splitlines() if line.rpartition("/")[2] in libraries and "diversion" not in line}
    return sorted((package, _version(package)) for package in packages)


def _version(package: str) -> str:
    return subprocess.run(["dpkg-query", "-W", "-f=${Version}", package], capture_output=True, text=True, check=True).stdout


def licence_texts(parts: list[Component]) -> Files:
    """Of headers that are compiled in, and of Highway's and pugixml's, whose libraries are asked for."""
    packages = {"highway": "libhwy-dev", "pugixml": "libpugixml-dev", "fmt": "libfmt-dev", "yaml-cpp": "libyaml-cpp-dev"}
    return {f"licenses/{part.name}.txt": pathlib.Path("/usr/share/doc", packages.get(part.name, part.source), "copyright").read_bytes()
            for part in parts}


def depends(packages: list[tuple[str, str]]) -> str:
    """At least these versions, without Debian's own revision."""
    return ", ".join(f"{name} (>= {number.rpartition('-')[0] or number})" for name, number in packages)


def pack(root: pathlib.Path, out: pathlib.Path, epoch: int) -> list[pathlib.Path]:
    program, release = root / BUILD / "cli/consac-cad", version_of(root)
    if not program.is_file():
        raise Missing(f"no {program}; run tools/release.sh")
    parts = linked(root / BUILD, "consac-cad", "/usr/include/", r"\.so|^-l")  # what Debian links by name is shared, too: see `needed`
    versions = [(part, version(part, root / "build/windows-needs")) for part in parts]
    packages = needed(program)
    text = program.read_bytes()
    readme = README.format(version=release, packages=" ".join(name for name, _ in packages)) + table(versions)
    bill = sbom("consac-cad", release, "debian12-x86_64", text, versions, epoch, packages)
    files = {"LICENSE": (root / "LICENSE").read_bytes(), "README.txt": readme.encode(), "sbom.cdx.json": bill} | licence_texts(parts)
    name = f"consac-cad-{release}-debian12-x86_64"
    made = [out / f"{name}.tar.gz", out / f"{name}.cdx.json", out / f"consac-cad_{release}_amd64.deb"]
    tar_gz({f"{name}/{inside}": each for inside, each in (files | {"consac-cad": text}).items()}, {f"{name}/consac-cad"}, made[0], epoch)
    made[1].write_bytes(bill)
    control = {
        "Package": "consac-cad", "Version": release, "Architecture": "amd64", "Maintainer": "The CONSAC authors <consac@localhost>",
        "Section": "science", "Priority": "optional", "Depends": depends(packages), "Enhances": "consac",
        "Description": "reads STEP and IGES files for consac twin\n Makes a robot's CAD file a scene whose joints turn. For Debian 12.",
    }
    folder = "usr/share/doc/consac-cad/"
    copyright_text = b"\n\n".join([files["LICENSE"], *(each for inside, each in sorted(files.items()) if inside.startswith("licenses/"))])
    inside = {folder + each: files[each] for each in ("README.txt", "sbom.cdx.json")}
    deb(control, inside | {"usr/bin/consac-cad": text, folder + "copyright": copyright_text}, {"usr/bin/consac-cad"}, made[2], epoch)
    return made
