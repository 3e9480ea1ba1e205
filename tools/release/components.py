"""What is linked into a program: the libraries that its link names and the headers that its objects were compiled from,
as Ninja wrote them down. Nothing is guessed, and a library that has no row here is an error."""
import pathlib
import re
import subprocess
from dataclasses import dataclass

from unreal_stage.third_party import Missing


@dataclass(frozen=True)
class Component:
    name: str
    licence: str  # an SPDX expression
    purl: str  # what a scanner knows it by, without the version
    library: str = ""  # libLIBRARY.a
    folder: str = ""  # first step of its headers' include paths
    source: str = ""  # Debian's: a source package in build/windows-needs, or a package of headers
    note: str = ""  # for its licence
    called: str = ""  # its licence's file in a target's prefix, without .txt, where tools/cross_libraries.sh calls it otherwise

    @property
    def text(self) -> str:
        return f"{self.called or self.name}.txt"


MPL = "Its source, unchanged, is "
COMPONENTS = (
    Component("highway", "Apache-2.0", "pkg:github/google/highway", "hwy", "hwy", "highway"),
    Component("eigen", "MPL-2.0", "pkg:generic/eigen", "", "Eigen", "libeigen3-dev", MPL + "https://gitlab.com/libeigen/eigen", "eigen3"),
    Component("asio", "BSL-1.0", "pkg:github/chriskohlhoff/asio", "", "asio", "libasio-dev"),
    Component("fast_float", "Apache-2.0 OR MIT", "pkg:github/fastfloat/fast_float", "", "fast_float", "libfast-float-dev", called="fast-float"),
    Component("nlohmann-json", "MIT", "pkg:github/nlohmann/json", "", "nlohmann", "nlohmann-json3-dev", called="nlohmann-json3"),
    Component("cli11", "BSD-3-Clause", "pkg:github/CLIUtils/CLI11", "", "CLI", "libcli11-dev"),
    Component("fmt", "MIT", "pkg:github/fmtlib/fmt", "fmt", "fmt", "fmtlib", called="fmtlib"),
    Component("yaml-cpp", "MIT", "pkg:github/jbeder/yaml-cpp", "yaml-cpp", "yaml-cpp", "yaml-cpp"),
    Component("pugixml", "MIT", "pkg:github/zeux/pugixml", "pugixml", "", "pugixml"),
    Component("zlib", "Zlib", "pkg:github/madler/zlib", "z", "", "zlib"),
    Component("libpng", "libpng-2.0", "pkg:github/pnggroup/libpng", "png16", "", "libpng1.6"),
    Component("pixman", "MIT", "pkg:generic/pixman", "pixman-1", "", "pixman"),
    Component("cairo", "LGPL-2.1-only OR MPL-1.1", "pkg:generic/cairo", "cairo", "cairo", "cairo",
              "Of its two licences the Mozilla Public License 1.1 is used. " + MPL + "https://cairographics.org/releases/cairo-1.16.0.tar.xz"),
)
# What a compiler puts into every program, and whose package brings it.
LLVM = "Apache-2.0 WITH LLVM-exception"
ZIG = (
    Component("zig-compiler-rt", "MIT", "pkg:pypi/ziglang", source="ziglang"),
    Component("libcxx", LLVM, "pkg:generic/libcxx", source="ziglang"),
    Component("libcxxabi", LLVM, "pkg:generic/libcxxabi", source="ziglang"),
    Component("libunwind", LLVM, "pkg:generic/libunwind", source="ziglang"),
)
MUSL = Component("musl", "MIT", "pkg:generic/musl", source="ziglang")
MINGW = (
    Component("gcc-runtime", "GPL-3.0-or-later WITH GCC-exception-3.1", "pkg:generic/gcc", source="gcc-mingw-w64-base"),
    Component("mingw-w64-runtime", "ZPL-2.1 AND MIT", "pkg:generic/mingw-w64", source="mingw-w64-common"),
)
# Of the system, present on each: no part of a program.
SYSTEM = {"ws2_32", "mswsock", "gdi32", "msimg32", "user32", "kernel32", "m", "pthread", "dl", "rt", "c"}
SYSTEM_AS_DEFAULT = re.compile(r"-l(?:kernel32|user32|gdi32|winspool|shell32|ole32|oleaut32|uuid|comdlg32|advapi32)\b")


def link_of(build: pathlib.Path, target: str) -> tuple[pathlib.Path, list[str]]:
    """The file that a CMake target becomes, and what its link names."""
    text = (build / "build.ninja").read_text(encoding="utf-8")
    found = re.search(rf"^build (\S+?)(?: \S+)*?: \S*_LINKER__{re.escape(target)}_Release (.*?)\n\n", text, re.M | re.S)
    if not found:
        raise Missing(f"{build} links no {target}; run tools/cross.sh")
    libraries = re.search(r"^  LINK_LIBRARIES = (.*)$", found[2], re.M)
    return build / found[1], SYSTEM_AS_DEFAULT.sub("", libraries[1] if libraries else "").split()


def headers_of(build: pathlib.Path, parts: set[str]) -> set[str]:
    """The headers of the objects in these folders of a build."""
    text = subprocess.run(["ninja", "-C", build, "-t", "deps"], capture_output=True, text=True, check=True).stdout
    found: set[str] = set()
    ours = False
    for line in text.splitlines():
        if not line.startswith(" "):
            ours = line.startswith(tuple(part + "/" for part in parts))
        elif ours and line:
            found.add(line.strip())
    return found


def linked(build: pathlib.Path, target: str, includes: str = "/prefix/include/", loaded: str = r"\.so") -> list[Component]:
    """The libraries that are a part of what a target becomes. `includes`: what all their headers' paths hold; `loaded`: a
    pattern for links that are to be loaded instead, and so no part of it."""
    file, links = link_of(build, target)
    parts, libraries = {file.parent.relative_to(build).as_posix()}, set()
    for link in links:
        name = re.sub(r"^(lib|-l)|\.a$", "", link.rpartition("/")[2])
        if name.startswith("consac_"):
            parts.add(link.rpartition("/")[0])
        elif not link.startswith("-Wl,") and not re.search(loaded, link) and name not in SYSTEM:
            libraries.add(name)
    unknown = libraries - {part.library for part in COMPONENTS}
    if unknown:
        raise Missing(f"{file.name} is linked with {', '.join(sorted(unknown))}; give it a row in tools/release/components.py")
    inside = re.compile(re.escape(includes) + r"(?:eigen3/)?([\w-]+)")
    folders = {found[1] for found in map(inside.search, headers_of(build, parts)) if found}
    return [part for part in COMPONENTS if part.library in libraries or (part.folder and part.folder in folders)]


def runtime(target: str) -> tuple[Component, ...]:
    if target.startswith("windows"):
        return MINGW
    if target.startswith("macos"):
        return ZIG[:3]  # unwinding is the system's
    return (*ZIG, MUSL) if target.endswith("-musl") else ZIG


def version(component: Component, archives: pathlib.Path) -> str:
    """As upstream calls it."""
    if component.source == "ziglang":
        return zig_version()
    found = sorted(archives.glob(f"{component.source}_*.orig.tar.*"))
    if found:
        text = found[-1].name.split("_")[1].split(".orig.tar")[0]
    else:
        asked = subprocess.run(["dpkg-query", "-W", "-f=${Version}", component.source], capture_output=True, text=True)
        if asked.returncode:
            raise Missing(f"no package {component.source} here; run tools/setup.sh release")
        text = asked.stdout.split(":")[-1].rpartition("-")[0] or asked.stdout
    return re.split(r"[+.](?:ds|dfsg)", text)[0]


def zig_version() -> str:
    text = pathlib.Path(__file__).resolve().parents[1].joinpath("requirements-unreal.txt").read_text()
    return re.search(r"^ziglang==(\S+)", text, re.M)[1]
