"""One version: that of core's header stands wherever another file has to repeat it, and tools/version.py raises all of them."""
import pathlib
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import version  # noqa: E402

VERSION = version.version_of(ROOT)


@pytest.mark.parametrize("place", version.PLACES)
def test_every_place_has_the_headers(place):
    assert version.at(ROOT, place) == VERSION


def test_no_other_file_of_the_package_names_one():
    named = [path.name for path in (ROOT / "python").rglob("*") if path.suffix in (".py", ".toml") and f'{VERSION}"' in path.read_text()]
    assert named == ["__init__.py"]


@pytest.fixture
def tree(tmp_path):
    for place in (*version.PLACES, "tools/version.py"):
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / place, tmp_path / place)
    return tmp_path


def raise_to(tree, number):
    return subprocess.run([sys.executable, tree / "tools/version.py", number], capture_output=True, text=True)


def test_raising_writes_every_place_and_nothing_else(tree):
    before = {place: (tree / place).read_text() for place in version.PLACES}
    assert raise_to(tree, "7.8.9").stdout == "7.8.9\n"
    for place, text in before.items():
        assert version.at(tree, place) == "7.8.9"
        assert version.at(ROOT, place) == VERSION and (tree / place).read_text().replace("7.8.9", VERSION) == text


def test_what_is_released_keeps_its_heading(tree):
    changes = tree / "CHANGELOG.md"
    changes.write_text(changes.read_text().replace(f"## {VERSION} (unreleased)", f"## {VERSION}"))
    assert raise_to(tree, "7.8.9").returncode == 0
    assert "## 7.8.9 (unreleased)\n\n### Changed\n\n## " + VERSION + "\n" in changes.read_text()


def test_what_is_no_version_is_refused(tree):
    said = raise_to(tree, "v1.2")
    assert said.returncode == 1 and "three numbers" in said.stderr and version.version_of(tree) == VERSION
