"""RLlib's face of an engine, without RLlib."""
import sys

import gymnasium
import numpy as np
import pytest

from consac.errors import ConsacError, EngineBusy
from consac.serve import Limits


def test_rllib(monkeypatch, serve_env):
    import types

    from consac import rllib

    class Recreate(Exception):
        pass

    url = serve_env("CartPole-v1")
    with pytest.raises(ConsacError, match="env_config"):
        rllib.env_creator({})
    env = rllib.env_creator({"urls": [url], "protocol": 2, "max_episode_steps": 9, "shared_memory": False})
    env.reset(seed=1)
    env.step(0)
    monkeypatch.setattr(env.unwrapped.connection, "resume", None)
    env.unwrapped.connection._socket.shutdown(2)
    monkeypatch.setitem(sys.modules, "ray.rllib.utils.error", types.SimpleNamespace(StepFailedRecreateEnvError=Recreate))
    for name in ("ray", "ray.rllib", "ray.rllib.utils"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    with pytest.raises(Recreate, match="went away"):
        env.step(0)


def test_rllib_takes_a_free_engine_or_all_environments_of_one(serve_env):
    from consac import rllib

    full, free = serve_env("CartPole-v1", limits=Limits(max_sessions=1)), serve_env("CartPole-v1")
    first = rllib.env_creator({"urls": [full, free]})
    second = rllib.env_creator({"urls": [full, free]})
    assert [env.unwrapped.connection.url for env in (first, second)] == [full, free]
    with pytest.raises(EngineBusy):
        rllib.env_creator({"url": full})
    url = serve_env("CartPole-v1", envs=3)
    envs = rllib.env_creator({"url": url, "num_envs": 3})
    assert envs.num_envs == 3 and envs.reset(seed=1)[0].shape == (3, 4)
    assert envs.step(np.zeros(3, np.int64))[1].tolist() == [1, 1, 1]
    assert envs.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.NEXT_STEP
    with pytest.raises(ConsacError, match="has 3 environments, not 2"):
        rllib.env_creator({"url": url, "num_envs": 2})
    for env in (first, second, envs):
        env.close()
