"""ConsacParallelEnv under PettingZoo's own tests, and step by step against the environment that is served."""
import functools

import numpy as np
import pytest
from gymnasium import spaces

pytest.importorskip("pettingzoo", reason="pettingzoo is not installed: its tests did not run")
from pettingzoo import ParallelEnv
from pettingzoo.test import parallel_api_test, parallel_seed_test

import consac
from consac.serve import Server


class Hunt(ParallelEnv):
    """Two hunters and a deer of other spaces; each agent leaves in its own time, by either end."""

    metadata = {"name": "hunt_v0", "render_modes": []}
    render_mode = None
    possible_agents = ["hunter_0", "deer", "hunter_1"]
    LENGTHS = {"hunter_0": 5, "deer": 9, "hunter_1": 7}

    @functools.cache
    def observation_space(self, agent):
        return spaces.Dict(eye=spaces.Box(0, 1, (3,), np.float32), age=spaces.Discrete(20)) if agent == "deer" else spaces.Box(-1, 1, (2,), np.float64)

    @functools.cache
    def action_space(self, agent):
        return spaces.Box(-1, 1, (2,), np.float32) if agent == "deer" else spaces.Discrete(4)

    def _observe(self, agent):
        if agent == "deer":
            return {"eye": self.random.random(3, np.float32), "age": self.steps}
        return self.random.uniform(-1, 1, 2)

    def reset(self, seed=None, options=None):
        if seed is not None or not hasattr(self, "random"):
            self.random = np.random.default_rng(seed)
        self.steps, self.agents = 0, self.possible_agents[:]
        return {agent: self._observe(agent) for agent in self.agents}, {agent: {"options": str(options)} for agent in self.agents}

    def step(self, actions):
        assert set(actions) == set(self.agents)
        self.steps += 1
        here = self.agents
        over = {agent: self.steps == self.LENGTHS[agent] for agent in here}
        observations = {agent: self._observe(agent) for agent in here}
        rewards = {agent: float(np.sum(actions[agent])) for agent in here}
        terminations = {agent: over[agent] and agent != "hunter_1" for agent in here}
        truncations = {agent: over[agent] and agent != "deer" for agent in here}
        self.agents = [agent for agent in here if not over[agent]]
        return observations, rewards, terminations, truncations, {agent: {"steps": self.steps} if agent != "deer" else {} for agent in here}


@pytest.fixture
def url():
    server = Server(Hunt).start()
    yield f"tcp://127.0.0.1:{server.port}"
    server.close()


def test_pettingzoos_own_tests(url):
    env = consac.ConsacParallelEnv(url)
    parallel_api_test(env, num_cycles=50)
    env.close()
    opened = []

    def make():
        opened.append(consac.ConsacParallelEnv(url))
        return opened[-1]
    parallel_seed_test(make, num_cycles=30)
    for env in opened:
        env.close()


def test_it_is_the_environment_that_is_served(url):
    ours, theirs = consac.ConsacParallelEnv(url), Hunt()
    assert set(ours.possible_agents) == set(theirs.possible_agents)
    for agent in theirs.possible_agents:
        assert ours.observation_space(agent) == theirs.observation_space(agent) and ours.observation_space(agent) is ours.observation_space(agent)
        assert ours.action_space(agent) == theirs.action_space(agent)
    for seed, options in ((1, None), (None, {"a": 2}), (3, None)):
        equal(ours.reset(seed=seed, options=options), theirs.reset(seed=seed, options=options))
        while theirs.agents:
            actions = {agent: theirs.action_space(agent).sample() for agent in theirs.agents}
            equal(ours.step(actions), theirs.step(actions))
            assert set(ours.agents) == set(theirs.agents)
        assert ours.step({}) == ({}, {}, {}, {}, {})
    ours.reset()
    with pytest.raises(ValueError, match="no action for"):
        ours.step({"deer": [0, 0]})
    ours.close()


def equal(ours, theirs):
    if isinstance(theirs, dict):
        assert ours.keys() == theirs.keys(), (ours, theirs)
        for key in theirs:
            equal(ours[key], theirs[key])
    elif isinstance(theirs, tuple):
        assert len(ours) == len(theirs)
        for a, b in zip(ours, theirs):
            equal(a, b)
    elif isinstance(theirs, np.ndarray):
        assert ours.dtype == theirs.dtype and (ours == theirs).all()
    else:
        assert type(ours) is type(theirs) and ours == theirs, (ours, theirs)
