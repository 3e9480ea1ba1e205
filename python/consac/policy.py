"""A trained policy from a `.consac` model file, with numpy: `load_policy("model.consac").act(observation)`.

spec/model_file.md is the law. Nothing in a file is executed; damaged, cut and foreign files are refused.
"""
from __future__ import annotations

import hashlib
import json
import math
import struct
from dataclasses import dataclass, field

import numpy as np
from gymnasium import spaces

from consac import wire
from consac.errors import ConsacError

VERSION = 1
LARGEST_HEADER = 100_000_000
LARGEST_LAYER = 1 << 20  # as in the C++ reader
DEEPEST_HEADER = 8
MASKED = -1e8  # the logit of a choice that is not legal
HEADS = {"categorical", "gaussian", "bernoulli"}
OPS = {"dense"}


class ModelError(ConsacError, ValueError):
    """A model file that cannot be used; says why in one line."""


class ModelDamaged(ModelError):
    """Cut, changed, inconsistent, or its own self-test fails."""


class ModelForeign(ModelError):
    """Something else than a CONSAC policy."""


class ModelTooNew(ModelError):
    """Needs what this program does not know."""


class ModelMisfit(ModelError):
    """The observation or the mask does not fit the policy's spaces."""


ACTIVATIONS = {
    "linear": lambda x: x,
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0),
    "sigmoid": lambda x: _sigmoid(x),
    "elu": lambda x: np.where(x > 0, x, np.expm1(np.minimum(x, 0))),
    "leaky_relu": lambda x: np.where(x > 0, x, 0.01 * x),
    "silu": lambda x: x * _sigmoid(x),
    "softplus": lambda x: np.maximum(x, 0) + np.log1p(np.exp(-np.abs(x))),
}


def _sigmoid(x):
    small = np.exp(-np.abs(x))
    return np.where(x >= 0, 1, small) / (1 + small)


@dataclass
class ModelFile:
    """A `.consac` container: its specification and its tensors."""

    spec: dict
    tensors: dict[str, np.ndarray] = field(repr=False)


@dataclass
class Dense:
    """One block: `target` = act(weights `source` + bias)."""

    source: str
    target: str
    weights: np.ndarray  # [out, in]
    bias: np.ndarray  # [out]
    activation: str


def read_model(data: bytes) -> ModelFile:
    """The container in `data`, checked as spec/model_file.md says."""
    if len(data) < 8:
        raise ModelDamaged(f"not a usable model file: it has only {len(data)} bytes")
    size = struct.unpack_from("<Q", data)[0]
    if size > LARGEST_HEADER or size > len(data) - 8:
        if all(byte >= 9 for byte in data[:8]):
            raise ModelForeign(f"this is no .consac file: it begins {data[:8]!r}")
        raise ModelDamaged(f"not a usable model file: its header claims {size} bytes of a file of {len(data)}")
    header = _header(data[8:8 + size])
    body = memoryview(data)[8 + size:]
    metadata = header.pop("__metadata__", None)
    if not isinstance(metadata, dict) or not all(isinstance(value, str) for value in metadata.values()):
        raise ModelForeign("a safetensors file without CONSAC's metadata; convert it first")
    if metadata.get("format") != "consac":
        raise ModelForeign(f"a safetensors file of format {metadata.get('format')!r}, not 'consac'")
    version = metadata.get("consac.version", "")
    if not (version.isascii() and version.isdigit() and len(version) < 10 and int(version) >= 1):
        raise ModelDamaged(f"its version {version!r} is no number from 1")
    if int(version) > VERSION:
        raise ModelTooNew(f"it has format version {version}, this program reads up to {VERSION}; use a newer consac")
    tensors = _tensors(header, body)
    spec = metadata.get("consac.spec", "")
    try:
        text = spec.encode()
    except UnicodeEncodeError:
        raise ModelDamaged("not a usable model file: its specification is no UTF-8") from None
    digest = hashlib.sha256(text)
    digest.update(body)
    if digest.hexdigest() != metadata.get("consac.sha256"):
        raise ModelDamaged("not a usable model file: its SHA-256 does not match; the file is damaged")
    try:
        return ModelFile(wire.load_json(text) if len(text) <= wire.LARGEST_JSON else _json(text), tensors)
    except wire.WireError as error:
        raise ModelDamaged(f"the model's specification is no JSON object: {error.message}") from None


def _header(text: bytes) -> dict:
    if not text.startswith(b"{"):
        raise ModelDamaged("not a usable model file: its header is no JSON object")
    header = _json(text)
    if not _shallow(header, DEEPEST_HEADER):
        raise ModelDamaged("not a usable model file: its header is nested too deep")
    return header


def _json(text: bytes) -> dict:
    def no_twice(pairs):
        if len({key for key, _ in pairs}) != len(pairs):
            raise ModelDamaged("not a usable model file: a key of its header stands twice")
        return dict(pairs)

    try:
        value = json.loads(text.decode(), object_pairs_hook=no_twice)
    except (ValueError, RecursionError) as error:
        if isinstance(error, ModelError):
            raise
        raise ModelDamaged(f"not a usable model file: its header cannot be read: {str(error)[:120]}") from None
    if not isinstance(value, dict):
        raise ModelDamaged("not a usable model file: its header is no JSON object")
    return value


def _shallow(value, levels: int) -> bool:
    below = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return levels >= 0 and all(_shallow(item, levels - 1) for item in below)


def _count(value) -> bool:
    return type(value) is int and 0 <= value < 1 << 62


def _tensors(header: dict, body) -> dict[str, np.ndarray]:
    places = []
    for name, entry in header.items():
        dtype, shape, offsets = (entry.get(key) for key in ("dtype", "shape", "data_offsets")) if isinstance(entry, dict) else (None, None, None)
        if not isinstance(dtype, str) or dtype not in wire.DTYPES:
            raise ModelDamaged(f"not a usable model file: tensor {name!r} has dtype {dtype!r}, which is not known")
        if not isinstance(shape, list) or len(shape) > 16 or not all(map(_count, shape)):
            raise ModelDamaged(f"not a usable model file: tensor {name!r} has an impossible size")
        if not isinstance(offsets, list) or len(offsets) != 2 or not all(map(_count, offsets)):
            raise ModelDamaged(f"not a usable model file: tensor {name!r} has no usable data_offsets")
        needed = math.prod(shape) * np.dtype(wire.DTYPES[dtype]).itemsize
        if offsets[1] - offsets[0] != needed:
            raise ModelDamaged(f"not a usable model file: tensor {name!r} has {offsets[1] - offsets[0]} bytes, its shape needs {needed}")
        places.append((*offsets, name, dtype, shape))
    at, tensors = 0, {}
    for begin, end, name, dtype, shape in sorted(places):
        if begin != at:
            raise ModelDamaged(f"not a usable model file: tensor {name!r} begins at byte {begin}, expected {at}")
        at = end
    if at != len(body):
        raise ModelDamaged(f"not a usable model file: it has {len(body)} bytes of data, its tensors need {at}")
    for begin, end, name, dtype, shape in places:
        tensors[name] = np.frombuffer(body[begin:end], np.dtype(wire.DTYPES[dtype]).newbyteorder("<")).reshape(shape)
    return tensors


class Policy:
    """Acts as the trained agent. `observation_space` and `action_space` are Gymnasium spaces; `spec` is all the file says."""

    def __init__(self, file: ModelFile):
        self.spec, self._tensors = file.spec, file.tensors
        interface = _check_kind(self.spec)
        self.behaviour = interface.get("behaviour", "default")
        self.observation_space, self.action_space = (_space(interface, name) for name in ("observation", "action"))
        self._observation, self._action = wire.Layout.of(self.observation_space), wire.Layout.of(self.action_space)
        self.features = sum(_features(leaf) for leaf in self._observation.leaves)
        self._heads = [_features(leaf) for leaf in self._action.leaves]
        self._check_heads(interface.get("heads"))
        self._input, self._blocks, self._output = self._graph(self.spec.get("graph"))
        deviations = sum(size for leaf, size in zip(self._action.leaves, self._heads) if isinstance(leaf.space, spaces.Box))
        self._log_std = self._floats("pi/log_std", (deviations,)) if deviations else np.zeros(0, np.float32)
        self._normaliser = self._read_normaliser(interface.get("normalise"))
        self._run_self_test(self.spec.get("selftest"))
        self._rng = np.random.default_rng()

    def __repr__(self) -> str:
        return f"Policy({self.observation_space} -> {self.action_space})"

    # -- use

    def logits(self, observation, mask=None) -> np.ndarray:
        """What the network says, leaf by leaf: logits, for a box means. [head] for one observation, [rows, head] for many."""
        features, single = self._flatten(observation)
        head = self._mask_logits(self._run(features).astype(np.float32), self._mask_rows(mask, len(features)))
        return head[0] if single else head

    def act(self, observation, deterministic: bool = True, mask=None, rng: np.random.Generator | None = None):
        """The action for one observation, or the batched actions for many; drawn with `rng` unless deterministic."""
        features, single = self._flatten(observation)
        head = self._mask_logits(self._run(features).astype(np.float32), self._mask_rows(mask, len(features)))
        rng = None if deterministic else self._rng if rng is None else rng
        parts, at, deviation = [], 0, 0
        for leaf, size in zip(self._action.leaves, self._heads):
            part, space = head[:, at:at + size], leaf.space
            at += size
            if isinstance(space, spaces.Box):
                value = part
                if rng is not None:
                    value = part + np.exp(self._log_std[deviation:deviation + size]) * rng.standard_normal(part.shape)
                deviation += size
                value = np.clip(value.reshape(len(part), *leaf.shape), space.low, space.high)
            elif isinstance(space, spaces.MultiBinary):
                likely = _sigmoid(part.astype(np.float64))
                value = (likely > 0.5 if rng is None else rng.random(part.shape) < likely).reshape(len(part), *leaf.shape)
            elif isinstance(space, spaces.Discrete):
                value = _choose(part, rng) + space.start
            else:
                ends = np.cumsum(np.ravel(space.nvec))
                value = np.stack([_choose(part[:, end - n:end], rng) for end, n in zip(ends, np.ravel(space.nvec))], 1).reshape(len(part), *leaf.shape)
            value = value.astype(space.dtype)
            parts.append(value[0] if single else value)
        return self._action.build(parts)

    def flatten(self, observation) -> np.ndarray:
        """The network's input before it is normalised, as gymnasium.spaces.flatten has it."""
        features, single = self._flatten(observation)
        return features[0] if single else features

    def _flatten(self, observation) -> tuple[np.ndarray, bool]:
        pieces, single = [], None
        for leaf in self._observation.leaves:
            space = leaf.space
            try:
                part = np.asarray(self._observation.pick(observation, leaf))
                numeric = part.dtype.kind in "buif"
            except (KeyError, IndexError, TypeError, ValueError):
                raise ModelMisfit(f"an observation without {'/'.join(map(str, leaf.path)) or 'numbers'}; expected {self.observation_space}") from None
            alone = part.shape == leaf.shape
            if not numeric or not alone and part.shape[1:] != leaf.shape or part.ndim - len(leaf.shape) not in (0, 1) or single not in (None, alone):
                place = f" at {'/'.join(map(str, leaf.path))}" if leaf.path else ""
                raise ModelMisfit(f"an observation of shape {part.shape} and type {part.dtype}{place}; expected {space}, one or many")
            single = alone
            rows = (part[None] if alone else part).reshape(1 if alone else len(part), -1)
            if isinstance(space, (spaces.Discrete, spaces.MultiDiscrete)):
                choices = [int(space.n)] if isinstance(space, spaces.Discrete) else [int(n) for n in np.ravel(space.nvec)]
                start = int(space.start) if isinstance(space, spaces.Discrete) else 0
                for column, n in zip(rows.T, choices):
                    legal = (column >= start) & (column < start + n) & (column == np.floor(column))
                    if not legal.all():
                        raise ModelMisfit(f"an observation {column[~legal][0]} outside {space}")
                    hot = np.zeros((len(rows), n), np.float32)
                    hot[np.arange(len(rows)), column.astype(np.int64) - start] = 1
                    pieces.append(hot)
            else:
                pieces.append(rows.astype(np.float32))
        features = np.concatenate(pieces, 1)
        if not np.isfinite(features).all():
            raise ModelMisfit("an observation with NaN or infinity; a policy takes finite numbers")
        return features, bool(single)

    def _run(self, features: np.ndarray) -> np.ndarray:
        if self._normaliser is not None:
            mean, scale, clip = self._normaliser
            features = np.clip((features - mean) * scale, -clip, clip)
        named = {self._input: features.astype(np.float64)}
        with np.errstate(over="ignore", invalid="ignore"):
            for block in self._blocks:
                named[block.target] = ACTIVATIONS[block.activation](named[block.source] @ block.weights.T + block.bias)
        return named[self._output]

    def _mask_rows(self, mask, rows: int) -> np.ndarray | None:
        if mask is None:
            return None
        if isinstance(mask, (tuple, list)) and mask and isinstance(mask[0], np.ndarray):
            mask = np.concatenate([np.asarray(part).reshape(rows, -1) if rows > 1 else np.ravel(part)[None] for part in mask], 1)
        flat = np.asarray(mask)
        if flat.size != rows * self._action.mask_bytes or flat.size == 0 or flat.dtype.kind not in "bui":
            raise ModelMisfit(f"a mask of shape {flat.shape} for {rows} observations; expected {self._action.mask_bytes} choices each, 1 where legal")
        return flat.reshape(rows, -1) != 0

    def _mask_logits(self, head: np.ndarray, mask: np.ndarray | None) -> np.ndarray:
        if mask is None:
            return head
        at = seen = 0
        for leaf, size in zip(self._action.leaves, self._heads):
            part, space = head[:, at:at + size], leaf.space
            at += size
            if isinstance(space, spaces.Box):
                continue
            choices = [int(space.n)] if isinstance(space, spaces.Discrete) else [2] * size if isinstance(space, spaces.MultiBinary) else [int(n) for n in np.ravel(space.nvec)]
            legal = mask[:, seen:seen + sum(choices)]
            seen += sum(choices)
            ends = np.cumsum(choices)
            if not all(legal[:, end - n:end].any(1).all() for end, n in zip(ends, choices)):
                raise ModelMisfit("a mask without any legal choice; at least one of each is legal")
            if isinstance(space, spaces.MultiBinary):
                part[~legal[:, 0::2]] = -MASKED
                part[~legal[:, 1::2]] = MASKED
            else:
                part[~legal] = MASKED
        return head

    # -- reading

    def _floats(self, name: str, shape: tuple) -> np.ndarray:
        tensor = self._tensors.get(name)
        if tensor is None:
            raise ModelDamaged(f"the model lacks the tensor {name!r}")
        if tensor.dtype != np.float32 or tensor.shape != shape:
            raise ModelDamaged(f"the model's tensor {name!r} is {tensor.dtype} of shape {list(tensor.shape)}, expected float32 of {list(shape)}")
        if not np.isfinite(tensor).all():
            raise ModelDamaged(f"the model's tensor {name!r} has NaN or infinity; do not use it")
        return tensor

    def _check_heads(self, heads) -> None:
        kinds = {spaces.Box: "gaussian", spaces.MultiBinary: "bernoulli", spaces.Discrete: "categorical", spaces.MultiDiscrete: "categorical"}
        expected = [("/".join(map(str, leaf.path)), kinds[type(leaf.space)]) for leaf in self._action.leaves]
        found = [(head.get("leaf"), head.get("type")) for head in heads if isinstance(head, dict)] if isinstance(heads, list) else []
        if found != expected:
            raise ModelDamaged(f"the model's heads are {found}, its action space needs {expected}")

    def _graph(self, graph) -> tuple[str, list[Dense], str]:
        inputs, blocks, outputs = (graph.get(key) for key in ("inputs", "blocks", "outputs")) if isinstance(graph, dict) else (None, None, None)
        well_formed = isinstance(inputs, list) and isinstance(blocks, list) and isinstance(outputs, list) and outputs and all(isinstance(piece, dict) for piece in inputs + blocks)
        if not well_formed or len(inputs) != 1 or inputs[0].get("size") != self.features or not isinstance(inputs[0].get("name"), str):
            raise ModelDamaged(f"the model's graph must have blocks, outputs and one input of {self.features} features")
        sizes, dense = {inputs[0]["name"]: self.features}, []
        for entry in blocks:
            source, target, name, activation = (entry.get(key) for key in ("in", "out", "name", "act"))
            if not all(isinstance(text, str) for text in (source, target, name)) or entry.get("op") not in OPS or activation not in ACTIVATIONS:
                raise ModelDamaged(f"the model's block {name!r} has op {entry.get('op')!r} and activation {activation!r}; known are {sorted(OPS)} and {sorted(ACTIVATIONS)}")
            in_size, out_size = entry.get("in_size"), entry.get("out_size")
            if sizes.get(source) != in_size or target in sizes or not _count(out_size) or not 1 <= out_size <= LARGEST_LAYER:
                raise ModelDamaged(f"the model's block {name!r} goes from {source!r} ({in_size}) to {target!r} ({out_size}), which does not fit the blocks before it")
            sizes[target] = out_size
            weights, bias = self._floats(f"{name}/w", (out_size, in_size)), self._floats(f"{name}/b", (out_size,))
            dense.append(Dense(source, target, weights.astype(np.float64), bias.astype(np.float64), activation))
        if not all(isinstance(output, str) and output in sizes for output in outputs) or sizes[outputs[0]] != sum(self._heads):
            raise ModelDamaged(f"the model's outputs {outputs} must be blocks' outs, and the first must have {sum(self._heads)} numbers")
        needed, used = {outputs[0]}, []
        for block in reversed(dense):
            if block.target in needed:
                needed.add(block.source)
                used.insert(0, block)
        return inputs[0]["name"], used, outputs[0]

    def _read_normaliser(self, normalise):
        if normalise is None:
            return None
        if not isinstance(normalise, dict) or type(normalise.get("clip")) not in (int, float) or not 0 < normalise["clip"] < math.inf:
            raise ModelDamaged("the model's normaliser needs mean, scale and a clip above 0")
        mean, scale = (self._floats(str(normalise.get(key)), (self.features,)) for key in ("mean", "scale"))
        return mean, scale, np.float32(normalise["clip"])

    def _run_self_test(self, pairs) -> None:
        if not isinstance(pairs, list) or not pairs:
            raise ModelDamaged("the model has no self-test")
        self.selftest_error = 0.0
        for pair in pairs:
            if not isinstance(pair, dict) or type(pair.get("tol")) not in (int, float) or not 0 <= pair["tol"] < math.inf:
                raise ModelDamaged("the model's self-test has no tolerance")
            asked, expected = self._tensors.get(str(pair.get("in"))), self._tensors.get(str(pair.get("out")))
            rows = len(asked) if asked is not None and asked.ndim == 2 else 0
            if rows == 0 or expected is None:
                raise ModelDamaged(f"the model's self-test names tensors that are empty or not there: {pair.get('in')!r}, {pair.get('out')!r}")
            asked, expected = self._floats(pair["in"], (rows, self.features)), self._floats(pair["out"], (rows, sum(self._heads)))
            error = np.abs(self._run(asked).astype(np.float32).astype(np.float64) - expected)
            if not np.all(error <= pair["tol"] * (1 + np.abs(expected).max())):
                raise ModelDamaged(f"the model fails its own self-test {pair['out']!r} by {error.max():g}; do not use it")
            self.selftest_error = max(self.selftest_error, float(error.max()))


def _check_kind(spec: dict) -> dict:
    if spec.get("kind") != "policy":
        raise ModelForeign(f"this is a {spec.get('kind')!r}, not a 'policy'; only the program that wrote it can use it")
    required = spec.get("requires", [])
    if not isinstance(required, list):
        raise ModelDamaged("the model's `requires` is no list")
    for feature in required:
        if not isinstance(feature, str) or feature not in OPS | HEADS:
            raise ModelTooNew(f"the model requires {feature!r}, which this program does not know; use a newer consac")
    if not isinstance(spec.get("interface"), dict):
        raise ModelDamaged("the model's specification has no interface")
    return spec["interface"]


def _space(interface: dict, name: str) -> spaces.Space:
    value = interface.get(name)
    try:
        if _elements(value) > LARGEST_LAYER:
            raise ModelDamaged(f"the model's {name} space has over {LARGEST_LAYER} elements")
        return wire.space_from_json(value)
    except ModelError:
        raise
    except Exception as error:
        raise ModelDamaged(f"the model's {name} space cannot be read: {type(error).__name__}: {str(error)[:120]}") from None


def _elements(value: dict) -> int:
    """How many numbers a space has once it is flat, before anything of that size is made."""
    kind = value["type"]
    sizes = value["shape"] if kind == "box" else [value["n"]] if kind in ("discrete", "multi_binary") else value["nvec"] if kind == "multi_discrete" else []
    if not all(map(_count, sizes)) or not all(map(_count, value.get("shape", []))):
        raise ValueError("a size that is no whole number from 0")
    if kind in ("dict", "tuple"):
        return sum(_elements(child["space"]) for child in value["spaces"])
    return max(sum(sizes) if kind == "multi_discrete" else math.prod(sizes), math.prod(value.get("shape", [])))


def _features(leaf: wire.Leaf) -> int:
    if isinstance(leaf.space, spaces.Discrete):
        return int(leaf.space.n)
    return int(leaf.space.nvec.sum()) if isinstance(leaf.space, spaces.MultiDiscrete) else math.prod(leaf.shape)


def _choose(logits: np.ndarray, rng: np.random.Generator | None) -> np.ndarray:
    """The most likely choice of each row, or one drawn."""
    if rng is None:
        return logits.argmax(1)
    weights = np.exp(logits.astype(np.float64) - logits.max(1, keepdims=True))
    ends = np.cumsum(weights, 1)
    return (rng.random((len(logits), 1)) * ends[:, -1:] >= ends).sum(1)


def load_policy(path) -> Policy:
    """The policy in the file at `path`; ModelError says in one line why it cannot be used."""
    with open(path, "rb") as file:
        data = file.read()
    try:
        return Policy(read_model(data))
    except ModelError as error:
        raise type(error)(f"'{path}': {error}") from None
