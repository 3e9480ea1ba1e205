"""Node table, graphs, pictures, pasteable text and documents of the Unreal plugin agree with its headers, and every check of
it finds a planted error."""
import importlib.util
import pathlib
import re
import shutil
import sys
import xml.etree.ElementTree

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from unreal_docs import agreement, graph, nodes, paste, picture  # noqa: E402
from unreal_lint.model import Plugin  # noqa: E402

SPEC = importlib.util.spec_from_file_location("unreal_docs_command", ROOT / "tools/unreal_docs.py")
command = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(command)

PLUGIN = "engines/unreal/Consac"
SOURCES = ["core/include/consac/base/version.h", "docs/unreal.md", "docs/unreal-nodes.md", "engines/unreal/nodes.json", "docs/images",
           "engines/unreal/graphs", PLUGIN]


@pytest.fixture(scope="module")
def table():
    return nodes.table(Plugin(ROOT / PLUGIN))


@pytest.fixture(scope="module")
def catalogue(table):
    return graph.Catalogue(table)


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of what the check reads; tests put back what they change."""
    root = tmp_path_factory.mktemp("repository")
    for name in SOURCES:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("ConsacCore", "ConsacLearn", "Staged"))
        else:
            shutil.copy(ROOT / name, root / name)
    return root


def test_the_repository_agrees():
    assert command.check(ROOT) == []


# (file, text, its replacement, what the check then says)
PLANTED = [
    (f"{PLUGIN}/Consac.uplugin", '"VersionName": "', '"VersionName": "9', "VersionName is '9"),
    (f"{PLUGIN}/Consac.uplugin", '{ "Name": "Consac", ', '{ "Name": "ConsacOther", ', "module ConsacOther has no build file"),
    (f"{PLUGIN}/Consac.uplugin", '{ "Name": "Consac", ', '{ "Name": "ConsacOther", ', "module Consac is not in Consac.uplugin"),
    (f"{PLUGIN}/Consac.uplugin", '"Modules": [', '"Modules": [ { "Name": "ConsacCore" },', "ConsacCore holds sources alone"),
    (f"{PLUGIN}/Source/Consac/Consac.Build.cs", '"ConsacLearn"', '"Json"', "ConsacLearn belongs into PrivateDependencyModuleNames"),
    (f"{PLUGIN}/Source/Consac/Consac.Build.cs", "FPSemanticsMode.Precise", "FPSemanticsMode.Default", "FPSemantics must be"),
    (f"{PLUGIN}/Source/Consac/Consac.Build.cs", "CppStandardVersion.Cpp20", "CppStandardVersion.Cpp17", "CppStandard must be"),
    (f"{PLUGIN}/Source/Consac/Public/ConsacSocket.h", "Open Socket", "Open The Socket", "the thesis' node 'Open Socket' is missing"),
    (f"{PLUGIN}/Source/Consac/Public/ConsacSocket.h", "Open Socket", "Open The Socket", "nodes.json: differs"),
    (f"{PLUGIN}/Source/Consac/Public/ConsacSocket.h", "Open Socket", "Open The Socket", "0 nodes are called 'Open Socket'"),
    (f"{PLUGIN}/Source/Consac/Public/ConsacSocket.h", "Open Socket", "Close Socket", "two nodes are called 'Close Socket'"),
    (f"{PLUGIN}/Source/Consac/Public/ConsacSocket.h", "/** Whether the port is open. */", "", "IsOpen has no tooltip"),
    (f"{PLUGIN}/Source/Consac/Public/ConsacSocket.h", 'Category="Consac|Socket", meta=(DisplayName="Is Open")', 'Category="Net"',
     "is in category 'Net'"),
    (f"{PLUGIN}/Source/Consac/Public/ConsacSocket.h", "const FString& Message, EConsacResult& Result, FString& Error",
     "const FString& Message, EConsacResult& Result", "SendData can fail and does not say why"),
    (f"{PLUGIN}/Source/Consac/Public/ConsacEnvironmentComponent.h", "bool bDone", "bool bOver", "'Training' has no input pin 'bDone'"),
    (f"{PLUGIN}/Source/Consac/Public/ConsacEnvironmentComponent.h", "float Reward", "int32 Reward", "Reward is float, Reward of 'Training' is int"),
    (f"{PLUGIN}/Source/Consac/Public/ConsacTypes.h", "	/** Numbers between bounds. */", "	/** Numbers in bounds. */", "unreal-nodes.md: differs"),
    ("docs/unreal.md", "**Training Connection**", "**Train Connection**", "'Train Connection' is no node"),
    ("docs/unreal.md", "images/unreal-tick.svg", "images/unreal-tack.svg", "no graph for the picture unreal-tack.svg"),
    ("docs/unreal.md", "images/unreal-tick.svg", "images/unreal-tack.svg", "shows no picture unreal-tick.svg"),
    ("docs/images/unreal-tick.svg", "Event Tick", "Event Tock", "unreal-tick.svg: differs"),
    (f"{PLUGIN}/graphs/loop.txt", "TrainingConnection", "TrainingConnections", "graphs/loop.txt: differs"),
    ("engines/unreal/graphs/loop.graph", "node act at 62 0", "node act at 40 0", "cover each other"),
]


@pytest.mark.parametrize("name, old, new, message", PLANTED, ids=[f"{p[0].rsplit('/', 1)[-1]}-{p[3][:30]}" for p in PLANTED])
def test_a_planted_disagreement_is_told(copy, name, old, new, message):
    text = (copy / name).read_text()
    assert old in text
    (copy / name).write_text(text.replace(old, new))
    try:
        found = command.check(copy)
        assert any(message in line for line in found), found
    finally:
        (copy / name).write_text(text)


def test_the_copy_is_accepted_and_a_stale_file_is_told(copy):
    assert command.check(copy) == []
    extra = copy / f"{PLUGIN}/graphs/gone.txt"
    extra.write_text("")
    assert command.check(copy) == [f"{PLUGIN}/graphs/gone.txt: no graph draws it; remove it"]
    extra.unlink()


def test_pins_of_the_thesis_graph(table):
    rows = {row["node"]: row for row in table["nodes"]}
    training = rows["Training"]
    assert (training["function"], training["class"], training["kind"]) == ("Train", "UConsacEnvironmentComponent", "function")
    assert [(p["pin"], p["type"]) for p in training["pins"] if p["way"] == "out"] == [
        ("Step", "exec"), ("Reset", "exec"), ("Waiting", "exec"), ("Completed", "exec"), ("Failed", "exec"),
        ("Action", "FConsacAction"), ("Error", "string")]
    assert next(p for p in training["pins"] if p["pin"] == "Observation")["must_link"]
    wait = rows["Wait And Accept Message"]
    assert wait["kind"] == "async" and [p["pin"] for p in wait["pins"] if p["way"] == "out" and p["type"] == "exec"] == [
        "then", "OnMessage", "OnTimeout", "OnFailed"]
    setup = {p["pin"]: p for p in rows["Setup Environment"]["pins"]}
    assert setup["Port"]["default"] == "5005" and setup["Port"]["advanced"] and setup["Host"]["default"] == "127.0.0.1"
    assert rows["Is Connected"]["kind"] == "pure" and "execute" not in [p["pin"] for p in rows["Is Connected"]["pins"]]
    assert rows["Create Socket"]["pins"][1]["hidden"]


@pytest.mark.parametrize("written, shown", [
    ("int32", "int"), ("const FString&", "string"), ("TArray<float>", "float[]"), ("const TArray<FConsacEntry>&", "FConsacEntry[]"),
    ("UConsacModel*&", "UConsacModel"), ("TObjectPtr<UConsacModel>", "UConsacModel"), ("UPARAM(ref) FVector&", "FVector"),
    ("TSubclassOf<UConsacHyperparameters>", "class UConsacHyperparameters"), ("EConsacMode", "EConsacMode")])
def test_types_of_pins(written, shown):
    assert nodes.type_name(written) == shown


@pytest.mark.parametrize("name, shown", [("bAtGoal", "At Goal"), ("GetOpenPort", "Get Open Port"), ("NSteps", "N Steps"), ("Host", "Host")])
def test_names_are_shown_as_the_editor_shows_them(name, shown):
    assert nodes.display(name) == shown


def test_comments_become_tooltips():
    assert nodes.read_doc("Opens it.\nAt once.\n@param Port The port;\n 0 for any.\n@param Host Where.") == (
        "Opens it. At once.", {"Port": "The port; 0 for any.", "Host": "Where."})


GOOD = """title Small
component Environment UConsacEnvironmentComponent
variable Observation float[]
event Act Action FConsacAction
node tick at 0 0 Event Tick
node env at 0 8 get Environment
node see at 0 12 get Observation
node train at 20 0 Training
  Reward 1.5
  bDone true
node act at 44 0 call Act
tick -> train
env -> train.self
see -> train.Observation
train.Step -> act
train.Action -> act.Action
"""

# (text, its replacement, what is wrong then)
WRONG = [
    ("call Act", "call Move", "there is no event 'Move'"),
    ("get Environment", "get Nothing", "there is no variable or component 'Nothing'"),
    ("Training\n", "Trainings\n", "0 nodes are called 'Trainings'"),
    ("UConsacEnvironmentComponent", "UConsacEnvironment", "there is no type 'UConsacEnvironment'"),
    ("Observation float[]", "Observation int[]", "Observation is int[], Observation of 'Training' is float[]"),
    ("train.Step -> act", "train.Steps -> act", "'Training' has no output pin 'Steps'"),
    ("train.Action -> act.Action", "train.Action -> act.Act", "'Act' has no input pin 'Act'"),
    ("train.Action -> act.Action", "train.Error -> act.Action", "Error is string, Action of 'Act' is FConsacAction"),
    ("tick -> train\n", "tick -> train\ntick -> act\n", "the pin then of 'tick' has two wires"),
    ("see -> train.Observation\n", "see -> train.Observation\nsee -> train.Observation\n", "the pin Observation of 'train' has two wires"),
    ("see -> train.Observation\n", "", "Observation of 'Training' needs a wire"),
    ("env -> train.self\n", "", "self of 'Training' needs a wire"),
    ("Reward 1.5", "Rewards 1.5", "'Training' has no input pin 'Rewards'"),
    ("Reward 1.5", "Reward much", "'much' is no float"),
    ("  bDone true", "  Observation 1", "Observation of 'train' has a wire and a value"),
    ("tick -> train\n", "tick -> trains\n", "there is no node 'trains'"),
    ("tick -> train\n", "tick -> train -> act\n", "cannot read the link"),
    ("node see at 0 12", "node see at 0", "cannot read 'node see"),
    ("node see at 0 12", "node env at 0 12", "node 'env' is there twice"),
    ("title Small", "titel Small", "cannot read 'titel Small'"),
    ("tick -> train\n", "node lone at 60 0 Make Discrete Space\ntick -> train\n", "'lone' has no wire at all"),
    ("call Act", "break FConsacNothing", "there is no struct 'FConsacNothing'"),
    ("call Act", "on Environment: On Nothing", "has no event 'On Nothing'"),
]


def test_a_good_graph_is_accepted(catalogue):
    found = graph.read("small", GOOD, catalogue)
    assert found.faults == [] and picture.overlaps(found) == [] and len(found.links) == 5


@pytest.mark.parametrize("old, new, message", WRONG, ids=[w[2][:40] for w in WRONG])
def test_a_wrong_graph_is_told(catalogue, old, new, message):
    assert old in GOOD
    found = graph.read("small", GOOD.replace(old, new), catalogue)
    assert any(message in text for _, text in found.faults), found.faults
    assert all(line >= 1 for line, _ in found.faults)


def test_a_value_of_an_enum_is_one_of_its_values(catalogue):
    text = ("component Agent UConsacAgentComponent\nnode a at 0 0 Event Tick\nnode b at 20 0 End Episode\n  End {}\n"
            "node c at 0 9 get Agent\na -> b\nc -> b.self\n")
    assert graph.read("end", text.format("Truncated"), catalogue).faults == []
    assert "no EConsacEpisodeEnd" in graph.read("end", text.format("Dead"), catalogue).faults[0][1]


def test_a_subclass_goes_into_a_pin_of_its_base(catalogue):
    assert catalogue.fits("UConsacRaySensorComponent", "UConsacSensorComponent") and catalogue.fits("UConsacModel", "UObject")
    assert not catalogue.fits("UConsacSensorComponent", "UConsacRaySensorComponent") and not catalogue.fits("int", "float")


def test_pictures_are_drawings(catalogue):
    for path in sorted((ROOT / "engines/unreal/graphs").glob("*.graph")):
        found = graph.read(path.stem, path.read_text(), catalogue)
        root = xml.etree.ElementTree.fromstring(picture.svg(found))
        words = {text.text for text in root.iter("{http://www.w3.org/2000/svg}text")}
        assert found.title in words and {node.row["node"] for node in found.nodes.values() if node.row["kind"] != "get"} <= words
        left, top, width, height = (float(v) for v in root.get("viewBox").split())
        for card in picture.cards_of(found).values():
            assert left < card.x and top < card.y and card.x + card.w < left + width and card.y + card.h < top + height


PASTE_FAULTS = [
    (r'MemberName="Train"', 'MemberName="Trains"', "no node of the plugin calls ConsacEnvironmentComponent::Trains"),
    (r'PinName="bDone"', 'PinName="bOver"', "Train has no pin 'bOver'"),
    (r"/Script/Consac\.ConsacAction'", "/Script/Consac.ConsacActions'", "there is no type ConsacActions"),
    (r"LinkedTo=\(K2Node_Event_0 \w+,\),", "", "has one end only"),
    (r"LinkedTo=\(K2Node_Event_0 ", "LinkedTo=(K2Node_Event_7 ", "is linked to a pin that is not there"),
]


@pytest.mark.parametrize("pattern, new, message", PASTE_FAULTS, ids=[p[2] for p in PASTE_FAULTS])
def test_a_fault_of_pasteable_text_is_told(catalogue, pattern, new, message):
    text = paste.paste(graph.read("small", GOOD, catalogue), catalogue)
    assert paste.faults(text, catalogue) == []
    changed = re.sub(pattern, new, text)
    assert changed != text
    assert any(message in line for line in paste.faults(changed, catalogue)), paste.faults(changed, catalogue)


BOUND = """title Bound
component Agent UConsacAgentComponent
event Act
node observe at 0 0 on Agent: On Observe
node act at 20 0 call Act
observe -> act
node begin at 0 9 on Agent: On Episode Begin
node again at 20 9 call Act
begin -> again
"""
BOUND_FAULTS = [
    (r"   EventReference=.*\n", "", "K2Node_ComponentBoundEvent_0: its EventReference is not ConsacAgentEvent__DelegateSignature"),
    ("ConsacEpisodeEvent__DelegateSignature\"\\)", "ConsacAgentEvent__DelegateSignature\")", "_1: its EventReference is not ConsacEpisodeEvent"),
    (r"   CustomFunctionName=.*\n", "", "K2Node_ComponentBoundEvent_1: it has no CustomFunctionName of its own"),
    (r"   CustomFunctionName=.*", '   CustomFunctionName="BndEvt__Same"', "K2Node_ComponentBoundEvent_1: it has no CustomFunctionName of its own"),
    ('"OnObserve"', '"OnLook"', "no component of the plugin has such an event"),
]


@pytest.mark.parametrize("pattern, new, message", BOUND_FAULTS, ids=[str(n) for n in range(len(BOUND_FAULTS))])
def test_an_event_that_nobody_would_call_is_told(catalogue, pattern, new, message):
    text = paste.paste(graph.read("bound", BOUND, catalogue), catalogue)
    assert paste.faults(text, catalogue) == []
    changed = re.sub(pattern, lambda _: new, text)
    assert changed != text
    assert any(message in line for line in paste.faults(changed, catalogue)), paste.faults(changed, catalogue)


def test_a_components_event_is_written_as_the_editor_writes_it(catalogue):
    text = paste.paste(graph.read("bound", BOUND, catalogue), catalogue)
    assert ("EventReference=(MemberParent=\"/Script/CoreUObject.Package'/Script/Consac'\",MemberName=\"ConsacAgentEvent__DelegateSignature\")"
            in text)
    assert 'CustomFunctionName="BndEvt__Consac_Agent_K2Node_ComponentBoundEvent_1_ConsacEpisodeEvent__DelegateSignature"' in text


def test_pasteable_text_has_the_shape_of_the_editors(catalogue):
    text = paste.paste(graph.read("small", GOOD, catalogue), catalogue)
    assert text.count("Begin Object Class=/Script/BlueprintGraph.K2Node_") == text.count("\nEnd Object") == 5
    assert len(set(re.findall(r"NodeGuid=(\w+)", text))) == 5
    ids = re.findall(r"PinId=([0-9A-F]{32}),", text)
    assert len(ids) == len(set(ids)) == sum(len(node.row["pins"]) for node in graph.read("small", GOOD, catalogue).nodes.values())


def test_the_thesis_names_are_in_the_table(table):
    assert list(agreement.thesis(table)) == []
    assert list(agreement.thesis({"nodes": []})) == [f"nodes.json: the thesis' node '{name}' is missing" for name in agreement.THESIS]
