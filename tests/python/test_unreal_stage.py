"""What tools/stage_unreal.py puts into the Unreal plugin: our files byte for byte, all that they include, a manifest."""
import hashlib
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import stage_unreal  # noqa: E402
from unreal_lint.model import read_build  # noqa: E402
from unreal_lint.tokens import tokenize  # noqa: E402
from unreal_stage import layout, third_party  # noqa: E402

SYSTEM = pathlib.Path("/usr/include")
COPIED = {"ConsacCore": ("core",), "ConsacLearn": ("learn", "engines/host")}


@pytest.fixture(scope="module")
def files():
    return layout.plan(ROOT, SYSTEM)


@pytest.fixture()
def staged(files, tmp_path):
    stage_unreal.stage(files, tmp_path)
    return tmp_path


def test_our_sources_are_copied_whole_and_no_test_is(files):
    for module, parts in COPIED.items():
        ours = sorted(path.read_bytes() for part in parts for folder in ("include", "src")
                      for path in (ROOT / part / folder).rglob("*") if path.suffix in (".h", ".cpp"))
        worlds = [path.read_bytes() for path in layout.world_files(ROOT)] if module == "ConsacLearn" else []
        ours = sorted(ours + worlds)
        copies = sorted(text for name, text in files.items() if re.match(rf"Source/{module}/(Public|Private)/", name))
        assert copies == ours and len(ours) > 10
    assert not [name for name in files if re.search(r"_test\.|/tests?/", name)]


def test_every_source_is_compiled_once(files):
    sources = {name for name in files if re.match(r"Source/Consac(Core|Learn)/", name) and name.endswith((".cpp", ".cc"))}
    included = [str(pathlib.PurePosixPath("Source", found.removeprefix("../../../")))
                for name, text in files.items() if name.startswith(layout.STAGED)
                for found in re.findall(r'#include "(\.\./[^"]+)"', text.decode())]
    assert sorted(included) == sorted(sources)


def test_modules_hold_sources_alone(files):
    for module in COPIED:
        path = f"Source/{module}/{module}.Build.cs"
        build = read_build(path, tokenize(files[path].decode()))
        assert build.class_name == module and build.passes_target
        assert build.settings["Type"] == "ModuleType.External"
        assert b"IMPLEMENT_MODULE" not in b"".join(text for name, text in files.items() if name.startswith(f"Source/{module}/P"))


def test_definitions_are_those_of_cmake(files):
    prefix = files[f"{layout.STAGED}/ConsacStaged.h"].decode()
    asked = re.search(r"set\(CONSAC_EMBED_DEFINITIONS ([^)]*)\)", (ROOT / "CMakeLists.txt").read_text()).group(1).split()
    assert len(asked) >= 4
    for name in [*asked, "NOMINMAX", "WIN32_LEAN_AND_MEAN", "_WIN32_WINNT 0x0A00"]:
        assert f"#define {name}\n" in prefix
    with pytest.raises(third_party.Missing, match="no longer says"):
        layout.cmake_words(ROOT / "CMakeLists.txt", r"set\(CONSAC_NOTHING ([^)]*)\)")


def test_no_warning_of_a_newer_compiler_stops_a_game(files):
    prefix = files[f"{layout.STAGED}/ConsacStaged.h"].decode()
    microsofts = prefix.split("#if !defined(CONSAC_ALL_WARNINGS)")[1].split("_MSC_VER")[1]
    assert "#pragma warning(push, 0)\n" in microsofts, "the level of Unreal's build tool is 4"
    assert re.search(r"disable : 4668 4191 4702\)", microsofts)


@pytest.mark.parametrize(("library", "has"), [(13000, False), (14000, True)])
def test_a_libcxx_without_to_chars_for_floats_is_not_asked(library, has):
    command = ["g++", "-std=c++20", "-E", f"-D_LIBCPP_VERSION={library}", "-Icore/include", "-Icore/src", "core/src/base/text.cpp"]
    text = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    ours = text[text.rindex("FormatShortest(Number value"):]
    assert ("std::to_chars(" in ours) is has
    assert ("return FormatWithoutToChars(" in ours) is not has


def test_nothing_is_included_from_outside(staged, tmp_path):
    """The preprocessor over all sources as one: every library's header comes from the staged folder."""
    roots = [f"-I{staged}/Source/{module}/{folder}" for module in COPIED for folder in ("Public", "Private")]
    roots += [f"-isystem{path.parent}" for path in sorted((staged / layout.THIRD_PARTY).glob("*/LICENSE.txt"))]
    unity = tmp_path / "unity.cpp"
    unity.write_text("".join(f'#include "{path}"\n' for path in sorted((staged / layout.STAGED).glob("*.cpp"))))
    result = subprocess.run(["g++", "-std=c++20", "-fno-exceptions", "-fno-rtti", "-M", *roots, unity], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr[:2000]
    reached = result.stdout.split()
    folders = {folder for library in third_party.LIBRARIES for folder in library.folders}
    assert not [name for name in reached if re.match(rf"/usr/include/(eigen3/)?({'|'.join(folders)})[/.]", name)]
    for library in third_party.LIBRARIES:
        assert any(f"/ThirdParty/{library.name}/" in name for name in reached), f"nothing of {library.name} is used"


def test_nothing_starts_winsock_while_windows_loads_the_plugin(files):
    """A static object would; every asio::io_context, which all sockets of ours hang on, starts it too."""
    asio = {name: text for name, text in files.items() if "/ThirdParty/asio/" in name and name.endswith(("pp", ".h"))}
    objects = [name for name, text in asio.items() if re.search(rb"^\s*(static |inline )?(const )?(detail::)?winsock_init<[^>]*>&? *\w+ *[=;]", text, re.M)]
    assert objects == [f"{layout.THIRD_PARTY}/asio/asio/io_context.hpp"]
    assert b"Changed: asio/detail/winsock_init.hpp" in files[f"{layout.THIRD_PARTY}/README.txt"]
    with pytest.raises(third_party.Missing, match="no longer says"):
        third_party.cut("asio/detail/winsock_init.hpp", b"class winsock_init;")


def test_every_library_has_its_licence(files):
    for library in third_party.LIBRARIES:
        assert len(files[f"{layout.THIRD_PARTY}/{library.name}/LICENSE.txt"]) > 500
    with pytest.raises(third_party.Missing, match="must not go into a plugin"):
        third_party.refuse_copyleft("x.h", b"// under the GNU Lesser General Public License")


def test_the_manifest_says_what_is_there(staged):
    for folder in layout.FOLDERS:
        lines = (staged / folder / layout.MANIFEST).read_text().splitlines()
        listed = {}
        for line in lines:
            digest, name = line.split("  ")
            listed[name] = digest
            assert hashlib.sha256((staged / folder / name).read_bytes()).hexdigest() == digest
        there = {p.relative_to(staged / folder).as_posix() for p in (staged / folder).rglob("*") if p.is_file()}
        assert set(listed) == there - {layout.MANIFEST}


def test_staging_again_changes_nothing(files, staged):
    assert stage_unreal.differences(files, staged) == []
    assert stage_unreal.stage(files, staged) == 0


def test_an_edit_is_told_and_undone(files, staged):
    core = staged / "Source/ConsacCore/Public/consac/base/status.h"
    core.write_text(core.read_text() + "// an edit\n")
    (staged / "Source/ConsacLearn/Private/own.cpp").write_text("int own;\n")
    (staged / f"{layout.STAGED}/ConsacStaged.h").unlink()
    found = stage_unreal.differences(files, staged)
    assert [line.split(": ")[1].split(";")[0] for line in sorted(found)] == [
        "missing", "differs from the repository", "not staged by tools/stage_unreal.py"]
    assert stage_unreal.stage(files, staged) == 3
    assert stage_unreal.differences(files, staged) == []


def test_a_machine_without_the_libraries_is_told(tmp_path):
    with pytest.raises(third_party.Missing, match="run tools/setup.sh unreal"):
        third_party.closure([b"#include <asio/io_context.hpp>\n"], tmp_path)
    with pytest.raises(third_party.Missing, match="source of Highway"):
        third_party.highway_sources({}, tmp_path)
