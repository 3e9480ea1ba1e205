"""The engine side of protocol 2 in Python: any Gymnasium or PettingZoo environment, served to trainers.

    python -m consac.serve CartPole-v1 --envs 8 --port 5005

Every session has environments of its own and a thread of its own. spec/protocol2.md and spec/text1.md are the law.
"""
from .limits import Limits
from .refusal import Refused
from .server import Server

__all__ = ["Limits", "Refused", "Server"]
