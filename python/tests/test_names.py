"""Text from outside becomes a name, a line for people, and never a path."""
import ast
from pathlib import Path

import pytest

import consac
from consac import wire
from consac.errors import EngineBusy, EngineError, ProtocolError
from consac.layout import Behaviour, Layout, space_from_json
from consac.names import check_name, check_names_together, printable_line
from played import box, frame
from toy_server import ToyServer

EVIL = "done\n\x1b[2Ktraining completed\u202e\u200b"


def test_a_line_shows_what_does_not_show():
    assert printable_line(EVIL + "\ud800") == r"done\x0a\x1b[2Ktraining completed\xe2\x80\xae\xe2\x80\x8b\xed\xa0\x80"
    assert printable_line("Läufer 走者 👩‍🚀") == "Läufer 走者 👩‍🚀"  # whose joiner is a part of it
    assert len(printable_line("x" * 10_000_000)) == 2000


@pytest.mark.parametrize("name", ["", None, 7, ["a"], "a\nb", "a\x1bb", "a\u202eb", "\ud800", "ä" * 128])
def test_what_is_no_name(name):
    with pytest.raises(ValueError) as told:
        check_name("behaviour", name)
    assert printable_line(told.value) == str(told.value)


def test_names_that_stand_together():
    check_names_together("agent", ["a", "b", "../../.bashrc", "ä", "Ä"])  # a name, since no file is named by it
    for names, why in ((["a", "a"], "twice"), (["hunt", "Hunt"], "capitals")):
        with pytest.raises(ValueError, match=why):
            check_names_together("agent", names)


@pytest.mark.parametrize("behaviours, why", [([EVIL], "does not show"), (["a", "a"], "twice"), (["a", "A"], "capitals"), ([""], "give it one"), ([None], "name is 'null', expected a text")])
def test_behaviours_are_named_well(behaviours, why):
    said = [Behaviour("x", ["agent"], *[Layout.of(space_from_json(box([1])))] * 2, 1).to_json() | {"name": name} for name in behaviours]
    with ToyServer(spec={"behaviours": said}) as server:
        with pytest.raises(ProtocolError, match=why) as told:
            consac.make(server.url, protocol=2)
        assert printable_line(told.value) == str(told.value)


def spec_of(agents):
    return {"behaviours": [Behaviour("x", agents, *[Layout.of(space_from_json(box([1])))] * 2, 2).to_json()]}


@pytest.mark.parametrize("agents", [["a", EVIL], ["a", "a"]])
def test_agents_are_named_well(agents):
    with ToyServer(spec=spec_of(agents)) as server:
        with pytest.raises(ProtocolError, match="agent name"):
            consac.make(server.url, protocol=2)


def test_agents_may_differ_in_capitals_alone():
    """spec/names.md: no file is named by an agent."""
    with ToyServer(spec=spec_of(["a", "A"])) as server, consac.connect(server.url, 2) as connection:
        assert connection.behaviours[0].agents == ["a", "A"]


@pytest.mark.parametrize("code, kind", [("CAPACITY", EngineBusy), (EVIL, EngineError)])
def test_what_an_engine_says_is_one_line(code, kind):
    def before(server, sock, got):
        error = {"code": code, "severity": "connection", "message": EVIL * 40, "path": EVIL}
        sock.sendall(frame(wire.ERROR, wire.dump_json(error), got.request))
        return True
    with ToyServer(before=before) as server:
        with pytest.raises(kind) as told:
            consac.make(server.url, protocol=2)
        assert printable_line(told.value, 10_000) == str(told.value) and len(str(told.value)) < 3000


@pytest.mark.parametrize("first", ["busy " + EVIL + "\n", "D#2#0#B#1#0,1#9\nerror: " + EVIL[5:] + "\n"])
def test_what_an_engine_of_text_protocol_1_says_is_one_line(first):
    with ToyServer(first=first.encode()) as server:
        with pytest.raises(consac.ConsacError) as told:
            consac.make(server.url, timeout=2).reset()
        assert printable_line(told.value) == str(told.value)


def test_files_are_opened_in_known_places_only():
    """A name from outside is never a path: whoever opens another file has to come here and say why it is none."""
    opened, package = set(), Path(consac.__file__).parent
    for path in package.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
            if called in ("open", "io.open", "os.open", "os.replace", "os.remove", "os.makedirs") or called.endswith((".read_bytes", ".read_text", ".write_bytes", ".write_text", ".unlink")):
                opened.add((path.relative_to(package).as_posix(), called))
    assert opened == {
        ("policy.py", "path.read_bytes"), ("shared_memory.py", "os.open"), ("serve/command.py", "open"), ("serve/command.py", "os.replace"),
        ("training.py", "open"), ("training.py", "self._config.read_text"),  # what lies in the folder of the run that was asked for, by names that are fixed
    }
