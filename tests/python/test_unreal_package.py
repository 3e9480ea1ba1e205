"""The zips of tools/package_unreal.py: whole, with licences, stamped, and without anything of the machine that made them."""
import hashlib
import json
import pathlib
import re
import shutil
import subprocess
import sys
import zipfile

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import package_unreal  # noqa: E402
from unreal_lint.build import strict  # noqa: E402
from unreal_lint.check import check  # noqa: E402
from unreal_stage.layout import THIRD_PARTY, version_of  # noqa: E402
from unreal_stage.third_party import LIBRARIES, Missing  # noqa: E402

ENGINES = ("5.3", "5.6")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out, licences = tmp_path_factory.mktemp("package"), tmp_path_factory.mktemp("licences")
    (licences / "cairo.txt").write_text("MPL")
    subprocess.run([sys.executable, str(ROOT / "tools/package_unreal.py"), "--out", str(out), "--linux", shutil.which("true"),
                    "--windows", shutil.which("false"), "--licences", str(licences), "--engines", *ENGINES],
                   check=True, capture_output=True)
    return out


def test_a_shop_may_want_it_without_programs(tmp_path):
    subprocess.run([sys.executable, str(ROOT / "tools/package_unreal.py"), "--out", str(tmp_path), "--linux", shutil.which("true"),
                    "--no-programs", "--engines", "5.6"], check=True, capture_output=True)
    with zipfile.ZipFile(tmp_path / f"Consac-{version_of(ROOT)}-UE5.6.zip") as archive:
        assert not [name for name in archive.namelist() if "/Programs/" in name or name.endswith(".exe")]
        assert b"Programs" not in archive.read("Consac/Config/FilterPlugin.ini")


@pytest.fixture(scope="module", params=ENGINES)
def package(request, folder):
    """(engine, path in the plugin -> bytes) of one zip."""
    with zipfile.ZipFile(folder / f"Consac-{version_of(ROOT)}-UE{request.param}.zip") as archive:
        assert archive.testzip() is None
        assert all(name.startswith("Consac/") for name in archive.namelist())
        return request.param, {name.removeprefix("Consac/"): archive.read(name) for name in archive.namelist()}


def test_the_manifest_is_the_package(package):
    _, files = package
    listed = dict(reversed(line.split("  ")) for line in files["MANIFEST.sha256"].decode().splitlines())
    assert set(listed) == set(files) - {"MANIFEST.sha256"} and len(listed) > 500
    assert all(hashlib.sha256(files[name]).hexdigest() == digest for name, digest in listed.items())


def test_the_descriptor_is_stamped_and_strict(package):
    engine, files = package
    descriptor = strict(files["Consac.uplugin"].decode())
    assert descriptor["EngineVersion"] == engine + ".0" and descriptor["VersionName"] == version_of(ROOT)
    plain = json.loads((ROOT / package_unreal.PLUGIN / "Consac.uplugin").read_text())
    assert {k: v for k, v in descriptor.items() if k != "EngineVersion"} == plain
    with pytest.raises(Missing):
        package_unreal.stamped(b"{}", engine)


def test_licences_documents_and_graphs_are_there(package):
    _, files = package
    assert files["LICENSE"] == (ROOT / "LICENSE").read_bytes()
    for library in LIBRARIES:
        assert f"{THIRD_PARTY}/{library.name}/LICENSE.txt" in files
    for page in (name for name in files if name.startswith("Docs/") and name.endswith(".md")):
        for link in re.findall(r"\]\(([^)#:]+)\)", files[page].decode()):
            assert f"Docs/{link}" in files, f"{page} links to {link}"
    assert files["Programs/Linux/Licenses/cairo.txt"] == b"MPL"
    assert len([name for name in files if name.startswith("graphs/")]) >= 5


def test_every_file_of_the_filter_is_there(package, tmp_path):
    _, files = package
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(text)
    assert [found for found in check(tmp_path, ROOT / "engines/unreal/symbols.csv") if found[2] == "R74"] == []


def test_nothing_of_this_machine_is_in_it(package):
    _, files = package
    assert not [name for name in files if re.search(r"_test\.(h|cpp|py)$|(^|/)tests?/|\.orig$|~$|__pycache__", name)]
    outside = re.compile(rb"(?<![\w.:/\"<-])/(home|root|tmp|work|build)/\w")
    ours = {name: text for name, text in files.items() if "/ThirdParty/" not in name and not name.startswith("Programs/")}
    assert [name for name, text in ours.items() if outside.search(text) or str(ROOT).encode() in text] == []


def test_the_programs_lie_where_the_node_looks(package, folder):
    _, files = package
    node = (ROOT / package_unreal.PLUGIN / "Source/Consac/Private/ConsacTrainerProgram.cpp").read_text()
    for place, given in ((package_unreal.LINUX, "true"), (package_unreal.WINDOWS, "false")):
        assert files[place] == pathlib.Path(shutil.which(given)).read_bytes()
        assert ", ".join(f'TEXT("{step}")' for step in place.split("/")) in node
        with zipfile.ZipFile(folder / f"Consac-{version_of(ROOT)}-UE5.3.zip") as archive:
            assert archive.getinfo("Consac/" + place).external_attr >> 16 == 0o100755
    assert b"libc.so.6" in files["Programs/Linux/README.txt"]
    assert files["Programs/Win64/Licenses/cairo.txt"] == b"MPL"


def test_a_program_without_licences_is_not_packed(tmp_path):
    program = tmp_path / "consac.exe"
    program.write_bytes(b"MZ")
    with pytest.raises(Missing, match="no licences"):
        package_unreal.program_files(package_unreal.WINDOWS, program, tmp_path)


def test_the_same_inputs_give_the_same_bytes(tmp_path):
    files = {"b": b"2", "a": b"1"}
    for name in ("x.zip", "y.zip"):
        package_unreal.pack(files, tmp_path / name)
        files = dict(reversed(files.items()))
    assert (tmp_path / "x.zip").read_bytes() == (tmp_path / "y.zip").read_bytes()
