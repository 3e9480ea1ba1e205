"""What SPEC says of an environment, and how environments are made from their names."""
from __future__ import annotations

import hashlib
import importlib
from dataclasses import dataclass

import gymnasium
import numpy as np
from gymnasium import spaces

from consac import wire


@dataclass
class World:
    """What SPEC says of an environment, learnt from one instance of it."""

    name: str
    environments: int
    behaviours: list[wire.Behaviour]
    multi_agent: bool
    renders: bool
    max_episode_steps: int = 0
    deterministic: bool = True
    ids: dict | None = None  # of several agents: what the environment calls them, by their names

    @classmethod
    def probe(cls, make_env, environments: int, name: str = "") -> "World":
        env = make_env()
        try:
            spec = getattr(env, "spec", None)
            known = name or (spec.id if spec is not None else "") or env.metadata.get("name", "") or type(getattr(env, "unwrapped", env)).__name__
            multi_agent = hasattr(env, "possible_agents")
            if not multi_agent and callable(env.observation_space):
                raise TypeError(f"{known} does not name its possible_agents; protocol 2 needs all names before the first episode")
            groups = _groups(env) if multi_agent else [("default", ["agent"], env.observation_space, env.action_space)]
            _, info = env.reset()
            behaviours = []
            for group, agents, observation, action in groups:
                layouts = [_layout(observation, "observation"), _layout(action, "action")]
                mask = (info.get(agents[0]) or {} if multi_agent else info).get("action_mask")
                masks = mask is not None and layouts[1].mask_bytes > 0 and flat_mask(mask).size == layouts[1].mask_bytes
                behaviours.append(wire.Behaviour(group, list(map(str, agents)), *layouts, environments * len(agents), masks))
            return cls(known, environments, behaviours, multi_agent, getattr(env, "render_mode", None) == "rgb_array",
                       int(getattr(spec, "max_episode_steps", 0) or 0), not getattr(spec, "nondeterministic", False),
                       {str(agent): agent for agent in env.possible_agents} if multi_agent else None)
        finally:
            env.close()

    def to_json(self, autoreset: str, training_length: int, model_name: str) -> dict:
        behaviours = [behaviour.to_json() for behaviour in self.behaviours]
        return {"id": self.name, "environments": self.environments, "max_episode_steps": self.max_episode_steps, "autoreset": autoreset,
                "training_length": training_length, "model_name": model_name, "deterministic": self.deterministic,
                "hash": hashlib.sha256(wire.canonical_json(behaviours)).hexdigest(), "behaviours": behaviours}


def _groups(env) -> list[tuple]:
    """Agents with equal spaces are one behaviour, named after what their names begin with."""
    groups: list[tuple] = []
    for agent in env.possible_agents:
        observation, action = env.observation_space(agent), env.action_space(agent)
        same = next((group for group in groups if group[2] == observation and group[3] == action), None)
        if same:
            same[1].append(agent)
        else:
            groups.append((str(agent).rstrip("0123456789").rstrip("_") or str(agent), [agent], observation, action))
    if len(groups) == 1:
        return [("default", *groups[0][1:])]
    names = [group[0] for group in groups]
    return [(name if names.count(name) == 1 else f"{name}_{index}", *group[1:]) for index, (name, group) in enumerate(zip(names, groups))]


def _layout(space: spaces.Space, what: str) -> wire.Layout:
    wire.space_to_json(space)
    layout = wire.Layout.of(space)
    for leaf in layout.leaves:
        highest = 0
        if isinstance(leaf.space, spaces.Discrete):
            highest = int(leaf.space.start) + int(leaf.space.n)
        elif isinstance(leaf.space, spaces.MultiDiscrete):
            highest = int(np.max(leaf.space.nvec, initial=0))
        if highest > 2**31 or isinstance(leaf.space, spaces.Discrete) and leaf.space.start < -2**31:
            raise TypeError(f"the {what} space {leaf.space} has values that a row's I32 cannot hold; wrap it")
    return layout


def flat_mask(mask) -> np.ndarray:
    if isinstance(mask, dict):
        mask = [mask[name] for name in sorted(mask, key=str.encode)]
    parts = [np.ravel(part) for part in mask] if isinstance(mask, (tuple, list)) else [np.ravel(mask)]
    return np.concatenate(parts).astype(bool)


def environment_maker(name: str, render: bool = True):
    """Makes environments by Gymnasium id, or by `module:attribute` where the attribute is callable."""
    module, colon, attribute = name.partition(":")
    if colon and attribute.isidentifier():
        found = getattr(importlib.import_module(module), attribute, None)
        if callable(found):
            return found
    spec = gymnasium.spec(name)
    modes = getattr(gymnasium.envs.registration.load_env_creator(spec.entry_point), "metadata", {}).get("render_modes", []) if isinstance(spec.entry_point, str) else []
    mode = "rgb_array" if render and "rgb_array" in modes else None
    return lambda: gymnasium.make(name, render_mode=mode, disable_env_checker=True)


def pettingzoo_maker(name: str, render: bool = True):
    module = importlib.import_module(name)

    def make():
        return module.parallel_env(render_mode="rgb_array") if render else module.parallel_env()

    return make
