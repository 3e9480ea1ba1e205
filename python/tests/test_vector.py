"""consac.make_vec against Gymnasium's SyncVectorEnv of the same environment, step by step, in all three autoreset modes."""
import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import consac
from consac.serve import Server

COUNT = 3


class Mixed(gymnasium.Env):
    """Episodes of random length that end in both ways, every type of info, a Dict of spaces."""

    observation_space = spaces.Dict(place=spaces.Box(-1, 1, (2,), np.float32), room=spaces.Discrete(4, start=2), tags=spaces.MultiBinary(3),
                                    more=spaces.Tuple([spaces.MultiDiscrete([3, 4]), spaces.Box(0, 255, (2, 2, 3), np.uint8)]))
    action_space = spaces.Dict(turn=spaces.Discrete(3, start=-1), push=spaces.Box(-1, 1, (2,), np.float32), keys=spaces.MultiBinary(2))

    def _observe(self):
        self.observation_space.seed(int(self.np_random.integers(1 << 31)))
        return self.observation_space.sample()

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps, self.length = 0, int(self.np_random.integers(2, 9))
        return self._observe(), {"begun": True, "options": str(options), "length": self.length}

    def step(self, action):
        assert action in self.action_space
        self.steps += 1
        over = self.steps == self.length
        info = {"count": self.steps, "push": float(action["push"][0]), "deep": {"turn": int(action["turn"]), "below": {"x": 0.5}}, "list": [1, 2], "none": None}
        if self.steps % 3 == 0:
            info["seldom"] = "yes"
        return self._observe(), float(self.np_random.normal()), over and self.length % 2 == 0, over and self.length % 3 != 0, info


ENVS = {"mixed": Mixed, "CartPole-v1": lambda: gymnasium.make("CartPole-v1", max_episode_steps=30), "FrozenLake-v1": lambda: gymnasium.make("FrozenLake-v1"),
        "Pendulum-v1": lambda: gymnasium.make("Pendulum-v1", max_episode_steps=20)}


@pytest.fixture
def pair():
    opened = []

    def open_pair(make_env, mode, **options):
        server = Server(make_env, COUNT).start()
        ours = consac.make_vec(f"tcp://127.0.0.1:{server.port}", autoreset_mode=mode, **options)
        theirs = SyncVectorEnv([make_env] * COUNT, autoreset_mode=mode)
        opened.extend([ours, theirs, server])
        return ours, theirs

    yield open_pair
    for one in opened:
        one.close()


def same(ours, theirs, what):
    """Equal in value, type, shape; object arrays element by element, a discrete int being as good as an np.int64."""
    if isinstance(theirs, dict):
        assert ours.keys() == theirs.keys(), (what, ours.keys(), theirs.keys())
        for key in theirs:
            same(ours[key], theirs[key], f"{what}/{key}")
    elif isinstance(theirs, tuple):
        assert len(ours) == len(theirs)
        for i, (a, b) in enumerate(zip(ours, theirs)):
            same(a, b, f"{what}/{i}")
    elif isinstance(theirs, np.ndarray) and theirs.dtype == object:
        assert isinstance(ours, np.ndarray) and ours.dtype == object and ours.shape == theirs.shape, what
        for i, (a, b) in enumerate(zip(ours, theirs)):
            same(a, b, f"{what}/{i}")
    elif isinstance(theirs, np.ndarray):
        assert isinstance(ours, np.ndarray) and ours.dtype == theirs.dtype and ours.shape == theirs.shape and (ours == theirs).all(), (what, ours, theirs)
    else:
        assert ours == theirs, (what, ours, theirs)


@pytest.mark.parametrize("mode", ["next_step", "same_step", "disabled"])
@pytest.mark.parametrize("name", ENVS)
def test_it_is_gymnasiums_own(name, mode, pair):
    mode = {"next_step": AutoresetMode.NEXT_STEP, "same_step": AutoresetMode.SAME_STEP, "disabled": AutoresetMode.DISABLED}[mode]
    ours, theirs = pair(ENVS[name], mode)
    assert ours.metadata["autoreset_mode"] == mode and ours.num_envs == COUNT
    for key in ("observation_space", "action_space", "single_observation_space", "single_action_space"):
        assert getattr(ours, key) == getattr(theirs, key)
    same(ours.reset(seed=7), theirs.reset(seed=7), "reset")
    theirs.action_space.seed(1)
    ended = 0
    for step in range(250):
        actions = theirs.action_space.sample()
        mine, expected = ours.step(actions), theirs.step(actions)
        same(mine, expected, f"step {step}")
        assert mine[0] in ours.observation_space
        over = expected[2] | expected[3]
        ended += over.sum()
        if mode is AutoresetMode.DISABLED and over.any():
            seeds = [step, None, None] if step % 2 and over[0] and not over[1:].any() else None
            options = {"reset_mask": over, "level": step}
            same(ours.reset(seed=seeds, options=dict(options)), theirs.reset(seed=seeds, options=dict(options)), f"reset {step}")
    assert ended > 5
    same(ours.reset(seed=[3, 1, 2]), theirs.reset(seed=[3, 1, 2]), "seeds")
    same(ours.reset(), theirs.reset(), "no seeds")


def test_arrays_are_the_callers_own_unless_asked(pair):
    ours, _ = pair(ENVS["CartPole-v1"], AutoresetMode.SAME_STEP)
    observation, _ = ours.reset(seed=1)
    kept = observation.copy()
    first = ours.step(np.zeros(COUNT, int))
    copies = [np.copy(part) for part in first[:4]]
    ours.step(np.ones(COUNT, int))
    assert (observation == kept).all()
    assert all((a == b).all() for a, b in zip(first, copies))
    views, _ = pair(ENVS["CartPole-v1"], AutoresetMode.SAME_STEP, copy=False)
    observation, _ = views.reset(seed=1)
    assert (observation == kept).all()
    views.step(np.zeros(COUNT, int))
    assert (observation == first[0]).all()


def test_masks_are_infos(pair):
    ours, theirs = pair(lambda: gymnasium.make("Taxi-v4"), AutoresetMode.NEXT_STEP)
    same(ours.reset(seed=1), theirs.reset(seed=1), "reset")
    for step in range(300):
        actions = theirs.action_space.sample()
        same(ours.step(actions), theirs.step(actions), f"step {step}")


def test_what_is_refused(pair):
    ours, _ = pair(ENVS["CartPole-v1"], AutoresetMode.DISABLED)
    ours.reset(seed=1)
    for wrong in (np.zeros(2, int), np.zeros((3, 1), int), np.zeros(3), [0, 1]):
        with pytest.raises(ValueError):
            ours.step(wrong)
    with pytest.raises(ValueError):
        ours.reset(seed=[1, 2])
    for wrong, kind in (([True] * 3, TypeError), (np.ones(3), TypeError), (np.ones(2, bool), ValueError), (np.zeros(3, bool), ValueError)):
        with pytest.raises(kind):
            ours.reset(options={"reset_mask": wrong})
    with pytest.raises(consac.EngineError, match="RESET_REQUIRED"):
        for _ in range(100):
            ours.step(np.zeros(3, int))
    with pytest.raises(consac.EngineError, match="OUT_OF_RANGE"):
        ours.reset(seed=1)
        ours.step(np.array([0, 0, 2]))
