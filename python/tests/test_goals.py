"""Other goals' rewards over protocol 2 (section 13): our server with environments of every kind of compute_reward, our client, and either before bytes that are wrong."""
import gc
import json
import struct
import weakref

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import consac
import consac.client
from consac import wire
from consac.errors import ConsacError, EngineError, ProtocolError
from consac.extras import Parameter
from consac.goals import compute_reward
from consac.serve import Server
from conversation import Conversation
from program import PROGRAM, needs_program, run
from test_conformance import CONVERSATIONS
from toy_server import ToyServer

GOALS = [case for case in CONVERSATIONS if any(rule in ("R90", "R91", "R92", "R93", "R94", "R95", "R96", "R97", "R98") for rule in case["rules"])]


class Reach(gymnasium.Env):
    """A step to the right or to the left on a line, until the goal is near."""

    goal = spaces.Box(-4, 4, (2,), np.float32)
    observation_space = spaces.Dict({"achieved_goal": goal, "desired_goal": goal, "observation": spaces.Discrete(9, start=-4)})
    action_space = spaces.Discrete(2)
    calls = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.at, self.steps, self.wanted = 0, 0, self.np_random.uniform(-4, 4, 2).astype(np.float32)
        return self._see(), {}

    def step(self, action):
        self.at, self.steps = int(np.clip(self.at + 2 * action - 1, -4, 4)), self.steps + 1
        seen = self._see()
        return seen, float(self.compute_reward(seen["achieved_goal"], seen["desired_goal"], {})), False, self.steps == 4, {}

    def _see(self):
        return {"achieved_goal": np.array([self.at, 0.5], np.float32), "desired_goal": self.wanted, "observation": self.at}

    def compute_reward(self, achieved_goal, desired_goal, info):
        type(self).calls += 1
        return -(np.linalg.norm(achieved_goal - desired_goal, axis=-1) > 1).astype(np.float32)


class Counted(Reach):
    """Its goals are numbers of a few."""

    goal = spaces.Discrete(9, start=-4)
    observation_space = spaces.Dict({"achieved_goal": goal, "desired_goal": goal, "observation": spaces.Box(-4, 4, (1,), np.float32)})

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.wanted = int(self.np_random.integers(-4, 5))
        return self._see(), {}

    def _see(self):
        return {"achieved_goal": self.at, "desired_goal": self.wanted, "observation": np.array([self.at], np.float32)}

    def compute_reward(self, achieved_goal, desired_goal, info):
        return -np.abs(np.subtract(achieved_goal, desired_goal, dtype=np.float64))


class Paced(Counted):
    """The trainer says how far a step goes, which is nothing to what goals are worth."""

    def reset(self, *, seed=None, options=None):
        self.pace = options["pace"]
        return super().reset(seed=seed)

    def step(self, action):
        self.at = int(np.clip(self.at + (self.pace - 1) * (2 * action - 1), -4, 4))
        return super().step(action)


OFFERED = ((Reach, {}), (Counted, {}), (Paced, {"parameters": [Parameter("pace", 1.0, 1.0, 3.0)]}))  # to the cases


class Unlike(Reach):
    """What is reached and what is wanted are of two kinds: no goals."""

    observation_space = spaces.Dict(Reach.observation_space.spaces | {"desired_goal": spaces.Box(-4, 5, (2,), np.float32)})


class Plain(Reach):
    """As Stable Baselines3 wants it: what is discrete begins at 0."""

    observation_space = spaces.Dict({"achieved_goal": Reach.goal, "desired_goal": Reach.goal, "observation": spaces.Discrete(9)})

    def _see(self):
        return super()._see() | {"observation": self.at + 4}


class OneByOne(Reach):
    """Takes one goal at a time: of many it makes one number."""

    def compute_reward(self, achieved_goal, desired_goal, info):
        type(self).calls += 1
        return -float(np.linalg.norm(achieved_goal - desired_goal) > 1)


class Crosswise(Reach):
    """Takes one goal at a time: two of two numbers look as if it took many, and are wrong."""

    def compute_reward(self, achieved_goal, desired_goal, info):
        type(self).calls += 1
        return -(np.linalg.norm(achieved_goal - desired_goal, axis=0) > 1).astype(np.float32)


class Rounded(Reach):
    """Pays by the distance: of many goals in float32, of one in float64."""

    def compute_reward(self, achieved_goal, desired_goal, info):
        type(self).calls += 1
        far = np.linalg.norm(achieved_goal.astype(np.float64) - desired_goal, axis=-1)
        return -(far if achieved_goal.ndim == 1 else far.astype(np.float32))


class Broken(Reach):
    """Pays for its own goals, and for no others."""

    def compute_reward(self, achieved_goal, desired_goal, info):
        if achieved_goal.ndim == 1 and desired_goal[1] == 3:
            raise RuntimeError("no such goal")
        if achieved_goal.ndim == 1 and desired_goal[1] == 4:
            raise KeyboardInterrupt("of its own")
        return np.nan if desired_goal[..., 1].any() and np.any(desired_goal[..., 1] == 2) else super().compute_reward(achieved_goal, desired_goal, info)


def reaches(kind=Reach, **options):
    return Server(lambda: gymnasium.wrappers.TimeLimit(kind(), 4), envs=3, **options)


def wanted(rows, second=0.0):
    rng = np.random.default_rng(1)
    achieved, desired = rng.uniform(-4, 4, (2, rows, 2)).astype(np.float32)
    desired[:, 1] = desired[:, 1] if second == 0.0 else second
    return achieved, desired


NEVER = ("RELABEL of a behaviour without goals", "other goals of the last behaviour that has them")  # this server has one behaviour where it has goals


@pytest.mark.parametrize("case", GOALS, ids=lambda case: case["name"])
def test_every_case_is_offered_and_holds(case):
    offered = []
    for kind, options in OFFERED:
        with reaches(kind, **options) as server:
            conversation = Conversation(server.port)
            for step in case["steps"]:
                (name, what), = step.items()
                if not conversation.over:
                    getattr(conversation, name)(what)
            offered.append(not conversation.over)
            conversation.sock.close()
    assert any(offered) == (case["name"] not in NEVER)


@needs_program
def test_the_doctor_finds_nothing_wrong_and_leaves_nothing_out():
    said = ""
    for kind, options in OFFERED:
        with reaches(kind, **options) as server:
            done = run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"])
        assert done.returncode == 0, done.stdout + done.stderr
        said += done.stdout
    for case in GOALS:
        assert (f"holds        {case['name']} (" in said) == (case["name"] not in NEVER), said


@pytest.mark.parametrize("shared_memory", [True, False])
@pytest.mark.parametrize("kind, calls", [(Reach, 3 + 1), (OneByOne, 1 + 30 + 30), (Crosswise, None)])
def test_other_goals_are_priced_together_where_the_environment_can(kind, calls, shared_memory):
    achieved, desired = wanted(30)
    expected = [-float(np.linalg.norm(a - d) > 1) for a, d in zip(achieved, desired)]
    with reaches(kind) as server, consac.client.connect(f"tcp://127.0.0.1:{server.port}", shared_memory=shared_memory) as connection:
        connection.reset()
        kind.calls = 0
        for _ in range(2):
            assert connection.relabel({"achieved_goal": achieved, "desired_goal": desired}, 30).tolist() == expected
        assert calls is None or kind.calls == calls, "once for all, and at first the first and the last alone to see that it can"
        assert connection.relabel({"achieved_goal": achieved[:2], "desired_goal": desired[:2]}, 2).tolist() == expected[:2]
        assert connection.relabel({"achieved_goal": achieved[:0], "desired_goal": desired[:0]}, 0).tolist() == []


def test_a_rounding_is_no_sign_that_the_environment_takes_one_goal_at_a_time():
    achieved, desired = wanted(30)
    with reaches(Rounded) as server, consac.client.connect(f"tcp://127.0.0.1:{server.port}") as connection:
        connection.reset()
        Rounded.calls = 0
        rewards = [connection.relabel({"achieved_goal": achieved[:rows], "desired_goal": desired[:rows]}, rows).tolist() for rows in (30, 30, 1)]
        assert Rounded.calls == 3 + 1 + 1
    assert rewards[0][0] != Rounded().compute_reward(achieved[0], desired[0], {}), "else nothing is rounded here"
    assert rewards[0] == rewards[1] == Rounded().compute_reward(achieved, desired, {}).tolist()
    assert rewards[2] == rewards[0][:1], "equal rows have equal rewards (R97)"


def test_two_goals_of_two_numbers_do_not_mislead():
    achieved, desired = np.array([[0, 0], [3, 0]], np.float32), np.array([[3, 0], [3, 0.5]], np.float32)
    with reaches(Crosswise) as server, consac.client.connect(f"tcp://127.0.0.1:{server.port}") as connection:
        connection.reset()
        assert Crosswise().compute_reward(achieved, desired, {}).shape == (2,)
        assert connection.relabel({"achieved_goal": achieved, "desired_goal": desired}, 2).tolist() == [-1, 0]


def test_many_rows_go_in_as_few_requests_as_fit():
    achieved, desired = wanted(100)
    with reaches() as server, consac.client.connect(f"tcp://127.0.0.1:{server.port}", max_frame=4096) as connection:
        connection.reset()
        before = connection.request
        rewards = connection.relabel({"achieved_goal": achieved, "desired_goal": desired, "observation": np.zeros(100)}, 100)
        assert rewards.tolist() == Reach().compute_reward(achieved, desired, {}).tolist()
        assert connection.request - before == 1
        achieved, desired = np.tile(achieved, (3, 1)), np.tile(desired, (3, 1))
        assert connection.relabel({"achieved_goal": achieved, "desired_goal": desired}, 300).tolist() == rewards.tolist() * 3
        assert connection.request - before == 1 + 2, "(4096 - 8) / 20 rows in each"


def test_compute_reward_as_gymnasium_has_it():
    achieved, desired = wanted(5)
    with Server(Reach, envs=1) as server:
        env = consac.make(f"tcp://127.0.0.1:{server.port}")
        env.reset(seed=1)
        assert env.unwrapped.compute_reward(achieved, desired, [{}] * 5).tolist() == Reach().compute_reward(achieved, desired, {}).tolist()
        one = env.unwrapped.compute_reward(achieved[0], achieved[0], {})
        assert one == 0 and isinstance(one, float)
        env.close()


def test_an_environment_with_goals_goes_as_soon_as_nobody_has_it():
    with Server(Reach, envs=1) as server:
        gc.disable()
        try:
            env = consac.make(f"tcp://127.0.0.1:{server.port}")
            left = weakref.ref(env)
            del env
            assert left() is None, "it holds itself"
        finally:
            gc.enable()


def test_hindsight_of_stable_baselines3_learns_from_an_engine():
    sb3 = pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed: its tests did not run")
    from consac.sb3 import ConsacVecEnv
    with reaches(Plain) as server:
        env = ConsacVecEnv(f"tcp://127.0.0.1:{server.port}")
        model = sb3.DQN("MultiInputPolicy", env, replay_buffer_class=sb3.HerReplayBuffer, learning_starts=30, batch_size=16, train_freq=1, seed=1)
        before = env.connection.request
        model.learn(60)
        assert env.connection.request - before > 60 / 3 + 1, "it has asked for prices besides its steps"
        env.close()


def test_what_an_environment_cannot_price_harms_nothing_else():
    with reaches(Broken) as server, consac.client.connect(f"tcp://127.0.0.1:{server.port}") as connection:
        connection.reset()
        for second, why, code in ((3.0, "no such goal", "ENV_FAILED"), (4.0, "KeyboardInterrupt: of its own", "ENV_FAILED"), (2.0, "gave nan for row 0", "NON_FINITE")):
            achieved, desired = wanted(3, second)
            with pytest.raises(EngineError, match=why) as caught:
                connection.relabel({"achieved_goal": achieved, "desired_goal": desired}, 3)
            assert caught.value.code == code and not caught.value.fatal
            connection.step()  # no environment needs a RESET
        achieved, desired = wanted(3)
        assert len(connection.relabel({"achieved_goal": achieved, "desired_goal": desired}, 3)) == 3


@pytest.mark.parametrize("kind", [lambda: gymnasium.make("CartPole-v1"), Unlike], ids=["no goals", "goals that are not alike"])
def test_an_engine_without_it_says_so_and_is_not_asked(kind):
    with Server(kind, envs=1) as server:
        env = consac.make(f"tcp://127.0.0.1:{server.port}")
        assert not hasattr(env.unwrapped, "compute_reward")
        with pytest.raises(ConsacError, match="does not offer the capability `relabel`"):
            compute_reward(env.unwrapped.connection, np.zeros(2), np.zeros(2))
        with pytest.raises(ConsacError, match="does not offer the capability `relabel`"):
            env.unwrapped.connection.relabel({}, 1)
        env.close()


@pytest.mark.parametrize("rewards, why", [(struct.pack("<d", 1.0), "R94"), (bytes(24), "R94"), (struct.pack("<2d", 0.0, float("nan")), "nan for row 1 .*R95"), (struct.pack("<2d", float("inf"), 0.0), "inf for row 0 .*R95")])
def test_rewards_that_break_a_rule_end_the_session(rewards, why):
    def before(server, sock, frame):
        if frame.type == wire.RELABEL:
            sock.sendall(wire.pack(wire.Frame(wire.REWARDS, rewards, frame.request)))
        return frame.type == wire.RELABEL
    with ToyServer(observation=Reach.observation_space, before=before, capabilities=["relabel"]) as server:
        connection = consac.client.connect(server.url)
        connection.reset()
        achieved, desired = wanted(2)
        with pytest.raises(ProtocolError, match=why):
            connection.relabel({"achieved_goal": achieved, "desired_goal": desired}, 2)
        assert connection.closed


@needs_program
@pytest.mark.parametrize("flags", [[], ["--lockstep"]])
def test_hindsight_trains_on_an_environment_of_python(flags, tmp_path):
    with Server(Reach, envs=1) as server:
        done = run([PROGRAM, "train", f"tcp://127.0.0.1:{server.port}", "--algo", "dqn", "--steps", "200", "--set", "replay_buffer_class=HerReplayBuffer",
                    "--set", "learning_starts=50", "--set", "batch_size=16", "--json", "--dir", str(tmp_path), "--name", "reach", *flags])
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["updates"] > 30


@needs_program
def test_an_environment_that_cannot_price_ends_the_run_with_what_it_has(tmp_path):
    class Once(Reach):
        def compute_reward(self, achieved_goal, desired_goal, info):
            if np.ndim(achieved_goal) == 2 or info is not None and "own" not in info:
                raise RuntimeError("only its own")
            return super().compute_reward(achieved_goal, desired_goal, info)

        def step(self, action):
            self.at, self.steps = int(np.clip(self.at + 2 * action - 1, -4, 4)), self.steps + 1
            seen = self._see()
            return seen, -1.0, False, self.steps == 4, {}

    with Server(Once, envs=1) as server:
        done = run([PROGRAM, "train", f"tcp://127.0.0.1:{server.port}", "--algo", "dqn", "--steps", "200", "--set", "replay_buffer_class=HerReplayBuffer",
                    "--set", "learning_starts=50", "--set", "batch_size=16", "--dir", str(tmp_path), "--name", "reach"])
    assert done.returncode != 0
    line = done.stderr.splitlines()[-1]
    assert "while asking what other goals would have paid" in line and "only its own" in line and "ENV_FAILED" in line, done.stderr
