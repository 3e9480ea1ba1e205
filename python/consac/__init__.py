"""Engines of CONSAC in Python: `env = consac.make("tcp://127.0.0.1:5005")`."""
__version__ = "0.2.0"

from .errors import ConnectionLost, ConsacError, DeadlineExceeded, EngineBusy, EngineError, ProgramError, ProtocolError, Refused, SpecMismatch

_LAZY = {"make": "env", "ConsacEnv": "env", "make_vec": "vector", "ConsacVectorEnv": "vector", "ConsacParallelEnv": "pettingzoo", "ConsacVecEnv": "sb3",
         "Connection": "client", "connect": "client", "Server": "serve", "load_policy": "policy", "load_policies": "policy",
         "train": "training", "Training": "training", "Progress": "training", "find_program": "program"}

_MODULES = ("env", "vector", "pettingzoo", "sb3", "rllib", "client", "policy", "serve", "wire", "training", "program")

__all__ = ["__version__", "ConnectionLost", "ConsacError", "DeadlineExceeded", "EngineBusy", "EngineError", "ProgramError", "ProtocolError", "Refused", "SpecMismatch", *_LAZY, "serve"]


def __getattr__(name: str) -> object:
    if name not in _LAZY and name not in _MODULES:
        raise AttributeError(f"module 'consac' has no attribute {name!r}")
    import importlib

    module = importlib.import_module(f".{_LAZY.get(name, name)}", __name__)
    return module if name in _MODULES else getattr(module, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_MODULES})
