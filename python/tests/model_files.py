"""A writer of model files, so that the reader is not tested with itself, and what the program trains for the tests."""
import hashlib
import json
import struct

import gymnasium
import numpy as np
from gymnasium import spaces

from consac import wire
from consac.layout import Layout, space_to_json
from consac.policy import ACTIVATIONS, Policy, read_model

TRAINED = {"road-v0": [], "cartpole-v1": ["net_arch=[dict(pi=[8], vf=[8])]"], "pendulum-v1": ["norm_obs=true"], "maze-v0": ["act_fun=relu"], "reach3-v0": ["norm_obs=true"],
           "pixel-catch-v0": ["algorithm=dqn", "policy=LnCnnPolicy", "dueling=true", "buffer_size=2000"], "identity-multibinary-v0": []}
KEYS = spaces.Dict({"b": spaces.Box(-1, 1, (2, 2), np.float32), "a": spaces.Discrete(3, start=-1),
                    "t": spaces.Tuple([spaces.MultiDiscrete([2, 3]), spaces.MultiBinary(3), spaces.Box(0, 255, (3,), np.uint8)])})

ACTIONS = spaces.Dict({"jump": spaces.Discrete(2, start=1), "keys": spaces.MultiDiscrete([3, 2]), "lamps": spaces.MultiBinary(2), "move": spaces.Box(-0.5, 0.5, (2,), np.float32)})


def model_bytes(spec, tensors, **metadata):
    header, data = {}, b""
    for name in sorted(tensors):
        piece = tensors[name].tobytes()
        header[name] = {"dtype": wire.NAMES[tensors[name].dtype], "shape": list(tensors[name].shape), "data_offsets": [len(data), len(data) + len(piece)]}
        data += piece
    text = spec if isinstance(spec, str) else json.dumps(spec)
    header["__metadata__"] = {"format": "consac", "consac.version": "1", "consac.spec": text, "consac.sha256": hashlib.sha256(text.encode() + data).hexdigest()} | metadata
    raw = json.dumps(header).encode()
    raw += b" " * (-len(raw) % 8)
    return struct.pack("<Q", len(raw)) + raw + data


def features_of(space):
    return gymnasium.spaces.utils.flatdim(space)


def listed(space):
    """A space's JSON with every bound of a box written out, as spec/model_file.md has it."""
    value = space_to_json(space)
    boxes = [value]
    for box in boxes:
        boxes += [child["space"] for child in box.get("spaces", [])]
        if box["type"] == "box":
            count = int(np.prod(box["shape"]))
            box.update({side: box[side] if isinstance(box[side], list) else [box[side]] * count for side in ("low", "high")})
    return value


def head_name(space):
    return "gaussian" if isinstance(space, spaces.Box) else "bernoulli" if isinstance(space, spaces.MultiBinary) else "categorical"


def make(observation=spaces.Box(-1, 1, (3,), np.float32), action=spaces.Discrete(3), activations=("tanh",), normalise=False, seed=1):
    """Specification and tensors of a random policy; the self-test's answers come from the formulas of spec/model_file.md."""
    rng = np.random.default_rng(seed)
    size, outputs = features_of(observation), features_of(action)
    tensors, blocks, source, width = {}, [], "obs", size
    for index, activation in enumerate((*activations, "linear")):
        out = outputs if index == len(activations) else 5
        name = f"pi/{index}"
        tensors[f"{name}/w"], tensors[f"{name}/b"] = rng.normal(size=(out, width)).astype(np.float32), rng.normal(size=out).astype(np.float32)
        blocks.append({"op": "dense", "in": source, "out": name, "name": name, "in_size": width, "out_size": out, "act": activation})
        source, width = name, out
    leaves = Layout.of(action).leaves
    deviations = sum(int(np.prod(leaf.shape)) for leaf in leaves if isinstance(leaf.space, spaces.Box))
    if deviations:
        tensors["pi/log_std"] = rng.normal(size=deviations).astype(np.float32)
    interface = {"behaviour": "default", "observation": listed(observation), "action": listed(action),
                 "heads": [{"leaf": "/".join(map(str, leaf.path)), "type": head_name(leaf.space)} for leaf in leaves]}
    asked = rng.normal(size=(4, size)).astype(np.float32) * 2
    x = asked.astype(np.float64)
    if normalise:
        tensors["norm/obs/mean"], tensors["norm/obs/scale"] = rng.normal(size=size).astype(np.float32), rng.uniform(0.5, 2, size).astype(np.float32)
        interface["normalise"] = {"mean": "norm/obs/mean", "scale": "norm/obs/scale", "clip": 1.5}
        x = np.clip((x - tensors["norm/obs/mean"]) * tensors["norm/obs/scale"], -1.5, 1.5)
    plain = {"linear": lambda v: v, "tanh": np.tanh, "relu": lambda v: v * (v > 0), "sigmoid": lambda v: 1 / (1 + np.exp(-v)), "elu": lambda v: np.where(v > 0, v, np.exp(v) - 1),
             "leaky_relu": lambda v: np.where(v > 0, v, 0.01 * v), "silu": lambda v: v / (1 + np.exp(-v)), "softplus": lambda v: np.log(1 + np.exp(v))}
    for block in blocks:
        x = plain[block["act"]](x @ tensors[f"{block['name']}/w"].T + tensors[f"{block['name']}/b"])
    tensors["test/0/in"], tensors["test/0/out"] = asked, x.astype(np.float32)
    spec = {"kind": "policy", "requires": sorted({"dense"} | {head_name(leaf.space) for leaf in leaves}), "producer": {"name": "test", "version": "1"}, "interface": interface,
            "graph": {"inputs": [{"name": "obs", "size": size}], "blocks": blocks, "outputs": [source]}, "selftest": [{"in": "test/0/in", "out": "test/0/out", "tol": 1e-5}]}
    return spec, tensors


def policy_of(*arguments, **named):
    return Policy(read_model(model_bytes(*make(*arguments, **named))))

MODELS = {"all activations": dict(activations=tuple(ACTIVATIONS)), "nested": dict(observation=KEYS, action=ACTIONS, normalise=True),
          "discrete": dict(observation=spaces.Discrete(4, start=2), action=spaces.MultiDiscrete([2, 3])), "bits": dict(observation=spaces.MultiBinary(3), action=spaces.MultiBinary(2)),
          "image": dict(observation=spaces.Box(0, 255, (4, 4, 3), np.uint8), action=spaces.Box(-1, 1, (2,), np.float32))}
