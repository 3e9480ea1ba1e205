"""An engine with several agents as a PettingZoo ParallelEnv."""
from __future__ import annotations

from typing import TYPE_CHECKING

from pettingzoo import ParallelEnv

from . import wire
from .env import mask_value, row_reader, slot_writer
from .face import RENDER_FPS, Face

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .options import Options

_FACE = Face("disabled", text1="which has one agent; use consac.make", environments="serve one for PettingZoo", agents=None)


class ConsacParallelEnv(ParallelEnv):
    """One environment with all its agents. Other arguments are in options.py."""

    def __init__(self, url: str, render_mode: str | None = None, **options: Unpack[Options]):
        self.connection, modes = _FACE.open(url, render_mode, options)
        connection = self.connection
        self.metadata = {"name": connection.id, "render_modes": modes, "render_fps": RENDER_FPS, "is_parallelizable": True}
        self.render_mode = render_mode
        listed = [agent for behaviour in connection.behaviours for agent in behaviour.agents]
        twice = len(set(listed)) != len(listed)
        self._places = {}  # agent: (behaviour, rows, slot, write, read)
        self._names = []  # by slot, counted on through the behaviours
        for behaviour, rows, actions in zip(connection.behaviours, connection.rows, connection.actions):
            for slot, agent in enumerate(behaviour.agents):
                name = f"{behaviour.name}/{agent}" if twice else agent
                self._places[name] = (behaviour, rows, slot, slot_writer(behaviour.action, actions, slot), row_reader(behaviour.observation, rows.observations, slot))
                self._names.append(name)
        self.possible_agents = list(self._names)
        self.agents: list[str] = []
        self.observation_spaces = {name: place[0].observation.space for name, place in self._places.items()}
        self.action_spaces = {name: place[0].action.space for name, place in self._places.items()}

    def observation_space(self, agent):
        return self.observation_spaces[agent]

    def action_space(self, agent):
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict | None = None):
        self.connection.reset(None, None if seed is None else [seed], options)
        self.agents = self._active()
        return {name: self._places[name][4]() for name in self.agents}, self._infos(self.agents)

    def step(self, actions: dict):
        if not self.agents:
            return {}, {}, {}, {}, {}
        for name in self.agents:
            if name not in actions:
                raise ValueError(f"no action for {name}; all of {self.agents} act")
            self._places[name][3](actions[name])
        self.connection.step()
        active = self._active()
        told = self.agents + [name for name in active if name not in self.agents]
        observations, rewards, terminations, truncations = {}, {}, {}, {}
        for name in told:
            _, rows, slot, _, read = self._places[name]
            state = int(rows.states[slot])
            observations[name], rewards[name] = read(), float(rows.rewards[slot])
            terminations[name], truncations[name] = state & wire.TERMINATED != 0, state & wire.TRUNCATED != 0
        self.agents = [name for name in active if not (terminations[name] or truncations[name])]
        return observations, rewards, terminations, truncations, self._infos(told)

    def render(self):
        return self.connection.render(0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        self.connection.close()

    def _active(self) -> list[str]:
        return [name for name, (_, rows, slot, _, _) in self._places.items() if rows.states[slot] & wire.ACTIVE]

    def _infos(self, names: list[str]) -> dict:
        infos: dict = {name: {} for name in names}
        for key, column in (self.connection.infos or {}).items():
            for slot, value in zip(column["slots"], column["values"]):
                if self._names[slot] in infos:
                    infos[self._names[slot]][key] = value
        for name in names:
            behaviour, rows, slot, _, _ = self._places[name]
            if rows.masks is not None:
                infos[name]["action_mask"] = mask_value(behaviour.action.space, rows.masks[slot])
        return infos
