"""Engines for RLlib: `register("my-engine")`, then config.environment("my-engine", env_config={"url": "tcp://..."})."""
from __future__ import annotations

import gymnasium

from .env import make
from .errors import ConnectionLost, ConsacError, DeadlineExceeded


def env_creator(config) -> gymnasium.Env:
    """An environment from `env_config`: `url`, or `urls`, one per runner; the rest are consac.make's arguments."""
    options = dict(config)
    urls = options.pop("urls", None)
    if urls is not None:
        index = getattr(config, "worker_index", 0) + getattr(config, "vector_index", 0)
        options["url"] = urls[index % len(urls)]
    if "url" not in options:
        raise ConsacError('env_config needs "url": "tcp://host:port", or "urls"')
    return Recreated(make(**options))


class Recreated(gymnasium.Wrapper):
    """Tells RLlib to make the environment anew where its engine was lost."""

    def reset(self, **options):
        try:
            return self.env.reset(**options)
        except (ConnectionLost, DeadlineExceeded) as error:
            raise _recreate(error) from error

    def step(self, action):
        try:
            return self.env.step(action)
        except (ConnectionLost, DeadlineExceeded) as error:
            raise _recreate(error) from error


def _recreate(error: Exception) -> Exception:
    try:
        from ray.rllib.utils.error import StepFailedRecreateEnvError
    except ImportError:
        return error
    return StepFailedRecreateEnvError(str(error))


def register(name: str = "consac") -> None:
    """Makes `name` known to RLlib."""
    from ray.tune.registry import register_env

    register_env(name, env_creator)
