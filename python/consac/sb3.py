"""All environments of an engine as a Stable Baselines3 VecEnv, without a second copy of anything."""
from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from . import wire
from .env import mask_value, row_reader
from .errors import ConsacError
from .face import Face
from .goals import compute_reward
from .vector import batch_reader, batch_writer

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .options import Options

_FACE = Face("same_step", text1="which has one environment; use DummyVecEnv([lambda: consac.make(url)])")


class ConsacVecEnv(VecEnv):
    """For `PPO("MlpPolicy", ConsacVecEnv("tcp://127.0.0.1:5005"))`. Other arguments are in options.py."""

    def __init__(self, url: str, render_mode: str | None = None, **options: Unpack[Options]):
        self.connection, _ = _FACE.open(url, render_mode, options)
        connection = self.connection
        behaviour = connection.behaviours[0]
        self._attributes = {"render_mode": render_mode, "spec": None}
        super().__init__(connection.environments, behaviour.observation.space, behaviour.action.space)
        self._behaviour, self._rows = behaviour, connection.rows[0]
        self._read = batch_reader(behaviour.observation, self._rows.observations, copy=True)
        self._write = batch_writer(behaviour.action, connection.actions[0])
        self._continuous = isinstance(behaviour.action.space, spaces.Box)

    def reset(self):
        options = next((one for one in self._options if one), None)
        if any(one != (options or {}) for one in self._options):
            raise ConsacError("an engine takes the same options for all environments")
        seeds = None
        if any(seed is not None for seed in self._seeds):
            seeds = [int(np.random.default_rng().integers(1 << 31)) if seed is None else int(seed) for seed in self._seeds]
        self.connection.reset(None, seeds, options)
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = self._spread(self.connection.infos)
        self._add_masks(self.reset_infos)
        return self._read()

    def step_async(self, actions: np.ndarray) -> None:
        self._write(actions)

    def step_wait(self):
        connection, rows = self.connection, self._rows
        connection.step()
        states = rows.states
        dones = (states & 3) != 0
        if connection.parts & wire.PART_INFOS:
            begun, ended = self._spread(connection.infos), self._spread(connection.final_infos)
            infos = [ended[i] if dones[i] else begun[i] for i in range(self.num_envs)]
            for i in np.flatnonzero(dones):
                self.reset_infos[i] = begun[i]
            for info in infos:
                info["TimeLimit.truncated"] = False
        else:
            infos = [{"TimeLimit.truncated": False} for _ in range(self.num_envs)]
        if connection.parts & wire.PART_FINALS:
            for place, slot in enumerate(rows.final_slots):
                infos[slot]["terminal_observation"] = row_reader(self._behaviour.observation, rows.finals, place)()
                infos[slot]["TimeLimit.truncated"] = bool(states[slot] & 3 == wire.TRUNCATED)
        self._add_masks(infos)
        return self._read(), rows.rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        self.connection.close()

    def get_images(self):
        return [self.connection.render(i) for i in range(self.num_envs)] if self.render_mode == "rgb_array" else [None] * self.num_envs

    def action_masks(self) -> np.ndarray | None:
        """[environments, choices] bool, as sb3-contrib's MaskablePPO asks for it."""
        return None if self._rows.masks is None else self._rows.masks.astype(bool)

    def get_attr(self, attr_name: str, indices=None) -> list:
        count = len(list(self._get_indices(indices)))
        if attr_name in self._attributes:
            return [self._attributes[attr_name]] * count
        raise AttributeError(f"an engine's environments have no attribute {attr_name!r} here")

    def set_attr(self, attr_name: str, value, indices=None) -> None:
        raise AttributeError(f"{attr_name!r} of an engine's environments cannot be set from here")

    def has_attr(self, attr_name: str) -> bool:
        return attr_name in self._attributes

    def env_method(self, method_name: str, *method_args, indices=None, **method_kwargs) -> list:
        if method_name == "action_masks" and self._rows.masks is not None:
            return [self._rows.masks[i].astype(bool) for i in self._get_indices(indices)]
        if method_name == "compute_reward" and len(method_args) >= 2:  # HerReplayBuffer
            return [compute_reward(self.connection, *method_args[:2])] * len(list(self._get_indices(indices)))
        raise AttributeError(f"an engine's environments have no method {method_name!r} here")

    def env_is_wrapped(self, wrapper_class, indices=None) -> list[bool]:
        return [False for _ in self._get_indices(indices)]

    def _spread(self, said: dict | None) -> list[dict]:
        infos: list[dict] = [{} for _ in range(self.num_envs)]
        for key, column in (said or {}).items():
            for slot, value in zip(column["slots"], column["values"]):
                infos[slot][key] = value
        return infos

    def _add_masks(self, infos: list[dict]) -> None:
        if self._rows.masks is not None:
            for info, row in zip(infos, self._rows.masks):
                info["action_mask"] = mask_value(self._behaviour.action.space, row)
