"""spec/conformance/protocol2: the frames through our reader, the conversations with our server, the RESULTs before a judge of our own."""
import contextlib
import itertools
import json
import pathlib
import subprocess

import gymnasium
import numpy as np
import pettingzoo
import pytest

from consac import wire
from consac.address import open_socket
from consac.client import connect
from consac.errors import ConsacError, ProtocolError
from consac.extras import Parameter
from consac.frames import ResultFrame
from consac.judge import Judge
from consac.offer import read_spec
from consac.serve import Refused, Server
from consac.serve.batch import Batch
from consac.serve.connection import Connection
from consac.serve.limits import Limits
from conversation import Conversation
from program import PROGRAM, free_port, needs_program, run
from result_check import ResultCheck

class Pole(gymnasium.Wrapper):
    """CartPole of a length that may be set, which notes how high its pole stands."""

    def __init__(self):
        super().__init__(gymnasium.make("CartPole-v1"))

    def reset(self, *, seed=None, options=None):
        self.unwrapped.length = options["length"] if options else 0.5
        self.unwrapped.polemass_length = self.unwrapped.masspole * self.unwrapped.length
        return self.env.reset(seed=seed)

    def step(self, action):
        observation, *rest, info = self.env.step(action)
        return observation, *rest, info | {"height": float(np.cos(observation[2]))}


PARAMETERS = [Parameter("length", 0.5, 0.1, 4.0, "of the pole, m"), Parameter("colour", 3.0), Parameter("wind", 0.0, -1.0, 1.0)]
CASES = pathlib.Path(__file__).parents[2] / "spec/conformance/protocol2"
FRAMES, CONVERSATIONS, RESULTS = (json.loads((CASES / name).read_text()) for name in ("frames.json", "server.json", "results.json"))


def read(stream, cut, limit):
    reader, events = wire.FrameReader(limit), []
    try:
        for piece in (stream[:cut], stream[cut:]):
            reader.feed(piece)
            while frame := reader.next():
                events.append({"type": frame.type, "request": frame.request, "session": frame.session, "payload": bytes(frame.payload).hex()})
    except wire.WireError as error:
        events.append({"error": error.code})
    return events


@pytest.mark.parametrize("case", FRAMES, ids=lambda case: case["name"])
def test_frames(case):
    stream = bytes.fromhex(case["hex"])
    for cut in range(len(stream) + 1):
        assert read(stream, cut, case["limit"]) == case["expect"], cut


@pytest.mark.parametrize("case", CONVERSATIONS, ids=lambda case: case["name"])
def test_conversations_with_our_server(case):
    with Server(Pole, envs=3, parameters=PARAMETERS, statistics=["height"]) as server:
        conversation = Conversation(server.port)
        for step in case["steps"]:
            (name, what), = step.items()
            getattr(conversation, name)(what)
            if conversation.over:  # the server cannot do what the case is of, and said so
                break
        conversation.sock.close()


@pytest.mark.parametrize("case", RESULTS["cases"], ids=lambda case: case["name"])
def test_results(case):
    check = ResultCheck(RESULTS["specs"][case["spec"]], case["autoreset"], case.get("agreed", ()))
    for answer in case["answers"]:
        check.ask(answer["to"] == "STEP", answer.get("environments", [1] * check.environments))
        assert check.judge(bytes.fromhex("".join(answer["result"]))) == answer.get("breaks")


def choose_legal(connection):
    """The first legal choice of each; 0 is within every box of the cases."""
    for behaviour, rows, actions in zip(connection.behaviours, connection.rows, connection.actions):
        at = 0
        for leaf, action in zip(behaviour.action.leaves, actions):
            counts = [leaf.space.n] if isinstance(leaf.space, gymnasium.spaces.Discrete) else list(leaf.space.nvec) if isinstance(leaf.space, gymnasium.spaces.MultiDiscrete) else []
            for index, count in enumerate(counts):
                first = rows.masks[:, at:at + count].argmax(1)
                action[(slice(None), *([index] if action.ndim > 1 else []))] = first
                at += count


@pytest.mark.parametrize("case", [case for case in RESULTS["cases"] if case["answers"][-1].get("breaks") != "R75"], ids=lambda case: case["name"])
def test_results_before_our_client(case):
    """Its own judge, in answers to requests of some environments too; numbers it leaves to whoever learns."""
    agreed = case.get("agreed", [])
    offer = read_spec(RESULTS["specs"][case["spec"]] | {"autoreset": case["autoreset"]}, case["autoreset"], wire.LARGEST_FRAME, agreed)
    result, judge = ResultFrame(offer.behaviours, offer.environments, len(offer.groups), "statistics" in agreed), Judge(offer.behaviours, case["autoreset"])
    rows = result.lay_over(np.zeros(result.largest + (1 << 16), np.uint8))
    for request, answer in enumerate(case["answers"], 1):
        payload = memoryview(bytes.fromhex("".join(answer["result"])))
        chosen = np.array(answer["environments"], bool) if "environments" in answer else None
        held = True
        try:
            parts, _, _ = result.read(payload, False)
            result.check_padding()
            if parts & wire.PART_GROUPS:
                result.check_groups(judge.played(request, answer["to"] == "STEP", chosen))
            judge.judge(request, rows, answer["to"] == "STEP", chosen, bool(parts & wire.PART_FINALS))
        except ProtocolError:
            held = False
        assert held == ("breaks" not in answer or "may_overlook" in answer)


@contextlib.contextmanager
def doctor_of_trainers(*flags):
    """The doctor as an engine: its process, and the port that it listens at."""
    port = free_port()
    with subprocess.Popen([PROGRAM, "doctor", "--conformance-trainer", f"tcp://127.0.0.1:{port}", *flags], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as doctor:
        doctor.stdout.readline()
        yield doctor, port


def put_our_client_through(order=(("step", [1, 1]),), **options):
    """What the doctor says of our client, which behind the first RESET asks in that order, again and again."""
    rng = np.random.default_rng(3)
    with doctor_of_trainers("--timeout", "30") as (doctor, port):
        while doctor.poll() is None:
            try:
                with contextlib.closing(connect(f"tcp://127.0.0.1:{port}", protocol=2, timeout=12.0, **options)) as connection:
                    connection.reset(seeds=np.arange(connection.environments))
                    for kind, mask in itertools.cycle(order):
                        connection.set_parameters({name: np.clip(rng.normal(one.default, 5, connection.environments), one.low, one.high) for name, one in connection.parameters.items()})
                        mask = np.array(mask[:connection.environments], bool)
                        if kind == "reset":
                            connection.reset(mask)
                            continue
                        if "relabel" in connection.capabilities:
                            connection.relabel({name: np.zeros((3, 1), np.float32) for name in ("achieved_goal", "desired_goal")}, 3)
                        choose_legal(connection)
                        connection.step_mask[:] = mask
                        connection.step()
            except (ConsacError, OSError):
                pass
        said = doctor.stdout.read()
    assert doctor.returncode == 0, said
    return said


@needs_program
@pytest.mark.parametrize("autoreset, max_frame", [("same_step", wire.LARGEST_FRAME), ("same_step", 4096), ("next_step", wire.LARGEST_FRAME), ("disabled", wire.LARGEST_FRAME)])
def test_every_case_holds_for_our_client(autoreset, max_frame):
    """Whoever asks for another way first is put through its cases too."""
    said = put_our_client_through(max_frame=max_frame, autoreset=(autoreset,) if autoreset == "same_step" else (autoreset, "same_step"))
    for name in ("nobody takes part for as long as an answer may take", "other goals have rewards, and it goes on", "REWARDS with infinity"):
        assert f"holds        {name}" in said, said
    assert (f"holds        {autoreset}: an end with " in said) == (autoreset != "same_step"), said


@needs_program
@pytest.mark.parametrize("order, holds, not_offered", [
    ([("step", [1, 1]), ("reset", [1, 0])], "one environment of two is reset (R70)", "a mask byte of 2 (R71): request 4 is RESET of 1 0, the case's STEP of 1 1"),
    ([("reset", [1, 0]), ("step", [1, 1])], "a connection that breaks is taken up again (R24 R11)", "a step, and one more (R60 R61 R62 R63 R64 R65 R66 R67 R71 R72 R73 R74 R75): request 3 is RESET of 1 0, the case's STEP of 1 1"),
    ([("step", [1, 0])], "a group is paid where nothing was stepped (R107)", "a mask byte of 2 (R71): request 3 is STEP of 1 0, the case's STEP of 1 1"),
    ([("step", [1, 1]), ("step", [0, 1])], "an environment that was not stepped has a reward (R65)", "a mask byte of 2 (R71): request 4 is STEP of 0 1, the case's STEP of 1 1")])
def test_a_trainer_of_another_order_breaks_no_case(order, holds, not_offered):
    """A case of results.json has an order of its own; those of trainer.json fit themselves to the trainer's."""
    said = put_our_client_through(order)
    assert f"holds        {holds}\n" in said and f"not offered  {not_offered}\n" in said, said
    offered = {case["name"] for case in json.loads((CASES / "trainer.json").read_text())["cases"]}
    assert not [name for name in offered if f"not offered  {name} (" in said], said


@needs_program
def test_a_trainer_that_steps_before_it_resets_fails():
    """It comes for some cases, and then no more, which is told as that."""
    with doctor_of_trainers("--timeout", "2") as (doctor, port):
        for _ in range(3):
            with open_socket("127.0.0.1", port, 5.0, 5.0) as sock:  # the doctor says where it will listen
                reader = wire.FrameReader(wire.LARGEST_FRAME)
                for request, (kind, payload) in enumerate([(wire.HELLO, b'{"protocol":[2,2]}'), (wire.CONFIGURE, b"{}"), (wire.STEP, bytes(24))]):
                    sock.sendall(wire.pack(wire.Frame(kind, payload, request, 7 if request else 0)))
                    while (frame := reader.next()) is None and (data := sock.recv(65536)):
                        reader.feed(data)
        said, error = doctor.communicate()
    assert doctor.returncode == 3 and said.count("FAILS") == 3 and 'expected "RESET", got STEP of 24 bytes' in said and "0 of 3 cases of protocol 2 hold\n" in said, said
    assert error == "consac doctor: the cases from 'a frame that may not be skipped' on were not run: no trainer has connected within 2 s; start it while this listens, or raise --timeout\n"


@needs_program
def test_where_no_trainer_comes_no_case_has_failed():
    with doctor_of_trainers("--timeout", "0.05") as (doctor, _):
        said, error = doctor.communicate()
    assert (doctor.returncode, said, error) == (3, "", "consac doctor: no trainer has connected within 0.05 s; start it while this listens, or raise --timeout\n")


@needs_program
@pytest.mark.parametrize("token", ["", "open sesame"])
def test_the_doctor_finds_nothing_wrong_with_our_server(token):
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=3, token=token) as server:
        done = run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}", *["--token", token, "--timeout", "11"] * bool(token)])
    assert done.returncode == 0, done.stdout + done.stderr
    for name in ("no access token (R23)", "another access token", "the handshake's clock stops with SPEC (R29)"):  # which the longer timeout offers
        assert f"{'holds' if token else 'not offered':<12} {name}" in done.stdout


@needs_program
def test_a_servers_limit_below_4096_counts_as_that():
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=3, limits=Limits(max_frame=1000)) as server:
        done = run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"])
    assert done.returncode == 0, done.stdout + done.stderr


def all_or_none(monkeypatch):
    """Environments that are stepped and reset together or not at all."""
    for name in ("reset", "step"):
        def judged(batch, payload, plain=getattr(Batch, name)):
            if len(payload) >= 8 + len(batch.envs) and not all(payload[8:8 + len(batch.envs)]) and batch.started:
                raise Refused("UNSUPPORTED", "all or none")
            plain(batch, payload)
        monkeypatch.setattr(Batch, name, judged)


def somebody_comes_later(monkeypatch):
    """Nobody is there after a RESET but in the first step."""
    reset, advance = Batch.reset, Batch._advance

    def empty(batch, payload):
        reset(batch, payload)
        batch.parts[0].states[np.frombuffer(payload, np.uint8, len(batch.envs), 8) == 1] = 0

    def fill(batch, env):
        if batch.parts[0].states[env]:
            return advance(batch, env)
        batch.parts[0].states[env] = wire.FIRST | wire.ACTIVE
    monkeypatch.setattr(Batch, "reset", empty)
    monkeypatch.setattr(Batch, "_advance", fill)


def says_pong_unasked(monkeypatch):
    """Before each answer."""
    def answer(connection, data, plain=Connection.answer):
        connection.write(connection.pack(wire.PONG, b"nobody asked"))
        plain(connection, data)
    monkeypatch.setattr(Connection, "answer", answer)


@needs_program
@pytest.mark.parametrize("engine", [all_or_none, somebody_comes_later, says_pong_unasked], ids=lambda engine: engine.__name__)
def test_engines_that_the_page_allows_hold_every_case(engine, monkeypatch):
    with Server(lambda: gymnasium.make("CartPole-v1", max_episode_steps=5), envs=3) as server:  # all of whose episodes end at once, again and again
        engine(monkeypatch)
        done = run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"])
    assert done.returncode == 0, done.stdout + done.stderr
    if engine is all_or_none:
        assert "holds        disabled: 300 steps" in done.stdout and "not offered  the first environment alone is stepped" in done.stdout, done.stdout


def takes_no_seeds(monkeypatch):
    """And says so behind all else that may be wrong of a RESET (R18)."""
    reset = Batch.reset

    def judged(batch, payload):
        with monkeypatch.context() as patch:
            if len(payload) > 0 and payload[0] & wire.WITH_SEEDS:
                patch.setattr(batch, "_forget", refuse)  # which is asked once all has been judged
            reset(batch, payload)

    def refuse(every):
        raise Refused("UNSUPPORTED", "no seeds here")
    monkeypatch.setattr(Batch, "reset", judged)


@needs_program
@pytest.mark.parametrize("envs, engine, case", [(1, None, "infinity comes before a first RESET of some"), (3, takes_no_seeds, "a value that is set leaves the episode under way as it is")])
def test_what_an_engine_of_parameters_cannot_do_is_not_offered(envs, engine, case, monkeypatch):
    with Server(Pole, envs=envs, parameters=PARAMETERS) as server:
        if engine is not None:
            engine(monkeypatch)
        done = run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"])
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"not offered  {case} (" in done.stdout, done.stdout


def test_an_engine_that_takes_no_seeds_is_reset_without(monkeypatch):
    """R47, which no case of an engine's can show."""
    def judged(batch, payload, plain=Batch.reset):
        if payload[0] & wire.WITH_SEEDS:
            raise Refused("UNSUPPORTED", "no seeds here")
        plain(batch, payload)
    monkeypatch.setattr(Batch, "reset", judged)
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=2) as server, contextlib.closing(connect(f"tcp://127.0.0.1:{server.port}", protocol=2)) as connection:
        with pytest.warns(UserWarning, match="cannot take these seeds, which have no effect: no seeds here"):
            connection.reset(seeds=[11, 12])
        assert (connection.rows[0].states == wire.FIRST | wire.ACTIVE).all()


@needs_program
def test_a_reward_beyond_float32_is_told_as_that(tmp_path):
    with Server(lambda: gymnasium.wrappers.TransformReward(gymnasium.make("CartPole-v1"), lambda _: 1e308)) as server:
        done = run([PROGRAM, "train", f"tcp://127.0.0.1:{server.port}", "--steps", "64", "--name", "rich", "--dir", tmp_path])
    assert done.returncode == 7 and "the reward is inf, or a number beyond float32" in done.stderr, done.stderr


class EveryKind(gymnasium.Env):
    """An action of each kind of space, and a picture."""
    observation_space = gymnasium.spaces.Discrete(3)
    action_space = gymnasium.spaces.Dict({
        "bits": gymnasium.spaces.MultiBinary(3), "box": gymnasium.spaces.Box(-2, 2, (2,), np.float32), "choice": gymnasium.spaces.Discrete(3, start=-1),
        "choices": gymnasium.spaces.MultiDiscrete([2, 3]), "truth": gymnasium.spaces.Box(0, 1, (2,), np.bool_), "whole": gymnasium.spaces.Box(5, 9, (1,), np.uint8)})
    metadata = {"render_modes": ["rgb_array"]}
    render_mode = "rgb_array"
    steps = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        return 0, {}

    def step(self, action):
        self.steps += 1
        return 1, 0.0, self.steps == 4, False, {}

    def render(self):
        return np.zeros((2, 3, 3), np.uint8)


@needs_program
def test_illegal_numbers_of_every_kind_of_leaf_are_found():
    with Server(EveryKind, envs=3) as server:
        done = run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"])
    assert done.returncode == 0, done.stdout + done.stderr
    for kind in ("a discrete", "a multi_discrete", "a multi_binary", "a box", "a BOOL that is 2"):
        assert f"holds        an action outside its space by its last number of {kind} (R44)" in done.stdout, done.stdout
    for name in ("RENDER of an environment that there is not (R84)", "next_step: actions of who takes no part are not looked at (R44)", "transport shm that was not agreed (R30)"):
        assert f"holds        {name}" in done.stdout, done.stdout


class Deaths(pettingzoo.ParallelEnv):
    """Of two agents one ends while the other goes on."""
    metadata = {"name": "deaths_v0"}
    possible_agents = ["first", "last"]

    def observation_space(self, agent):
        return gymnasium.spaces.Discrete(3)

    def action_space(self, agent):
        return gymnasium.spaces.Discrete(2)

    def reset(self, seed=None, options=None):
        self.steps, self.agents = 0, list(self.possible_agents)
        return {agent: 0 for agent in self.agents}, {agent: {} for agent in self.agents}

    def step(self, actions):
        self.steps += 1
        were = self.agents
        ended = {agent: self.steps == (3 if agent == "first" else 6) for agent in were}
        self.agents = [agent for agent in were if not ended[agent]]
        return {agent: 1 for agent in were}, {agent: 1.0 for agent in were}, ended, {agent: False for agent in were}, {agent: {"steps": self.steps} for agent in were}


@needs_program
def test_every_case_holds_where_one_agent_ends_before_the_others():
    with Server(Deaths, envs=2) as server:
        done = run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"])
    assert done.returncode == 0, done.stdout + done.stderr


class Walkers(pettingzoo.ParallelEnv):
    """Of two agents, which walk at a pace that may be set, one ends long before the other, and so the episode."""
    metadata = {"name": "walkers_v0"}
    possible_agents = ["first", "last"]

    def observation_space(self, agent):
        return gymnasium.spaces.Box(0, 1e6, (1,), np.float32)

    def action_space(self, agent):
        return gymnasium.spaces.Discrete(2)

    def reset(self, seed=None, options=None):
        self.steps, self.agents, self.pace = 0, list(self.possible_agents), options["pace"] if options else 1.0
        return {agent: np.zeros(1, np.float32) for agent in self.agents}, {agent: {} for agent in self.agents}

    def step(self, actions):
        self.steps += 1
        were = self.agents
        ended = {agent: self.steps == (3 if agent == "first" else 20) for agent in were}
        self.agents = [agent for agent in were if not ended[agent]]
        seen = {agent: np.array([self.pace * self.steps], np.float32) for agent in were}
        return seen, {agent: 1.0 for agent in were}, ended, {agent: False for agent in were}, {agent: {} for agent in were}


@needs_program
def test_an_episode_begins_by_itself_once_all_of_its_agents_have_ended():
    """An agent that ends while another goes on begins none, so what was set has no effect yet (R103)."""
    with Server(Walkers, envs=2, parameters=[Parameter("pace", 1.0, 0.0, 10.0)]) as server:
        done = run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"])
    assert done.returncode == 0, done.stdout + done.stderr
    assert "holds        same_step: an episode that begins by itself has what was set (R103)" in done.stdout, done.stdout


class Outsider(gymnasium.Env):
    """Its bounds are more values than a message's JSON may have."""
    observation_space = gymnasium.spaces.Box(np.arange(140000.0), np.arange(140000.0) + 1, dtype=np.float64)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        return self.observation_space.low, {}

    def step(self, action):
        return self.observation_space.low, 0.0, False, False, {}


def test_a_spec_that_is_more_than_json_may_be_is_unsupported():
    with Server(Outsider) as server, pytest.raises(ConsacError, match="UNSUPPORTED.*R7"):
        connect(f"tcp://127.0.0.1:{server.port}", protocol=2)
