"""What SPEC says of an environment, and how environments are made from their names."""
from __future__ import annotations

import difflib
import hashlib
import importlib
import inspect
import math
from dataclasses import dataclass, field

import gymnasium
import numpy as np
from gymnasium import spaces

from consac import wire
from consac.extras import Parameter, check_parameters
from consac.goals import has_goals
from consac.layout import Behaviour, Layout, space_to_json
from consac.names import check_names_apart, check_names_together, printable_line

from .goals import reward_function
from .infos import check_info

GROUPS = ("kind", "spaces")
_OLD = "; one of the old gym package is wrapped first, for example by shimmy"


@dataclass
class World:
    """What SPEC says of an environment, learnt from one instance of it."""

    name: str
    environments: int
    behaviours: list[Behaviour]
    multi_agent: bool
    renders: bool
    prices: bool  # says what other goals would have paid
    max_episode_steps: int = 0
    deterministic: bool = True
    ids: dict | None = None  # of several agents: what the environment calls them, by their names
    parameters: list[Parameter] = field(default_factory=list)  # that go to reset(options=...)
    statistics: list[str] = field(default_factory=list)  # numbers of infos that are told as statistics

    @classmethod
    def probe(cls, make_env, environments: int, name: str = "", group: str = "kind", parameters: list[Parameter] = (), statistics: list[str] = ()) -> "World":
        """`parameters`: what may be set; `statistics`: which numbers of infos are told as such. ValueError where names or bounds are wrong."""
        check_parameters(parameters)
        check_names_apart("statistic", statistics)
        env = make_env()
        lacks = [part for part in ("reset", "step", "close", "observation_space", "action_space") if not hasattr(env, part)]
        if lacks:
            raise TypeError(f"{type(env).__name__} is no environment of Gymnasium or PettingZoo: it has no {' and no '.join(lacks)}" + _OLD)
        try:
            spec = getattr(env, "spec", None)
            known = name or (spec.id if spec is not None else "") or (getattr(env, "metadata", None) or {}).get("name", "") or type(getattr(env, "unwrapped", env)).__name__
            multi_agent = hasattr(env, "possible_agents")
            if not multi_agent and callable(env.observation_space):
                raise TypeError(f"{known} does not name its possible_agents; protocol 2 needs all names before the first episode")
            groups = _groups(env, group) if multi_agent else [("default", ["agent"], env.observation_space, env.action_space)]
            check_names_together("behaviour", [name for name, *_ in groups])
            check_names_apart("agent", [str(agent) for agent in env.possible_agents] if multi_agent else [])
            for _, agents, observation, action in groups:
                _check_size(environments * len(agents), observation, "observation")
                _check_size(environments * len(agents), action, "action")
            begun = env.reset(options=defaults_of(parameters)) if parameters else env.reset()
            if not (isinstance(begun, tuple) and len(begun) == 2 and isinstance(begun[1], dict)):
                raise TypeError(f"{known}.reset() gave a {type(begun).__name__}, expected an observation and a dict of infos" + _OLD)
            info = begun[1]
            behaviours = []
            for group, agents, observation, action in groups:
                layouts = [_layout(observation, "observation"), _layout(action, "action")]
                first = info.get(agents[0]) or {} if multi_agent else info
                check_info(first, f"the info of {agents[0]}")
                mask = first.get("action_mask")
                masks = mask is not None and layouts[1].mask_bytes > 0 and flat_mask(mask).size == layouts[1].mask_bytes
                behaviours.append(Behaviour(group, list(map(str, agents)), *layouts, environments * len(agents), masks))
            return cls(printable_line(known, 255), environments, behaviours, multi_agent, getattr(env, "render_mode", None) == "rgb_array" and "rgb_array" in (getattr(env, "metadata", None) or {}).get("render_modes", ()),
                       not multi_agent and has_goals(env.observation_space) and reward_function(env) is not None,
                       int(getattr(spec, "max_episode_steps", 0) or 0), not getattr(spec, "nondeterministic", False),
                       {str(agent): agent for agent in env.possible_agents} if multi_agent else None, list(parameters), list(statistics))
        finally:
            env.close()

    @property
    def parameter_bytes(self) -> int:
        """Of their block in RESET and STEP."""
        return 8 * self.environments * len(self.parameters)

    def to_json(self, autoreset: str, training_length: int, model_name: str, agreed: set[str] = frozenset()) -> dict:
        behaviours = [behaviour.to_json() for behaviour in self.behaviours]
        extra = {"parameters": [one.to_json() for one in self.parameters]} if "parameters" in agreed else {}
        return extra | {"id": self.name, "environments": self.environments, "max_episode_steps": self.max_episode_steps, "autoreset": autoreset,
                "training_length": training_length, "model_name": model_name, "deterministic": self.deterministic,
                "hash": hashlib.sha256(wire.canonical_json(behaviours)).hexdigest(), "behaviours": behaviours}


def defaults_of(parameters: list[Parameter]) -> dict:
    """What reset() finds in its options where nobody has set anything."""
    return {one.name: float(one.default) for one in parameters}


def _groups(env, by: str) -> list[tuple]:
    """Agents of one kind, or all, whose spaces are equal are one behaviour, named after what their names begin with."""
    if by not in GROUPS:
        raise ValueError(f"group {by!r}; agents are grouped by {' or '.join(GROUPS)}")
    groups: list[tuple] = []
    for agent in env.possible_agents:
        observation, action = env.observation_space(agent), env.action_space(agent)
        kind = str(agent).rstrip("0123456789").rstrip("_") or "agent"
        same = next((group for group in groups if group[2] == observation and group[3] == action and (by == "spaces" or group[0] == kind)), None)
        if same:
            same[1].append(agent)
        else:
            groups.append((kind, [agent], observation, action))
    if len(groups) == 1:
        return [("default", *groups[0][1:])]
    names = [group[0] for group in groups]
    return [(name if names.count(name) == 1 else f"{name}_{index}", *group[1:]) for index, (name, group) in enumerate(zip(names, groups))]


def _check_size(rows: int, space: spaces.Space, what: str) -> None:
    """Refuses what no frame carries before anything of that size is made."""
    size = _bytes(space)
    if rows * size > wire.LARGEST_FRAME:
        raise ValueError(f"{rows} {what}{'s' * (rows > 1)} of {size} bytes make frames over {wire.LARGEST_FRAME} bytes, the most that protocol 2 carries; use fewer environments or a smaller {what}")


def _bytes(space: spaces.Space) -> int:
    """Bytes of a value in a row, without padding; 0 of a kind that cannot be sent."""
    if isinstance(space, (spaces.Dict, spaces.Tuple)):
        return sum(map(_bytes, space.spaces.values() if isinstance(space, spaces.Dict) else space.spaces))
    size = space.dtype.itemsize if isinstance(space, spaces.Box) else 4 if isinstance(space, (spaces.Discrete, spaces.MultiDiscrete)) else isinstance(space, spaces.MultiBinary)
    return size * math.prod(space.shape or ())


def _layout(space: spaces.Space, what: str) -> Layout:
    space_to_json(space)
    layout = Layout.of(space)
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
    """Makes environments by Gymnasium id, by `package:id` of a package that registers it, or by `module:attribute` where the attribute is callable."""
    module, colon, attribute = name.partition(":")
    if colon:
        place, name = importlib.import_module(module), attribute  # gymnasium.spec imports nothing, unlike gymnasium.make
    if colon and attribute.isidentifier():
        found = getattr(place, attribute, None)
        if callable(found):
            return _drawing(found) if render else found
        if attribute not in gymnasium.registry:
            near = difflib.get_close_matches(attribute, [known for known in vars(place) if callable(getattr(place, known)) and not known.startswith("_")], 1)
            raise ValueError(f"module {module!r} has no callable {attribute!r}" + (f"; did you mean {module}:{near[0]}?" if near else ""))
    spec = gymnasium.spec(name)
    modes = getattr(gymnasium.envs.registration.load_env_creator(spec.entry_point), "metadata", {}).get("render_modes", []) if isinstance(spec.entry_point, str) else []
    mode = "rgb_array" if render and "rgb_array" in modes else None
    return lambda: gymnasium.make(name, render_mode=mode, disable_env_checker=True)


def _drawing(maker):
    """The same maker of environments, told to draw where it says that it can."""
    try:
        takes = inspect.signature(maker).parameters.values()
    except (TypeError, ValueError):
        return maker
    named = any(one.name == "render_mode" or one.kind is one.VAR_KEYWORD for one in takes)
    if not named or "rgb_array" not in (getattr(maker, "metadata", None) or {}).get("render_modes", ()):
        return maker
    return lambda: maker(render_mode="rgb_array")


def pettingzoo_maker(name: str, render: bool = True):
    module = importlib.import_module(name)

    def make():
        return module.parallel_env(render_mode="rgb_array") if render else module.parallel_env()

    return make
