"""Engines for RLlib: `register("my-engine")`, then config.environment("my-engine", env_config={"url": "tcp://..."})."""
from __future__ import annotations

import gymnasium

from .env import make
from .errors import ConnectionLost, ConsacError, DeadlineExceeded, EngineBusy
from .vector import make_vec


def env_creator(config) -> gymnasium.Env | gymnasium.vector.VectorEnv:
    """An environment from `env_config`: `url`, or `urls`, of which the first free one is taken; the rest are consac.make's arguments.

    With env_runners(gym_env_vectorize_mode="vector_entry_point", num_envs_per_env_runner=N), all N environments of one engine."""
    options = dict(config)
    urls = options.pop("urls", None) or [options.pop("url", None)]
    count = options.pop("num_envs", None)
    if None in urls:
        raise ConsacError('env_config needs "url": "tcp://host:port", or "urls"')
    first = getattr(config, "worker_index", 0) + getattr(config, "vector_index", 0)  # both are 0 where RLlib does not say
    for attempt in range(len(urls)):
        url = urls[(first + attempt) % len(urls)]
        try:
            if count is None:
                return Recreated(make(url, **options))
            envs = make_vec(url, **options)
        except EngineBusy:
            if attempt + 1 == len(urls):
                raise
            continue
        if envs.num_envs != count:
            envs.close()
            raise ConsacError(f"{url} has {envs.num_envs} environments, not {count}; set num_envs_per_env_runner={envs.num_envs}")
        return RecreatedVector(envs)


class _Recreating:
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


class Recreated(_Recreating, gymnasium.Wrapper):
    pass


class RecreatedVector(_Recreating, gymnasium.vector.VectorWrapper):
    pass


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
