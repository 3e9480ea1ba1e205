"""The third-party files that a set of sources needs, found by following #include in the system's headers. Conditions
are not evaluated, so that the files of every platform come along."""
import pathlib
import re
import subprocess
import tarfile
from dataclasses import dataclass

INCLUDE = re.compile(rb'^[ \t]*#[ \t]*include[ \t]*[<"]([^">]+)[">]', re.M)
DEBIAN_COPYRIGHT = pathlib.Path("/usr/share/doc")
FORBIDDEN_LICENCE = (b"GNU Lesser General Public", b"GNU General Public License", b"GNU LESSER GENERAL")


@dataclass(frozen=True)
class Library:
    name: str  # its folder below ThirdParty
    package: str  # Debian's, whose copyright file goes along
    folders: tuple[str, ...]  # first steps of its include paths
    what: str


LIBRARIES = (
    Library("highway", "libhwy-dev", ("hwy",), "vector instructions, chosen at run time"),
    Library("eigen", "libeigen3-dev", ("Eigen",), "matrix decompositions"),
    Library("asio", "libasio-dev", ("asio",), "sockets"),
    Library("fast_float", "libfast-float-dev", ("fast_float",), "reading numbers"),
    Library("nlohmann_json", "nlohmann-json3-dev", ("nlohmann",), "JSON"),
)
# What the libraries put into a program: a namespace as each folder is called, and functions of C's.
NAMES = (*(folder for library in LIBRARIES for folder in library.folders), "asio_detail_posix_thread_function", "asio_signal_handler")

# What staging takes out of a library. Asio starts Winsock by a static object, which in the editor is made while Windows loads the
# plugin, when Winsock must not be started; every asio::io_context starts it as well, for as long as it lives.
CUTS = {"asio/detail/winsock_init.hpp": b"static const winsock_init<>& winsock_init_instance = winsock_init<>(false);\n"}


class Missing(Exception):
    """Something that staging needs is not on this machine; the text says what to do."""


def library_of(include: str) -> Library | None:
    return next((lib for lib in LIBRARIES if include.split("/")[0] in lib.folders), None)


def closure(sources: list[bytes], system: pathlib.Path) -> dict[str, pathlib.Path]:
    """include path -> file, of every third-party header that the texts of sources reach."""
    roots = (system, system / "eigen3")
    found: dict[str, pathlib.Path] = {}
    todo = [(name, None) for source in sources for name in _includes(source)]
    while todo:
        name, beside = todo.pop()
        path, root = _resolve(name, beside, roots)
        if path is None:
            if beside is None and library_of(name):
                raise Missing(f"no header <{name}> under {system}; run tools/setup.sh unreal")
            continue
        key = path.relative_to(root).as_posix()
        if key not in found and library_of(key):
            found[key] = path
            todo += [(inner, (path.parent, root)) for inner in _includes(path.read_bytes())]
    return found


def _includes(text: bytes) -> list[str]:
    return [name.decode() for name in INCLUDE.findall(text)]


def _resolve(name: str, beside, roots):
    """(file, the root it is under) of an include; (None, None) where no library here has it."""
    if beside is not None:
        near = pathlib.Path(beside[0], name)
        if near.is_file():
            return pathlib.Path(*_normal(near.parts)), beside[1]
    if library_of(name):
        for root in roots:
            if (root / name).is_file():
                return root / name, root
    return None, None


def _normal(parts):
    out = []
    for part in parts:
        if part == "..":
            out.pop()
        else:
            out.append(part)
    return out


def gather(sources: list[bytes], system: pathlib.Path, needs: pathlib.Path) -> tuple[dict[str, bytes], dict[str, bytes]]:
    """(include path -> text, licences) of all that the sources need: headers, and Highway's sources with theirs."""
    headers, compiled = closure(sources, system), {}
    while True:
        more, licences = highway_sources(headers, needs)
        if more == compiled:
            return {name: cut(name, path.read_bytes()) for name, path in headers.items()} | compiled, licences
        compiled = more
        headers = closure(sources + list(compiled.values()), system)


def cut(name: str, text: bytes) -> bytes:
    """A library's file without what CUTS names."""
    line = CUTS.get(name, b"")
    if line not in text:
        raise Missing(f"{name} no longer says '{line.decode().strip()}'; see whether it still starts Winsock by itself, and correct CUTS")
    return text.replace(line, b"// Not here: see README.txt beside the libraries.\n") if line else text


def highway_sources(headers: dict[str, pathlib.Path], needs: pathlib.Path) -> tuple[dict[str, bytes], dict[str, bytes]]:
    """(sources, licences) of Highway: the .cc of each of its headers that is used. Debian packs them as source alone."""
    archives = sorted(needs.glob("highway_*.orig.tar.gz"))
    if not archives:
        raise Missing(f"the source of Highway is not in {needs.name}; run tools/setup.sh unreal")
    sources, licences = {}, {}
    with tarfile.open(archives[-1]) as archive:
        for member in archive.getmembers():
            name = member.name.partition("/")[2]
            if name.startswith("LICENSE") and member.isfile():
                licences[name] = archive.extractfile(member).read()
            elif name.endswith(".cc") and name[:-2] + "h" in headers:
                sources[name] = archive.extractfile(member).read()
    return sources, licences


def debian_copyright(library: Library) -> bytes:
    path = DEBIAN_COPYRIGHT / library.package / "copyright"
    if not path.is_file():
        raise Missing(f"no licence of {library.name} at {path}; run tools/setup.sh unreal")
    return path.read_bytes()


def version(library: Library) -> str:
    """The package's version; 'unknown' where dpkg does not know it."""
    asked = subprocess.run(["dpkg-query", "-W", "-f=${Version}", library.package], capture_output=True, text=True, check=False)
    return asked.stdout.strip() or "unknown"


def refuse_copyleft(name: str, text: bytes) -> None:
    """Everything here may be linked into a closed game; a file that says otherwise stops the staging."""
    for words in FORBIDDEN_LICENCE:
        if words in text[:4000]:
            raise Missing(f"{name} is under '{words.decode()}'; it must not go into a plugin")
