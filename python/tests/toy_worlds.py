"""Environments of a few lines for the tests of the server."""
import gymnasium
import numpy as np
from gymnasium import spaces


class Counter(gymnasium.Env):
    """Counts steps; ends after `length`, terminated for action 0 and truncated for others."""

    observation_space = spaces.Box(0, 1000, (2,), np.float32)
    action_space = spaces.Discrete(3)
    metadata = {"render_modes": ["rgb_array"]}
    render_mode = "rgb_array"
    length = 3

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.count = 0
        self.mark = int(self.np_random.integers(1000))
        return self._see(), {"from": "reset"} | ({"options": options} if options else {})

    def step(self, action):
        assert self.action_space.contains(action)
        self.count += 1
        over = self.count >= self.length
        return self._see(), 0.1 * self.count, over and action == 0, over and action != 0, {"count": self.count, "odd": np.float32("nan"), "list": np.arange(2)}

    def _see(self):
        return np.array([self.count, self.mark], np.float32)

    def render(self):
        return np.full((2, 3, 3), self.count, np.uint8)


class Nested(gymnasium.Env):
    """All kinds of leaves; shows what it was sent; masks nothing."""

    inside = spaces.Dict({"b": spaces.Box(-1, 1, (2, 2), np.float64), "a": spaces.Discrete(3, start=-1),
                          "t": spaces.Tuple([spaces.MultiDiscrete([2, 3]), spaces.MultiBinary(3), spaces.Box(0, 255, (3,), np.uint8)])})
    observation_space = action_space = inside

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.inside.seed(3)
        return self.inside.sample(), {}

    def step(self, action):
        assert self.inside.contains(action)
        return action, 1.5, False, False, {}


class Masked(Counter):
    def reset(self, **arguments):
        return super().reset(**arguments)[0], {"action_mask": np.array([1, 0, 1], np.int8)}

    def step(self, action):
        return (*super().step(action)[:4], {"action_mask": np.array([0, 1, 0], np.int8)})


class Failing(Counter):
    def step(self, action):
        if action == 2:
            raise RuntimeError("the motor burnt out")
        return super().step(action)


class Agents:
    """Three agents in PettingZoo's parallel form; agent k lives k + 2 steps; two kinds of spaces."""

    metadata = {"name": "three"}
    possible_agents = ["red_0", "red_1", "blue_0"]

    def observation_space(self, agent):
        return spaces.Box(-9, 9, (1 if agent.startswith("red") else 2,), np.float32)

    def action_space(self, agent):
        return spaces.Discrete(2)

    def _see(self):
        return {agent: np.full(self.observation_space(agent).shape, self.time, np.float32) for agent in self.agents}

    def reset(self, seed=None, options=None):
        self.agents, self.time = list(self.possible_agents), 0
        return self._see(), {agent: {"at": 0} for agent in self.agents}

    def step(self, actions):
        assert sorted(actions) == sorted(self.agents)
        self.time += 1
        seen, rewards = self._see(), {agent: float(self.time) for agent in self.agents}
        ended = {agent: self.time >= self.possible_agents.index(agent) + 2 for agent in self.agents}
        infos = {agent: {"at": self.time} for agent in self.agents}
        self.agents = [agent for agent in self.agents if not ended[agent]]
        return seen, rewards, ended, {agent: False for agent in ended}, infos

    def close(self):
        pass


# ---- what an environment shows

class Brittle(Counter):
    def step(self, action):
        raise RuntimeError("boom")


# ---- environments that fail, are misspelt, draw, or have kinds of agents

class Pack(Agents):
    """Two kinds of equal spaces."""

    possible_agents = ["wolf_0", "wolf_1", "sheep_0"]

    def observation_space(self, agent):
        return spaces.Box(-9, 9, (1,), np.float32)
