"""One version: that of CMakeLists.txt stands wherever another file has to name it."""
import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).parents[2]
VERSION = re.search(r"project\(consac VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]


@pytest.mark.parametrize("file, pattern", [
    ("core/include/consac/base/version.h", r'kVersion = "([^"]+)"'),
    ("python/consac/__init__.py", r'__version__ = "([^"]+)"'),
    ("engines/unreal/Consac/Consac.uplugin", r'"VersionName": "([^"]+)"'),
    ("spec/model_file.md", r'"producer": \{"name": "consac", "version": "([^"]+)"\}'),
    ("CHANGELOG.md", r"^## (\S+)")])
def test_every_place_has_the_projects(file, pattern):
    assert re.search(pattern, (ROOT / file).read_text(), re.M)[1] == VERSION


def test_no_other_file_of_the_package_names_one():
    named = [path.name for path in (ROOT / "python").rglob("*") if path.suffix in (".py", ".toml") and f'{VERSION}"' in path.read_text()]
    assert named == ["__init__.py"]
