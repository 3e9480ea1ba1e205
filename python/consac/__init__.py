"""Engines of CONSAC in Python: `env = consac.make("tcp://127.0.0.1:5005")`."""
__version__ = "0.2.0"

from typing import TYPE_CHECKING, Any

from .errors import ConnectionLost, ConsacError, DeadlineExceeded, EngineBusy, EngineError, ProgramError, ProtocolError, Refused, SpecMismatch

_LAZY = {"make": "env", "ConsacEnv": "env", "make_vec": "vector", "ConsacVectorEnv": "vector", "ConsacParallelEnv": "pettingzoo", "ConsacVecEnv": "sb3",
         "Connection": "client", "connect": "client", "Server": "serve", "load_policy": "policy", "load_policies": "policy",
         "train": "training", "Training": "training", "Progress": "training", "find_program": "program"}

_MODULES = ("env", "vector", "pettingzoo", "sb3", "rllib", "client", "policy", "serve", "wire", "training", "program")

__all__ = ["__version__", "ConnectionLost", "ConsacError", "DeadlineExceeded", "EngineBusy", "EngineError", "ProgramError", "ProtocolError", "Refused", "SpecMismatch", *_LAZY, "serve"]

if TYPE_CHECKING:  # the same, as checkers of types want it: what has a name of its own is shown to others
    from . import client as client, env as env, pettingzoo as pettingzoo, policy as policy, program as program, rllib as rllib, sb3 as sb3, serve as serve, training as training, vector as vector, wire as wire
    from .client import Connection as Connection, connect as connect
    from .env import ConsacEnv as ConsacEnv, make as make
    from .pettingzoo import ConsacParallelEnv as ConsacParallelEnv
    from .policy import load_policies as load_policies, load_policy as load_policy
    from .program import find_program as find_program
    from .sb3 import ConsacVecEnv as ConsacVecEnv
    from .serve import Server as Server
    from .training import Progress as Progress, Training as Training, train as train
    from .vector import ConsacVectorEnv as ConsacVectorEnv, make_vec as make_vec


def __getattr__(name: str) -> Any:
    if name not in _LAZY and name not in _MODULES:
        raise AttributeError(f"module 'consac' has no attribute {name!r}")
    import importlib

    module = importlib.import_module(f".{_LAZY.get(name, name)}", __name__)
    return module if name in _MODULES else getattr(module, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_MODULES})
