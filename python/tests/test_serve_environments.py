"""consac.serve and environments that fail, are misspelt, draw, cannot be served, or have kinds of agents; its command line."""
import os
import signal
import subprocess
import sys
import tracemalloc
import types

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from consac.serve import Server
from consac.serve.refusal import Refusals
from consac.wire import GOAWAY, RENDER, STEP
from program import OUR_ENVIRONMENT, OUR_SERVE, run
from raw_client import Raw, step_payload
from toy_worlds import Agents, Brittle, Counter, Failing, Pack
from waiting import ENDS_S


# ---- what an environment shows

def test_an_environment_that_fails_again_and_again_is_told_in_a_few_tracebacks(monkeypatch):
    monkeypatch.setattr(Refusals, "EVERY_S", ENDS_S)
    said = []
    with Server(Brittle, log=said.append) as server:
        client = Raw(server)
        for _ in range(40):
            client.reset()
            assert client.error(STEP, step_payload(1, [1]))["code"] == "ENV_FAILED"
    assert sum(line.startswith("Traceback") for line in said) == 5
    assert said[-1] == "RuntimeError: boom (and 34 more like it)", said[-1]


def test_what_cannot_be_served_is_told_without_pythons_own_words(capsys):
    from consac.serve.command import main

    with Server(Counter) as server:
        for arguments, why in ([["CartPole-v1", "--port", str(server.port)], "Address already in use"], [["CartPole-v1", "--host", "0.0.0.0"], "an access token is needed"],
                               [["NoSuch-v0"], "doesn't exist"]):
            assert main(arguments) == 2
            said = capsys.readouterr().err.splitlines()
            assert len(said) == 1 and said[0].startswith("consac.serve: ") and why in said[0] and "Error" not in said[0] and "[Errno" not in said[0], said


# ---- states

def test_a_failing_environment_is_told():
    with Server(Failing, 3) as server:
        client = Raw(server)
        client.reset()
        error = client.error(STEP, step_payload(3, [0, 2, 0]))
        assert (error["code"], error["env"]) == ("ENV_FAILED", 1) and "motor burnt out" in error["message"]
        for env in range(3):  # all that were stepped with it have failed (R14)
            assert client.error(STEP, step_payload(3, [0] * 3, [env == other for other in range(3)]))["code"] == "RESET_REQUIRED"
        found = client.reset([0, 1, 0])
        assert [row[0] for row in found.floats()] == [0, 0, 0] and list(found.states) == [24, 24, 24]  # as the RESULT before had them (R70)
        client.reset([1, 0, 1])
        assert [row[0] for row in client.step([0, 0, 0]).floats()] == [1, 1, 1]


# ---- limits and security

class Unpaid(Counter):
    def step(self, action):
        observation, _, *rest = super().step(action)
        return observation, None, *rest


class Quitting(Counter):
    def step(self, action):
        sys.exit("no more coins")


@pytest.mark.parametrize("env, why", [(Unpaid, "the reward is None, which is no number"), (Quitting, "SystemExit: no more coins")])
def test_an_environment_that_pays_nothing_or_quits_is_told(env, why):
    said = []
    with Server(env, log=said.append) as server:
        client = Raw(server)
        client.reset()
        error = client.error(STEP, step_payload(1, [0]))
        assert error["code"] == "ENV_FAILED" and why in error["message"]
        assert any(why in line for line in said), said
        assert client.reset().states == [24]


class Odd(BaseException):
    """No Exception, and cannot be shown."""

    def __str__(self):
        raise ValueError("no words")


@pytest.mark.parametrize("error, why", [(KeyboardInterrupt("stopped"), "KeyboardInterrupt: stopped"), (GeneratorExit("left"), "GeneratorExit: left"), (Odd(), "Odd, which cannot be shown")])
def test_an_environment_that_raises_what_is_no_exception_is_told(error, why):
    class Raising(Counter):
        def step(self, action):
            raise error

    with Server(Raising) as server:
        client = Raw(server)
        client.reset()
        found = client.error(STEP, step_payload(1, [0]))
        assert found["code"] == "ENV_FAILED" and f"{why} (test_serve_environments.py, line " in found["message"]
        assert client.reset().states == [24]


@pytest.mark.parametrize("space, why", [(spaces.Dict({}), "the space Dict() is empty; put a Box"), (spaces.Tuple(()), "the space Tuple() is empty; put a Box"),
                                        (spaces.Dict(a=spaces.Discrete(2), b=spaces.Tuple(())), "the space Tuple() is empty; put a Box"),
                                        (spaces.Box(-1, 1, (2,), np.float16), "numbers of float16, which cannot be sent; use one of bool, uint8")], ids=["dict", "tuple", "within", "float16"])
@pytest.mark.parametrize("what", ["observation_space", "action_space"])
def test_spaces_without_a_form_are_told_in_one_line(space, why, what, monkeypatch, capsys):
    from consac.serve.command import main

    module = types.ModuleType("world_of_a_space")
    module.Env = type("Env", (Counter,), {what: space})
    monkeypatch.setitem(sys.modules, module.__name__, module)
    assert main([f"{module.__name__}:Env", "--port", "0"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and said[0].startswith("consac.serve: ") and why in said[0], said


def test_a_space_beyond_any_frame_is_refused_before_anything_of_its_size_is_made():
    class Vast(Counter):
        observation_space = spaces.Dict({"all": spaces.Box(np.float32(-np.inf), np.float32(np.inf), (40_000_000,), np.float32)})

        def reset(self, **_):
            raise AssertionError("it was reset")

    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match="1 observation of 160000000 bytes"):
            Server(Vast)
        assert tracemalloc.get_traced_memory()[1] < 16 << 20
    finally:
        tracemalloc.stop()


def test_environments_that_cannot_be_served():
    class Odd(Counter):
        observation_space = spaces.Text(4)

    with pytest.raises(TypeError, match="cannot be sent"):
        Server(Odd, 1)

    class Nameless(Agents):
        possible_agents = property()

    with pytest.raises(TypeError, match="possible_agents"):
        Server(Nameless, 1)
    made = []

    def make():
        made.append(1)
        if len(made) > 2:
            raise RuntimeError("no licence")
        return Counter()

    with Server(make, 2) as server:
        client = Raw(server)
        assert client.spec["code"] == "ENV_FAILED" and "no licence" in client.spec["message"] and client.spec["env"] == 1


# ---- command line

def test_command_line(tmp_path):
    port_file = tmp_path / "port"
    command = [*OUR_SERVE, "CartPole-v1", "--envs", "2", "--port", "0", "--port-file", str(port_file), "--steps", "50"]
    with subprocess.Popen(command, env=OUR_ENVIRONMENT, stdout=subprocess.PIPE) as process:
        try:
            process.stdout.readline()
            client = Raw(int(port_file.read_text()))
            client.reset(seeds=[1, 2])
            assert client.step([0, 1]).states == [16, 16] and client.spec["training_length"] == 50
            process.send_signal(signal.SIGTERM)
            assert client.take().type == GOAWAY
            assert process.wait(ENDS_S) == 0
        finally:
            process.kill()
    for arguments in (["NoSuch-v0"], ["CartPole-v1", "--host", "0.0.0.0", "--port", "0"], ["no.module:thing"]):
        done = run([*OUR_SERVE, *arguments], env=OUR_ENVIRONMENT)
        assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr


# ---- environments that fail, are misspelt, draw, or have kinds of agents

WORLDS = '''
import gymnasium
import numpy as np

class Drawing(gymnasium.Env):
    metadata = {"render_modes": ["rgb_array"]}
    observation_space, action_space = gymnasium.spaces.Box(0, 1, (1,), np.float32), gymnasium.spaces.Discrete(2)

    def __init__(self, render_mode=None):
        self.render_mode = render_mode

    def reset(self, *, seed=None, options=None):
        return np.zeros(1, np.float32), {}

    def step(self, action):
        raise RuntimeError("line one\\nline two\\x1b[2J")

    def render(self):
        return np.full((2, 2, 3), 7, np.uint8)

class Mute(Drawing):
    metadata = {}

    def __init__(self):
        super().__init__("rgb_array")

class Blunt(Drawing):
    def reset(self, **_):
        raise RuntimeError("first\\nreset")

class Old:
    observation_space, action_space = Drawing.observation_space, Drawing.action_space

    def reset(self):
        return np.zeros(1, np.float32)

    def step(self, action):
        return np.zeros(1, np.float32), 0.0, False, {}

class Older(Old):
    def close(self):
        pass
'''


@pytest.fixture
def worlds(tmp_path, monkeypatch):
    (tmp_path / "worlds_of_ours.py").write_text(WORLDS)
    monkeypatch.syspath_prepend(tmp_path)
    yield "worlds_of_ours"
    sys.modules.pop("worlds_of_ours", None)


def test_an_environment_that_fails_is_told_with_its_place_and_the_server_has_the_traceback(worlds):
    said = []
    with Server(f"{worlds}:Drawing", log=said.append) as server:
        client = Raw(server)
        client.reset()
        error = client.error(STEP, step_payload(1, [0]))
    line = WORLDS.split("\n").index('        raise RuntimeError("line one\\nline two\\x1b[2J")') + 1
    assert error["code"] == "ENV_FAILED" and f"RuntimeError: line one line two\\x1b[2J (worlds_of_ours.py, line {line}, in step)" in error["message"]
    assert any(f'worlds_of_ours.py", line {line}, in step' in one for one in said) and not any("\n" in one or "\x1b" in one for one in said)


def test_a_first_reset_that_fails_is_told_with_its_place(worlds, tmp_path):
    done = run([*OUR_SERVE, f"{worlds}:Blunt", "--port", "0"], env=dict(os.environ, PYTHONPATH=os.pathsep.join([str(tmp_path), *sys.path])))
    last = done.stderr.splitlines()[-1]
    assert done.returncode == 2 and last.startswith("consac.serve: RuntimeError: first reset (worlds_of_ours.py, line ") and last.endswith("in reset)") and "Traceback" in done.stderr


def test_environments_of_a_module_are_drawn_where_they_say_so(worlds):
    for name, renders in (("Drawing", True), ("Mute", False)):
        with Server(f"{worlds}:{name}") as server:
            client = Raw(server, hello={"capabilities": ["render"]})
            assert ("render" in client.welcome["capabilities"]) == renders
            if renders:
                client.reset()
                assert client.ask(RENDER, b'{"env":0}').payload[8:] == b"\7" * 12
    from consac.serve.world import environment_maker

    assert environment_maker(f"{worlds}:Drawing", render=False)().render_mode is None


@pytest.mark.parametrize("id_of_gymnasium", ["Drawing-v3", "DrawingOfTheRegistry"])
def test_a_package_is_imported_for_the_ids_that_it_registers(worlds, tmp_path, id_of_gymnasium):
    package = f"package_of_{id_of_gymnasium.partition('-')[0].lower()}"
    (tmp_path / f"{package}.py").write_text(f"import gymnasium\ngymnasium.register({id_of_gymnasium!r}, entry_point='{worlds}:Drawing')\n")
    try:
        with Server(f"{package}:{id_of_gymnasium}") as server:
            Raw(server).reset()
    finally:
        gymnasium.registry.pop(id_of_gymnasium, None)
        sys.modules.pop(package, None)


@pytest.mark.parametrize("name, why", [("Drawnig", "did you mean worlds_of_ours:Drawing"), ("nothing_like_it", "has no callable"), ("Old", "no close.*old gym"), ("Older", "gave a ndarray.*old gym")])
def test_environments_that_are_none(worlds, name, why):
    with pytest.raises((TypeError, ValueError), match=why):
        Server(f"{worlds}:{name}")


def test_kinds_of_agents_do_not_share_a_policy_unless_asked():
    for group, expected in (("kind", [("wolf", ["wolf_0", "wolf_1"]), ("sheep", ["sheep_0"])]), ("spaces", [("default", ["wolf_0", "wolf_1", "sheep_0"])])):
        with Server(Pack, group=group) as server:
            assert [(b["name"], b["agents"]) for b in Raw(server).spec["behaviours"]] == expected

    class Numbered(Pack):
        possible_agents = [0, 1, 2]

    with Server(Numbered) as server:
        assert [(b["name"], b["agents"]) for b in Raw(server).spec["behaviours"]] == [("default", ["0", "1", "2"])]
    with pytest.raises(ValueError, match="kind or spaces"):
        Server(Pack, group="all")


def test_the_command_says_which_agents_share_a_policy(tmp_path):
    (tmp_path / "pack.py").write_text("from toy_worlds import Pack\n\ndef parallel_env(render_mode=None):\n    return Pack()\n")
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join([str(tmp_path), os.path.dirname(__file__), *sys.path]))
    with subprocess.Popen([*OUR_SERVE, "--pettingzoo", "pack", "--port", "0"], env=environment, stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        assert process.stdout.readline() == "agents that share a policy (--group kind): wolf: wolf_0, wolf_1; sheep: sheep_0\n"
        process.terminate()


def test_agents_without_good_names_are_not_served():
    class Twice(Pack):
        possible_agents = ["wolf", "Wolf"]

    with pytest.raises(ValueError, match="capitals"):
        Server(Twice)
