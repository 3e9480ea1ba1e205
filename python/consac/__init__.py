"""Engines of CONSAC in Python: `env = consac.make("tcp://127.0.0.1:5005")`."""
__version__ = "0.1.0"

from .errors import ConnectionLost, ConsacError, DeadlineExceeded, EngineBusy, EngineError, ProtocolError, Refused, SpecMismatch

_LAZY = {"make": "env", "ConsacEnv": "env", "make_vec": "vector", "ConsacVectorEnv": "vector", "ConsacParallelEnv": "pettingzoo", "ConsacVecEnv": "sb3",
         "Connection": "client", "connect": "client", "Server": "serve", "serve": "serve", "load_policy": "policy"}

__all__ = ["__version__", "ConnectionLost", "ConsacError", "DeadlineExceeded", "EngineBusy", "EngineError", "ProtocolError", "Refused", "SpecMismatch", *_LAZY]


def __getattr__(name: str):
    if name not in _LAZY:
        raise AttributeError(f"module 'consac' has no attribute {name!r}")
    import importlib

    module = importlib.import_module(f".{_LAZY[name]}", __name__)
    return module if name == _LAZY[name] else getattr(module, name)
