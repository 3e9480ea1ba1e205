"""Names of the plugin and of the engine beside a stub of the engine's Python interface (PyPI's unreal-stub, of Unreal 5.6),
which lists every class that Blueprints see, with its module and header."""
import csv
import functools
import importlib.util
import pathlib
import re
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from unreal_docs import engine  # noqa: E402
from unreal_lint.model import Plugin  # noqa: E402

CLASS = re.compile(r'^class (\w+)\((\w+)[^)]*\):\n(?:    r?"""(.*?)""")?', re.M | re.S)
# Known to the header tool by itself, not by a header of their own.
BUILT_IN = {"UObject", "UClass", "UInterface", "UEditorEngine"}


@functools.cache
def stub_text():
    return pathlib.Path(importlib.util.find_spec("unreal").origin).with_name("unreal.py").read_text(encoding="utf-8")


@functools.cache
def stub():
    """Python name -> (base, module, header)."""
    found = {}
    for name, base, doc in CLASS.findall(stub_text()):
        module, header = (re.search(rf"\*\*{word}\*\*: ([\w.]+)", doc) for word in ("Module", "File"))
        found[name] = (base, module[1] if module else "", header[1] if header else "")
    return found


def python_class(name):
    """The stub's row of an engine class; Kismet goes from names there."""
    return stub().get(name[1:]) or stub().get(name[1:].removeprefix("Kismet"))


def symbols():
    with (ROOT / "engines/unreal/symbols.csv").open(encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if "::" not in row["symbol"]]


def misplaced(row):
    """What is wrong with a class of the table; '' where the stub says the same."""
    found = python_class(row["symbol"])
    if found is None:
        return f"{row['symbol']}: Blueprints know no such class"
    if found[1] != row["module"] or found[2] not in {include.split("/")[-1] for include in row["include"].split(";")}:
        return f"{row['symbol']}: is in {found[2]} of module {found[1]}"
    return ""


def test_the_stub_is_whole():
    assert len(stub()) > 8000 and stub()["ActorComponent"] == ("Object", "Engine", "ActorComponent.h")


def test_every_engine_class_of_the_table_is_one_that_blueprints_know():
    rows = [row for row in symbols() if row["kind"] == "class" and re.match(r"[UA][A-Z]", row["symbol"]) and row["symbol"] not in BUILT_IN]
    assert len(rows) > 15
    assert [wrong for wrong in map(misplaced, rows) if wrong] == []


@pytest.mark.parametrize("change", [{"symbol": "UActorComponents"}, {"module": "Core"}, {"include": "Components/Actor.h"}])
def test_a_wrong_row_is_told(change):
    row = next(row for row in symbols() if row["symbol"] == "UActorComponent")
    assert misplaced(row) == "" and misplaced(row | change) != ""


def test_math_structs_are_structs_of_the_engine():
    rows = [row["symbol"] for row in symbols() if row["kind"] == "struct" and row["symbol"][1:] in stub()]
    assert {"FVector", "FRotator", "FTransform"} <= set(rows)
    assert [name for name in rows if stub()[name[1:]][0] in ("Object", "EnumBase")] == []


def clashes(names):
    """Names that an engine class, struct or enum has too; prefix letter and case do not part them."""
    taken = {name.lower() for name in stub()}
    return [name for name in names if name[1:].lower() in taken]


def test_no_name_of_the_plugin_is_one_of_the_engine():
    names = [type_.name for _, type_ in Plugin(ROOT / "engines/unreal/Consac").types if type_.kind]
    assert len(names) > 20
    assert clashes(names) == [] and clashes(["FVector", "UActorcomponent", "FConsacSpace"]) == ["FVector", "UActorcomponent"]


def functions_of(class_):
    """Names of a stub class's functions, its bases' left out."""
    body = re.search(rf"^class {class_}\(.*?(?=^class )", stub_text(), re.M | re.S).group()
    return set(re.findall(r"^    def (\w+)\(", body, re.M))


def snake(name):
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def test_the_engine_nodes_of_the_graphs_exist():
    asked = [row for row in engine.BY_NAME.values() if row["function"]]
    for row in asked:
        class_ = row["class"].rsplit(".", 1)[-1].removeprefix("Kismet")
        assert snake(row["function"].replace("_", "")) in functions_of(class_) or snake(row["function"]) in {
            name.replace("__", "_") for name in functions_of(class_)}, row
    assert snake("PrintStrings") not in functions_of("SystemLibrary")
