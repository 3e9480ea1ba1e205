"""The stand-in of Unreal (engines/unreal/shim) has what the table of symbols has, member for member, in the same headers;
so that what compiles there uses nothing else."""
import pathlib
import re
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from unreal_lint import model, symbols  # noqa: E402

INCLUDE = ROOT / "engines/unreal/shim/include"
TABLE = symbols.Table(ROOT / "engines/unreal/symbols.csv")
ROWS = {row.symbol: row for row in TABLE.rows}
GENERATED = {"Super", "ThisClass", "StaticClass"}  # what GENERATED_BODY gives every class
OPERATORS = {"const", "void"}  # what the parser takes for the name of an operator, or of void() in a template


def read(name: str):
    return model.read_file(name, (INCLUDE / name).read_bytes())


FILES = {path.relative_to(INCLUDE).as_posix(): read(path.relative_to(INCLUDE).as_posix()) for path in sorted(INCLUDE.rglob("*.h"))}


def own(member: str) -> bool:
    """Names that only the shim and its tests use."""
    return member.lower().startswith("shim")


def shim_members() -> dict[str, set[str]]:
    """class -> public members that a plugin can reach."""
    found: dict[str, set[str]] = {}
    for file in FILES.values():
        for type_ in file.types:
            names = found.setdefault(type_.name, set())
            if type_.keyword == "enum":
                names |= {t.text for t in type_.body if t.kind == "word" and not own(t.text)}
                continue
            for member in type_.members:
                plain = not own(member.name) and not member.name.startswith(("~", "operator")) and member.name != type_.name
                if member.access != "private" and plain and member.name not in GENERATED | OPERATORS and re.fullmatch(r"[A-Za-z]\w*", member.name):
                    names.add(member.name)
    return found


MEMBERS = shim_members()
TABLE_MEMBERS: dict[str, set[str]] = {}
for _row in TABLE.rows:
    if "::" in _row.symbol:
        TABLE_MEMBERS.setdefault(_row.symbol.split("::")[0], set()).add(_row.symbol.split("::")[1])


def text_of(include: str) -> str:
    """A header of the shim with what it takes from Shim/."""
    name = "Shim/Macros.h" if include == "*.generated.h" else include
    text, todo, seen = "", [name], set()
    while todo:
        at = todo.pop()
        if at in seen:
            continue
        seen.add(at)
        content = (INCLUDE / at).read_text(encoding="utf-8")
        text += content
        todo += [found for found in re.findall(r'#include "(Shim/[^"]+)"', content)]
    return text


@pytest.mark.parametrize("row", TABLE.rows, ids=lambda row: row.symbol)
def test_every_row_is_in_the_shim_in_its_header(row):
    for include in row.includes:
        assert re.search(rf"\b{re.escape(row.symbol.rsplit('::', 1)[-1])}\b", text_of(include)), f"{include} has no {row.symbol}"


@pytest.mark.parametrize("name", sorted(set(MEMBERS) & {row.symbol for row in TABLE.rows}))
def test_no_class_of_the_shim_has_a_member_that_the_table_lacks(name):
    extra = MEMBERS[name] - TABLE_MEMBERS.get(name, set()) - {row.symbol for row in TABLE.rows}
    assert not extra, f"{name} has {', '.join(sorted(extra))}; add it to symbols.csv with its source, or remove it"


def test_no_header_of_the_shim_that_the_table_lacks():
    known = {include for row in TABLE.rows for include in row.includes}
    assert {name for name in FILES if not name.startswith("Shim/")} <= known


def test_the_check_sees_a_planted_member():
    planted = model.read_file("X.h", b"class FApp {\n public:\n  static bool UseFixedTimeStep() { return true; }\n  static void Quit() {}\n};\n")
    names = {member.name for type_ in planted.types for member in type_.members}
    assert names == {"UseFixedTimeStep", "Quit"}


def test_a_method_that_unreal_does_not_have_is_in_no_class():
    assert "RemoveAt" not in MEMBERS["TArray"] and {"Num", "Add"} <= MEMBERS["TArray"]
