"""spec/protocol2*.md: every rule has a case and every case a rule; the session is what the bytes are; every message is named as the code names it."""
import json
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SPEC = ROOT / "spec"
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "python"), str(ROOT / "python/tests")]

import protocol2_session
from consac import wire
from result_check import ResultCheck


def cases():
    """(file, case) of every conformance case of protocol 2."""
    for path in sorted((SPEC / "conformance/protocol2").glob("*.json")):
        said = json.loads(path.read_text())
        for case in said if isinstance(said, list) else said["cases"]:
            yield path.name, case


def rules():
    return re.findall(r"^- \*\*(R\d+)\*\*", (SPEC / "protocol2.md").read_text(), re.MULTILINE)


def test_every_rule_has_a_case_and_every_case_rules():
    known = rules()
    assert len(known) == len(set(known)) >= 60
    named = {rule for _, case in cases() for rule in case["rules"]}
    assert set(known) == named


def test_rules_of_both_ends_have_cases_for_both():
    """What both an engine and a trainer read: frames, JSON, answers."""
    named = {file: {rule for name, case in cases() if name == file for rule in case["rules"]} for file in ("server.json", "trainer.json")}
    for file in named:
        assert {"R1", "R2", "R3", "R4", "R5", "R6", "R7", "R8", "R9", "R10", "R16", "R17", "R20", "R21", "R24", "R31", "R33"} <= named[file], file


def test_every_case_has_a_name_of_its_own_and_breaks_one_of_its_rules():
    names = [(file, case["name"]) for file, case in cases()]
    assert len(names) == len(set(names))
    for _, case in cases():
        assert case["rules"], case["name"]
        assert {answer["breaks"] for answer in case.get("answers", []) if "breaks" in answer} <= set(case["rules"]), case["name"]


def test_every_rule_that_is_mentioned_exists():
    pages = "".join(path.read_text() for path in SPEC.glob("protocol2*.md"))
    assert set(re.findall(r"\bR\d+\b", pages)) == set(rules())


def test_the_session_is_what_the_tool_makes():
    assert protocol2_session.PAGE.read_text() == protocol2_session.make().text()


def test_the_session_is_a_session():
    reader, kinds, check = wire.FrameReader(wire.LARGEST_FRAME), [], None
    for data in protocol2_session.make().frames:
        reader.feed(data)
        frame = reader.next()
        kinds.append(frame.type)
        if frame.type == wire.WELCOME:
            agreed = wire.load_json(frame.payload)["capabilities"]
        if frame.type == wire.SPEC:
            check = ResultCheck(wire.load_json(frame.payload), "same_step", agreed)
        if frame.type in (wire.RESET, wire.STEP):
            check.ask(frame.type == wire.STEP, frame.payload[8:10])
        if frame.type == wire.RESULT:
            assert check.judge(frame.payload) is None
    assert kinds == [wire.HELLO, wire.WELCOME, wire.CONFIGURE, wire.SPEC, wire.RESET, wire.RESULT, wire.PING, wire.PONG, wire.STEP, wire.RESULT, wire.STEP, wire.ERROR,
                     wire.STEP, wire.RESULT, wire.BYE,
                     wire.HELLO, wire.WELCOME, wire.CONFIGURE, wire.SPEC, wire.RESET, wire.RESULT, wire.STEP, wire.RESULT, wire.STEP, wire.ERROR, wire.STEP, wire.RESULT, wire.BYE]


@pytest.mark.parametrize("number, name", list(enumerate("HELLO WELCOME CONFIGURE SPEC RESET STEP RESULT ERROR GOAWAY BYE PING PONG PAUSED RESUMED RENDER FRAME RELABEL REWARDS".split(), 1)))
def test_types_are_those_of_the_page(number, name):
    assert getattr(wire, name) == number
    assert re.search(rf"^\| {number} \| {name} \|", (SPEC / "protocol2.md").read_text(), re.MULTILINE)


def test_errors_are_those_of_the_page():
    """Codes that the servers here say, and their severities."""
    page = dict(re.findall(r"^\| ([A-Z_]+) \| (connection|request)", (SPEC / "protocol2.md").read_text(), re.MULTILINE))
    source = subprocess.run(["git", "grep", "-hoE", r'(Fault|Refused|WireError)\("[A-Z_]+"', "--", "core/src/server", "core/src/protocol", "python/consac/serve"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    said = set(re.findall(r'"([A-Z_]+)"', source))
    assert said <= set(page)
    from consac.serve.refusal import CONNECTION_ERRORS
    assert CONNECTION_ERRORS == {code for code, severity in page.items() if severity == "connection"}
