"""The archives of tools/package_release.py: whole, the same bytes each time, with what is linked into a program and its licences."""
import hashlib
import json
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tarfile
import zipfile

import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import package_release  # noqa: E402
import wheels  # noqa: E402
from release import archives, cad, godot, program  # noqa: E402
from release.components import COMPONENTS, Missing, linked, runtime, version  # noqa: E402
from release.sbom import sbom  # noqa: E402

EPOCH = 1_700_000_000
# A program as small as can be, of a part of ours that includes a library's header, and of a library.
PROJECT = """
cmake_minimum_required(VERSION 3.25)
project(consac LANGUAGES CXX)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
include_directories(SYSTEM ${CMAKE_SOURCE_DIR}/build/windows-needs/linux-x86_64-musl/prefix/include)
add_library(yaml-cpp STATIC library.cpp)
add_library(unused STATIC unused.cpp)
add_subdirectory(core)
add_executable(consac main.cpp)
target_link_libraries(consac PRIVATE consac_core yaml-cpp)
set_target_properties(consac PROPERTIES RUNTIME_OUTPUT_DIRECTORY cli)
add_executable(odd main.cpp)
add_library(consac_c SHARED main.cpp)
set_target_properties(consac_c PROPERTIES OUTPUT_NAME consac VERSION 0.1 SOVERSION 0 LIBRARY_OUTPUT_DIRECTORY engines/c)
target_link_libraries(consac_c PRIVATE consac_core)
target_link_libraries(odd PRIVATE consac_core unused)
add_executable(asks main.cpp)
target_link_libraries(asks PRIVATE consac_core -lstdc++)
"""
TARGET = "linux-x86_64-musl"
NEEDS = f"build/windows-needs/{TARGET}/prefix"


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A folder as CONSAC's, in which a tiny program has been compiled for one system."""
    root = tmp_path_factory.mktemp("tree")
    parts = {part.text for part in (*COMPONENTS, *runtime(TARGET))}
    files = {"CMakeLists.txt": PROJECT, "core/include/consac/base/version.h": 'kVersion = "1.2.3"', "LICENSE": "ours\n", "main.cpp": "int Core();\nint main() { return Core(); }\n", "library.cpp": "int library;\n",
             "unused.cpp": "#include <CLI/CLI.hpp>\n",
             "engines/c/include/consac.h": "a header\n",
             "core/CMakeLists.txt": "add_library(consac_core STATIC core.cpp)\n", "core/core.cpp": "#include <Eigen/Dense>\nint Core() { return 0; }\n",
             f"{NEEDS}/include/eigen3/Eigen/Dense": "", f"{NEEDS}/include/Eigen/Dense": "", f"{NEEDS}/include/CLI/CLI.hpp": "",
             "build/windows-needs/yaml-cpp_0.7.0+dfsg.orig.tar.xz": "",
             } | {f"{NEEDS}/licenses/{name}": f"licence of {name.removesuffix('.txt')}\n" for name in parts}
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    build = root / f"build/cross-{TARGET}"
    subprocess.run(["cmake", "-S", root, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release"], check=True, capture_output=True)
    subprocess.run(["cmake", "--build", build], check=True, capture_output=True)
    return root


@pytest.fixture(scope="module")
def out(tree, tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, ROOT / "tools/package_release.py", "--root", tree, "--out", folder, "--epoch", str(EPOCH),
                    "--targets", TARGET, "--libraries", TARGET, "--no-cad", "--no-godot"], check=True, capture_output=True)
    return folder


def untarred(path):
    with tarfile.open(path) as archive:
        return {entry.name: (entry, archive.extractfile(entry).read()) for entry in archive}


def unpacked_deb(path, folder):
    subprocess.run(["dpkg-deb", "-R", path, folder], check=True)
    return {each.relative_to(folder).as_posix(): each.read_bytes() for each in folder.rglob("*") if each.is_file()}


def test_what_is_linked_is_read_from_the_build(tree):
    build = tree / f"build/cross-{TARGET}"
    assert [part.name for part in linked(build, "consac")] == ["eigen", "yaml-cpp"]
    with pytest.raises(Missing, match="odd is linked with unused; give it a row"):
        linked(build, "odd")
    with pytest.raises(Missing, match=r"asks is linked with stdc\+\+; give it a row"):
        linked(build, "asks")
    assert [part.name for part in linked(build, "asks", loaded=r"\.so|^-l")] == ["eigen"]
    with pytest.raises(Missing, match="links no nothing"):
        linked(build, "nothing")


def test_a_program_travels_with_its_licences(out):
    files = untarred(out / "consac-1.2.3-linux-x86_64.tar.gz")
    top = "consac-1.2.3-linux-x86_64/"
    assert all(name.startswith(top) for name in files)
    program_entry, _ = files[top + "consac"]
    assert program_entry.mode == 0o755 and {entry.mode for entry, _ in files.values() if entry is not program_entry} == {0o644}
    assert all((entry.uid, entry.gid, entry.uname, entry.mtime) == (0, 0, "", EPOCH) for entry, _ in files.values())
    expected = {"eigen", "yaml-cpp", "musl", "libcxx", "libcxxabi", "libunwind", "zig-compiler-rt"}
    assert {name.removeprefix(top + "licenses/") for name in files if "/licenses/" in name} == {f"{name}.txt" for name in expected}
    readme = files[top + "README.txt"][1].decode()
    assert "yaml-cpp 0.7.0, MIT." in readme and "MPL-2.0. Its source" in readme and "CONSAC 1.2.3" in readme


def test_the_library_travels_with_its_header_under_the_name_that_a_loader_asks_for(tree, out):
    files = untarred(out / f"consac-c-1.2.3-{TARGET}.tar.gz")
    texts = {name.removeprefix(f"consac-c-1.2.3-{TARGET}/"): text for name, (_, text) in files.items()}
    assert texts["lib/libconsac.so.0"] == (tree / f"build/cross-{TARGET}/engines/c/libconsac.so.0.1").read_bytes()
    assert {"include/consac.h", "LICENSE", "licenses/eigen.txt", "sbom.cdx.json"} <= set(texts) and "licenses/yaml-cpp.txt" not in texts
    assert b"CONSAC 1.2.3, the library of consac.h" in texts["README.txt"] and b"eigen" in texts["README.txt"]
    bill = (out / f"consac-c-1.2.3-{TARGET}.cdx.json").read_text()
    assert bill.encode() == texts["sbom.cdx.json"] and JsonStrictValidator(SchemaVersion.V1_6).validate_str(bill) is None


def test_a_wheel_has_both_with_the_licences_and_the_bills_of_what_is_linked(tree, tmp_path, monkeypatch):
    root = tmp_path / "copy"
    shutil.copytree(tree, root, symlinks=True)
    (root / "python").symlink_to(ROOT / "python")
    for folder in ("build/cross-", "build/windows-needs/"):
        (root / f"{folder}linux-x86_64").symlink_to(root / f"{folder}{TARGET}")
    monkeypatch.setattr(sys, "argv", ["wheels.py", "--root", str(root), "--targets", "linux-x86_64", "--out", str(tmp_path / "out"), "--epoch", str(EPOCH)])
    assert wheels.main() == 0
    with zipfile.ZipFile(next((tmp_path / "out").glob("*-py3-none-manylinux_2_17_x86_64.manylinux2014_x86_64.whl"))) as archive:
        found = {re.sub(r"^[^/]+\.(dist-info|data)/", "", name): archive.read(name) for name in archive.namelist()}
    assert {name for name in found if "/linked/" in name} >= {"licenses/linked/musl.txt", "licenses/linked/yaml-cpp.txt", "licenses/linked/eigen.txt"}
    for bill, made in (("sboms/consac.cdx.json", "scripts/consac"), ("sboms/consac_c.cdx.json", "consac/lib/libconsac.so")):
        assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(found[bill].decode()) is None
        assert json.loads(found[bill])["metadata"]["component"]["hashes"][0]["content"] == hashlib.sha256(found[made]).hexdigest()
    assert b"yaml-cpp" in found["sboms/consac.cdx.json"] and b"yaml-cpp" not in found["sboms/consac_c.cdx.json"]


def test_a_program_without_a_licence_is_not_packed(tree, tmp_path):
    root = tmp_path / "copy"
    shutil.copytree(tree, root, symlinks=True)
    (root / NEEDS / "licenses/musl.txt").unlink()
    with pytest.raises(Missing, match="no licence of musl in"):
        program.of(root, TARGET, "consac", EPOCH)


def test_licences_are_where_the_libraries_recipes_put_them():
    script = (ROOT / "tools/cross_libraries.sh").read_text()
    headers = re.search(r"^cross_headers=\((.*)\)$", script, re.M)[1].split()
    put = {*re.findall(r"licence ([\w.-]+) [\"/]", script), "libcxx", "libcxxabi", "libunwind", *(name.removeprefix("lib").removesuffix("-dev") for name in headers)}
    assert {part.text.removesuffix(".txt") for part in (*COMPONENTS, *runtime(TARGET), *runtime("windows-x86_64"))} == put


def test_the_bill_of_materials_is_valid(out):
    text = (out / "consac-1.2.3-linux-x86_64.cdx.json").read_text()
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(text) is None
    told = json.loads(text)
    files = untarred(out / "consac-1.2.3-linux-x86_64.tar.gz")
    assert files["consac-1.2.3-linux-x86_64/sbom.cdx.json"][1].decode() == text
    assert told["metadata"]["component"]["hashes"][0]["content"] == hashlib.sha256(files["consac-1.2.3-linux-x86_64/consac"][1]).hexdigest()
    assert ("pkg:github/jbeder/yaml-cpp@0.7.0", [{"license": {"id": "MIT"}}]) in [(row["purl"], row["licenses"]) for row in told["components"]]
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(text.replace('"library"', '"thing"')) is not None


def test_every_component_and_debians_packages_make_a_valid_bill(tmp_path):
    rows = [(part, "1.0") for part in (*COMPONENTS, *runtime("linux-x86_64-musl"), *runtime("windows-x86_64"))]
    text = sbom("consac", "1.2.3", "all", b"program", rows, EPOCH, [("libc6", "2.36-9+deb12u9")]).decode()
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(text) is None
    assert "pkg:deb/debian/libc6@2.36-9+deb12u9" in text


def test_a_debian_package_holds_the_program(out, tmp_path):
    deb = out / "consac_1.2.3_amd64.deb"
    files = unpacked_deb(deb, tmp_path / "deb")
    assert files["usr/bin/consac"] == untarred(out / "consac-1.2.3-linux-x86_64.tar.gz")["consac-1.2.3-linux-x86_64/consac"][1]
    assert files["usr/share/doc/consac/copyright"].startswith(b"ours") and b"licence of musl" in files["usr/share/doc/consac/copyright"]
    assert {"usr/share/doc/consac/README.txt", "usr/share/doc/consac/sbom.cdx.json"} <= set(files)
    listed = dict(reversed(line.split("  ")) for line in files["DEBIAN/md5sums"].decode().splitlines())
    assert set(listed) == {name for name in files if not name.startswith("DEBIAN/")}
    fields = dict(line.split(": ", 1) for line in files["DEBIAN/control"].decode().splitlines() if not line.startswith(" "))
    assert (fields["Package"], fields["Version"], fields["Architecture"]) == ("consac", "1.2.3", "amd64") and "Depends" not in fields
    listing = subprocess.run(["dpkg-deb", "-c", deb], check=True, capture_output=True, text=True).stdout
    assert all(" root/root " in line for line in listing.splitlines())


def test_the_checksums_are_of_all(out):
    done = subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=out, check=True, capture_output=True, text=True)
    assert len(done.stdout.splitlines()) == 5


@pytest.mark.parametrize("write", [archives.tar_gz, archives.zip_of, lambda *rest: archives.deb({"Package": "x", "Version": "1", "Architecture": "all",
                                                                                                 "Maintainer": "n <n@n>", "Description": "d"}, *rest)])
def test_the_same_inputs_give_the_same_bytes(write, tmp_path):
    files = {"b/two": b"2" * 100_000, "a": b"1"}
    for name in ("x", "y"):
        write(files, {"a"}, tmp_path / name, EPOCH)
        files = dict(reversed(files.items()))
    assert (tmp_path / "x").read_bytes() == (tmp_path / "y").read_bytes()


def test_a_zip_keeps_that_a_program_is_one(tmp_path):
    archives.zip_of({"run": b"1", "read": b"2"}, {"run"}, tmp_path / "x.zip", EPOCH)
    with zipfile.ZipFile(tmp_path / "x.zip") as archive:
        assert {entry.filename: entry.external_attr >> 16 for entry in archive.infolist()} == {"run": 0o100755, "read": 0o100644}


def test_apples_file_of_two_holds_both():
    slices = {"macos-arm64": b"A" * 20_000, "macos-x86_64": b"B" * 5}
    text = godot.universal(slices)
    magic, count = struct.unpack_from(">2I", text)
    assert (magic, count) == (0xCAFEBABE, 2)
    for i, (target, expected) in enumerate(slices.items()):
        cpu, kind, at, size, aligned = struct.unpack_from(">5I", text, 8 + 20 * i)
        assert (cpu, kind) == godot.CPUS[target] and at % (1 << aligned) == 0 and text[at:at + size] == expected


def test_godot_is_told_of_every_library():
    text = godot.description(ROOT).decode()
    assert all(f'"{name}"' in text for name in (*godot.LIBRARIES.values(), godot.UNIVERSAL)) and "@" not in text
    assert {"plugin.cfg", "consac_sync.gd"} <= set(godot.addon(ROOT)) and not [name for name in godot.addon(ROOT) if name.startswith("bin/")]


def test_a_package_of_debian_is_asked_for_by_upstreams_version():
    assert cad.depends([("libtbb12", "2021.8.0-2"), ("libc6", "2.36")]) == "libtbb12 (>= 2021.8.0), libc6 (>= 2.36)"
    assert ("libc6" in dict(cad.needed(pathlib.Path(shutil.which("true")))))


def test_a_version_is_upstreams(tmp_path):
    part = next(part for part in COMPONENTS if part.name == "zlib")
    (tmp_path / "zlib_1.2.13.dfsg.orig.tar.bz2").touch()
    assert version(part, tmp_path) == "1.2.13"


def test_what_a_script_starts_by_its_name_is_a_program():
    scripts = (ROOT / name for name in ("tools/release.sh", "tools/release_check.sh"))
    started = {name for script in scripts for name in re.findall(r"^ *(tools/[\w/]+\.(?:py|sh))", script.read_text(), re.M)}
    assert "tools/package_release.py" in started and not [name for name in started if not (ROOT / name).stat().st_mode & 0o100]


def test_what_is_missing_is_one_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["package_release.py", "--root", str(ROOT), "--out", str(tmp_path), "--epoch", "1", "--targets", "linux-nothing"])
    assert package_release.main() == 1
    assert capsys.readouterr().err == "package_release: nothing is compiled for linux-nothing; run tools/cross.sh linux-nothing\n"
