"""What several tests of the client say to an engine."""
import numpy as np

import consac
from consac import wire


def play(url, steps=3, **options):
    """Observations and rewards of a few steps."""
    env = consac.make(url, protocol=2, **options)
    try:
        seen = [env.reset(seed=5)[0]]
        for step in range(steps):
            observation, reward, *_ = env.step(step % 2)
            seen += [observation, reward]
        return np.concatenate([np.ravel(part) for part in seen])
    finally:
        env.close()


def frame(kind, payload=b"", request=3, **options):
    return wire.pack(wire.Frame(kind, payload, request, **options))


def box(shape, dtype="F32"):
    return {"type": "box", "shape": shape, "dtype": dtype, "low": 0, "high": 1}
