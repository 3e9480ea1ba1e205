"""spec/conformance/names/specs.json: what a SPEC may be called and may cost. core/test/protocol/spec_cases_test.cpp reads the same."""
import importlib
import json
import pathlib
import pkgutil

import pytest

import consac
from consac import client, offer, options, wire
from consac.errors import EngineError, ProtocolError
from consac.layout import Behaviour, Layout, space_from_json
from consac.names import LONGEST_NAME
from consac.model_file import ModelDamaged
from consac.offer import read_spec
from consac.policy import _space
from consac.serve import Server
from played import box
from toy_server import ToyServer

ALL = json.loads((pathlib.Path(__file__).parents[2] / "spec/conformance/names/specs.json").read_text())


@pytest.mark.parametrize("case", ALL["cases"], ids=lambda case: case["name"])
def test_specs(case):
    spec = ALL["spec"] | case.get("spec", {}) | {"behaviours": [ALL["behaviour"] | change for change in case.get("behaviours", [{}])]}
    if "refused" not in case:
        assert read_spec(spec, "same_step", wire.LARGEST_FRAME).id == spec["id"]
        return
    with pytest.raises(ProtocolError) as told:
        read_spec(spec, "same_step", wire.LARGEST_FRAME)
    assert told.value.code == "MALFORMED" and case["refused"] in str(told.value)


@pytest.mark.parametrize("case", [case for case in ALL["cases"] if case.get("refused") in ("low", "shape", "n", "nvec", "start", "sorted", "spaces")], ids=lambda case: case["name"])
def test_the_space_of_a_model_is_judged_as_that_of_an_engine(case):
    for behaviour in case["behaviours"]:
        name, = behaviour.keys() & {"observation", "action"}
        with pytest.raises(ModelDamaged, match=f"the model's {name} space cannot be read: .*{case['refused']}"):
            _space(behaviour, name)


def test_parameters_of_all_environments_are_charged_before_they_are_made():
    """A SPEC of 30 KiB would make its trainer hold 1000 MiB."""
    spec = ALL["spec"] | {"environments": 1 << 17, "behaviours": [ALL["behaviour"]], "parameters": [{"name": f"p{i}", "default": 1} for i in range(1000)]}
    with pytest.raises(ProtocolError, match="1048576000 bytes of parameters and groups of 131072 environments"):
        read_spec(spec, "same_step", wire.LARGEST_FRAME, ["parameters"])
    assert read_spec(spec, "same_step", wire.LARGEST_FRAME).environments == 1 << 17, "who has not agreed to them holds none"
    assert len(read_spec(spec | {"environments": 1000}, "same_step", wire.LARGEST_FRAME, ["parameters"]).parameters) == 1000


@pytest.mark.parametrize("expect", [[{"name": "a\x1b[2J"}], [{"name": ""}], [{"agents": ["b\n"]}], [{"observation": {"spaces": [{"name": "\u202e"}]}}]])
def test_names_that_a_client_expects_are_judged_by_the_server(expect):
    with Server("CartPole-v1", 1) as server, pytest.raises((EngineError, ProtocolError), match="MALFORMED.*expected"):
        consac.make(f"tcp://127.0.0.1:{server.port}", protocol=2, expect=expect)


def test_options_are_checked_in_one_place_once(monkeypatch):
    modules = [importlib.import_module(f"consac.{found.name}") for found in pkgutil.iter_modules(consac.__path__) if found.name not in ("pettingzoo", "sb3", "rllib")]
    assert [module for module in modules if module is not options and getattr(module, "check", None) is options.check] == [client]
    calls = []
    monkeypatch.setattr(client, "check", lambda given: (calls.append(given), options.check(given)))
    behaviour = Behaviour("x", ["agent"], *[Layout.of(space_from_json(box([1])))] * 2, 1).to_json()
    with ToyServer(spec={"behaviours": [behaviour]}) as server:
        consac.make(server.url, protocol=2, timeout=50.0).close()
    assert calls == [{"protocol": 2, "timeout": 50.0}]


@pytest.mark.parametrize("given, why", [({"autoreset": "disabled"}, "unknown argument 'autoreset'"), ({"protocl": 2}, "did you mean 'protocol'"), ({"timeout": 0}, "timeout=0"),
                                        ({"protocol": 3}, "protocol=3")])
def test_options_that_cannot_be_are_refused_before_anything_is_opened(given, why):
    with pytest.raises((TypeError, ValueError), match=why):
        consac.make("tcp://127.0.0.1:1", **given)


def test_the_limits_in_the_documents_are_those_of_the_code():
    text = (pathlib.Path(__file__).parents[2] / "docs/python.md").read_text()
    for words in (f"{wire.LARGEST_JSON >> 20} MiB, {wire.DEEPEST_JSON} deep, {wire.MOST_JSON_VALUES:,} values", f"{offer.MOST_BEHAVIOURS:,} behaviours",
                  f"{offer.MOST_SPACE_BYTES >> 20} MiB for all spaces", f"{wire.LARGEST_FRAME >> 20} MiB", f"{LONGEST_NAME} bytes that show"):
        assert words in text
    assert (offer.MOST_SLOTS, offer.MOST_NUMBERS) == (1 << 20, 1 << 24) and "2^20 slots of each, 2^24 elements or choices of a space" in text
