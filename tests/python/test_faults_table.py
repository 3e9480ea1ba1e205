"""docs/faults.md: every row is there, and every test that it names exists. And what only a compiler can show (B16)."""
import pathlib
import re
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROWS = [f"{group}{number}" for group, last in (("A", 18), ("B", 18), ("C", 18)) for number in range(1, last + 1)]


def rows():
    """(row, fault, what happens, tests) of every line of the tables."""
    for line in (ROOT / "docs/faults.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if re.fullmatch(r"[ABC]\d+", cells[0]):
            yield cells


def names_in_sources():
    """Suite.Name of every C++ test, file.py::name of every Python one."""
    names = set()
    for folder in ("core/test", "learn/test", "run/test", "tests"):
        for path in (ROOT / folder).rglob("*_test.cpp"):
            for suite, name in re.findall(r"^TEST(?:_P|_F)?\(\s*(\w+),\s*(\w+)\)", path.read_text(), re.M):
                names.add(f"{suite}.{name}")
    for folder in ("python/tests", "tests/python", "tests/godot"):
        for path in (ROOT / folder).glob("test_*.py"):
            names.update(f"{path.name}::{name}" for name in re.findall(r"^def (test_\w+)", path.read_text(), re.M))
    return names


def test_every_row_is_there_once():
    assert [cells[0] for cells in rows()] == ROWS


@pytest.mark.parametrize("cells", list(rows()), ids=lambda cells: cells[0])
def test_every_test_that_is_named_exists(cells):
    row, fault, happens, tests = cells
    assert fault and happens
    named = re.findall(r"`([^`]+)`", tests)
    assert named, f"{row} names no test"
    missing = [name for name in named if name not in names_in_sources()]
    assert not missing, f"{row} names tests that do not exist"


def test_every_budget_names_tests_that_exist():
    budgets = (ROOT / "docs/faults.md").read_text().split("## Budgets")[1]
    lines = [line for line in budgets.splitlines() if line.startswith("| ") and not line.startswith(("| of ", "| way in "))]
    assert lines
    for line in lines:
        named = re.findall(r"`([\w/]+\.\w+)`", line.strip().strip("|").split("|")[-1])
        assert named and not [name for name in named if name not in names_in_sources()], line


def test_every_fault_test_is_in_its_row():
    table = {cells[0]: cells[3] for cells in rows()}
    for name in names_in_sources():
        found = re.match(r"Fault[ABC]\w*\.([ABC]\d+)_", name)
        if found:
            assert f"`{name}`" in table[found.group(1)], name


def test_a_big_endian_host_is_refused_by_the_compiler():
    compiler = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")
    assert compiler, "a C++ compiler built what is tested here"
    command = [compiler, "-std=c++20", "-fsyntax-only", "-I", str(ROOT / "core/include"), "-I", str(ROOT / "core/src"),
               str(ROOT / "core/src/protocol/protocol2_frames.cpp")]
    assert subprocess.run(command, capture_output=True).returncode == 0
    other = subprocess.run(command + ["-U__BYTE_ORDER__", "-D__BYTE_ORDER__=__ORDER_BIG_ENDIAN__"],
                           capture_output=True, text=True)
    assert other.returncode != 0
    assert "frames are little-endian" in other.stderr
