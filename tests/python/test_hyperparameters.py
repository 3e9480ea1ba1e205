"""The engines' properties for hyperparameters are those of the program's own table."""
import dataclasses
import os
import pathlib
import re
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import generate_hyperparameters as generate  # noqa: E402
from hyperparameters import godot, table, unreal  # noqa: E402

BUILD = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/dev"))


@pytest.fixture(scope="module")
def algorithms():
    return table.read(BUILD / "cli/consac")


def test_the_committed_files_are_up_to_date(algorithms):
    assert generate.differences(generate.generated(algorithms), ROOT) == []


def test_a_change_of_the_table_is_told(algorithms, tmp_path):
    files = generate.generated(algorithms)
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert generate.differences(files, tmp_path) == []
    first = algorithms[0]
    row = dataclasses.replace(first.rows[0], default="0.5")
    changed = [dataclasses.replace(first, rows=(row, *first.rows[1:])), *algorithms[1:]]
    assert len(generate.differences(generate.generated(changed), tmp_path)) == 2  # one for each engine
    assert "no such algorithm" in " ".join(generate.differences(generate.generated(algorithms[1:]), tmp_path))


def test_every_hyperparameter_is_a_property_of_both_engines(algorithms):
    header, source = unreal.header(algorithms), unreal.source(algorithms)
    for algorithm in algorithms:
        body = header.split(f"class CONSAC_API {unreal.class_name(algorithm)}")[1].split("\n};")[0]
        collect = source.split(f"void {unreal.class_name(algorithm)}::Collect")[1].split("\n}\n")[0]
        assert list(dict.fromkeys(re.findall(r'Into, TEXT\("(\w+)"\)', collect))) == [row.name for row in algorithm.rows]
        script = godot.script(algorithm)
        for row in algorithm.rows:
            assert re.search(rf"\b{unreal.property_name(row)} = ", body), row.name
            assert re.search(rf"^@export.* var {row.name}: ", script, re.M), row.name
            assert f'\t\t"{row.name}": ' in script
            assert row.meaning[1:] in " ".join(body.replace("*", " ").split())


def row_of(**changes):
    base = {"name": "ent_coef", "kind": "real", "default": "0.01", "low": 0.0, "high": 1.0, "choices": (), "optional": False,
            "meaning": "weight of the entropy bonus", "source": "ours"}
    return table.Row(**(base | changes))


@pytest.mark.parametrize("row, declared, exported", [
    (row_of(), 'ClampMin="0", ClampMax="1")', "@export_range(0.0, 1.0, 1e-8) var ent_coef: float = 0.01"),
    (row_of(low=1e-6, high=2.5e-30), 'ClampMin="0.000001", ClampMax="0.0000000000000000000000000000025")', "@export_range(1e-06, 2.5e-30, 1e-8)"),
    (row_of(high=float("inf")), 'meta=(ClampMin="0"))', '@export_range(0.0, 1.0, 1e-8, "or_greater") var ent_coef'),
    (row_of(kind="integer", default="3", low=1.0, high=1e9), "int32 EntCoef = 3;", "@export_range(1, 1000000000, 1) var ent_coef: int = 3"),
    (row_of(optional=True, default="none"), "bool bSetEntCoef = false;", "@export var set_ent_coef: bool = false"),
    (row_of(kind="boolean", default="true"), "bool bEntCoef = true;", "@export var ent_coef: bool = true"),
    (row_of(kind="schedule", default="lin_3e-4"), "FConsacSchedule(3e-4, true)", "var ent_coef_linear: bool = true"),
    (row_of(kind="choice", default="b", choices=("a", "b")), "EConsacEntCoef EntCoef = EConsacEntCoef::B;", '@export_enum("a", "b")'),
    (row_of(kind="text", default="[64]"), 'FString EntCoef = TEXT("[64]");', 'var ent_coef: String = "[64]"'),
])
def test_a_row_of_every_kind(row, declared, exported):
    assert declared in unreal.declaration(row, {("a", "b"): "EConsacEntCoef"})
    assert exported in godot.declaration(row)


def test_rows_are_read():
    row = table.read_row({"name": "x", "alias": "", "type": "number", "default": "none", "range": "-inf to 2, none", "meaning": "m", "source": "s"})
    assert (row.kind, row.low, row.high, row.optional) == ("real", float("-inf"), 2.0, True)
    row = table.read_row({"name": "x", "alias": "", "type": "choice", "default": "a", "range": "a|b", "meaning": "m", "source": "s"})
    assert row.choices == ("a", "b") and not row.optional
