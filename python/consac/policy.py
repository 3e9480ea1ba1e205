"""A trained policy from a `.consac` model file or a run's folder, with numpy: `load_policy("runs/first").act(observation)`.

spec/model_file.md is the law; model_file.py reads the bytes.
"""
from __future__ import annotations

import math
import os
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from consac.layout import Layout, Leaf, numbers_in, space_from_json
from consac.model_file import Array, ModelDamaged, ModelError, ModelFile, ModelForeign, ModelMisfit, ModelTooNew, read_model
from consac.names import check_name, quote
from consac.native import NativeModel, load_model
from consac.network import ACTIVATIONS, LARGEST_LAYER, OPS, Memory, Network, sigmoid
from consac.spec_check import check_space

MOST_SLOTS = 1 << 20  # agents that a model remembers for
MASKED = -1e8  # the logit of a choice that is not legal
# Each kind of head, and the spaces of the leaves that it can be of; the first that fits is a leaf's own where the model names none.
HEADS = {"categorical": (spaces.Discrete, spaces.MultiDiscrete), "gaussian": (spaces.Box,), "bernoulli": (spaces.MultiBinary,),
         "q_values": (spaces.Discrete,), "squashed_gaussian": (spaces.Box,), "deterministic": (spaces.Box,),
         "sde_gaussian": (spaces.Box,), "squashed_sde_gaussian": (spaces.Box,)}
BOUNDED = ("squashed_gaussian", "deterministic", "squashed_sde_gaussian")
LARGEST_EXPLORATION = 1 << 20  # numbers of an agent's matrices
FEATURES = OPS.keys() | HEADS.keys() | {"shared_parameters"}


@dataclass(frozen=True)
class StateNoise:
    """How a head's noise follows the state (gSDE): phi W, with phi the last hidden layer's numbers and a matrix W of each agent."""
    features: int
    full_std: bool = True
    use_expln: bool = False
    clip_mean: float = 0.0
    sample_freq: int = -1

    @classmethod
    def read(cls, head: dict[str, Any]) -> StateNoise:
        given = {field.name: head[field.name] for field in fields(cls) if head.get(field.name) is not None}
        kinds = {"features": (int,), "full_std": (bool,), "use_expln": (bool,), "clip_mean": (int, float), "sample_freq": (int,)}
        if not all(type(value) in kinds[name] for name, value in given.items()) or not 1 <= given.get("features", 0) <= LARGEST_EXPLORATION or not 0 <= given.get("clip_mean", 0) < math.inf:
            raise ModelDamaged(f"the model's head {quote(repr(head), 160)} has no usable features, full_std, use_expln, clip_mean and sample_freq")
        return cls(**given)

    def log_stds(self, size: int) -> int:
        return self.features * (size if self.full_std else 1)

    def draw(self, log_std: Array, size: int, rng: np.random.Generator) -> Array:
        """[features, size] numbers of the deviations that the model has learned."""
        own = log_std.astype(np.float64).reshape(self.features, -1)
        deviation = np.where(own > 0, np.log1p(np.maximum(own, 0) + 1e-6) + 1, np.exp(np.minimum(own, 0))) if self.use_expln else np.exp(own)
        return deviation * rng.standard_normal((self.features, size))


class Policy:
    """Acts as the trained agent. `observation_space` and `action_space` are Gymnasium spaces; `spec` is all the file says."""

    def __init__(self, file: ModelFile, native: NativeModel | None = None) -> None:
        """`native`: the same model in C++, which then does what need not be drawn or remembered."""
        self.spec, self._tensors = file.spec, file.tensors
        interface = _check_kind(self.spec)
        try:
            self.behaviour = check_name("behaviour", interface.get("behaviour", "default"))
        except ValueError as error:
            raise ModelDamaged(str(error)) from None
        self.observation_space, self.action_space = (_space(interface, name) for name in ("observation", "action"))
        self._observation, self._action = Layout.of(self.observation_space), Layout.of(self.action_space)
        self._masked = [choices for leaf in self._action.leaves for choices in _masked(leaf.space)]
        self.features = sum(_features(leaf) for leaf in self._observation.leaves)
        self.heads = self._read_heads(interface.get("heads"))
        self._heads = [_features(leaf) * (2 if kind == "squashed_gaussian" else 1) for leaf, kind in zip(self._action.leaves, self.heads)]
        self._noises = self._read_noises(interface.get("heads"))
        self._hidden = next((noise.features for noise in self._noises if noise), 0)
        self._network = Network(self.spec.get("graph"), self.features, self._floats)
        if self._network.size != sum(self._heads) + self._hidden:
            raise ModelDamaged(f"the model's first output has {self._network.size} numbers, its heads need {sum(self._heads) + self._hidden}")
        self._deviations = [size if kind == "gaussian" else noise.log_stds(size) if noise else 0 for kind, size, noise in zip(self.heads, self._heads, self._noises)]
        deviations = sum(self._deviations)
        self._log_std = self._floats("pi/log_std", (deviations,)) if deviations else np.zeros(0, np.float32)
        self._normaliser = self._read_normaliser(interface.get("normalise"))
        self._run_self_test(self.spec.get("selftest"))
        self._rng = np.random.default_rng()
        self._memory = Memory() if self._network.remembers else None
        self._matrices: dict[int, tuple[list[Any], int]] = {}  # by agent: what it explores by, and for how many actions yet (-1: its episode)
        self._native = native if self._memory is None else None

    def __repr__(self) -> str:
        return f"Policy({self.observation_space} -> {self.action_space})"

    # -- use

    def logits(self, observation: Any, mask: Any = None) -> Array:
        """What the network says, leaf by leaf: logits, values of choices, for a box means. [head] for one observation, [rows, head] for many.
        Of a model that remembers: at an episode's beginning."""
        features, single = self._flatten(observation)
        head = self._mask_logits(self._run(features).astype(np.float32), self._mask_rows(mask, len(features)))[:, :sum(self._heads)]
        return head[0] if single else head

    @property
    def backend(self) -> str:
        """What acts: "native", the library of consac.h, or "numpy". Actions that are drawn, and those of a model that remembers, are numpy's in any case."""
        return "numpy" if self._native is None else "native"

    @property
    def recurrent(self) -> bool:
        """Whether it remembers: what it does depends on what an agent saw before."""
        return self._memory is not None

    def act(self, observation: Any, deterministic: bool = True, mask: Any = None, rng: np.random.Generator | None = None, *, slots: Any = None, begins: Any = None) -> Any:
        """The action for one observation, or the batched actions for many; drawn with `rng` unless deterministic. Of values of choices the best is taken.

        For models that remember, and for draws of one that explores by noise that follows the state: `slots` says which agent each observation is of (whole numbers from 0, each once; its place unless given), and
        `begins` is true where that agent's episode begins (nowhere unless given; an agent that has not acted yet begins by itself).
        """
        if not isinstance(deterministic, (bool, np.bool_)):
            raise TypeError(f"deterministic is True or False, not a {type(deterministic).__name__}; a mask is given as mask=...")
        parts, single = self._parts(observation)
        rows = len(parts[0])
        mask = self._mask_rows(mask, rows)
        if self._native is not None and deterministic and slots is None and begins is None and self._holds(parts):
            return self._act_native(self._native, parts, single, mask)
        whose = self._rows_of(slots, begins, rows)
        features = self._encode(parts)
        if self._memory is not None:
            self._memory.begin_step(*whose)
        head = self._mask_logits(self._run(features, self._memory).astype(np.float32), mask)
        rng = None if deterministic else self._rng if rng is None else rng
        matrices = self._explore(*whose, rng) if self._hidden and rng is not None else None
        done, at, deviation = [], 0, 0
        for index, (leaf, kind, size, noise) in enumerate(zip(self._action.leaves, self.heads, self._heads, self._noises)):
            part: Array = head[:, at:at + size]
            space: Any = leaf.space
            value: Any
            at += size
            if noise is not None:
                value = part.astype(np.float64) if noise.clip_mean == 0 else np.clip(part.astype(np.float64), -noise.clip_mean, noise.clip_mean)
                if matrices is not None:
                    value = value + np.einsum("rl,rla->ra", head[:, -self._hidden:].astype(np.float64), np.stack([of[index] for of in matrices]))
                deviation += self._deviations[index]
                value = _stretched(np.tanh(value), "deterministic", space, None) if kind == "squashed_sde_gaussian" else value
                value = np.clip(value.reshape(len(part), *leaf.shape), space.low, space.high)
            elif kind in BOUNDED:
                value = _stretched(part, kind, space, rng).reshape(len(part), *leaf.shape)
            elif isinstance(space, spaces.Box):
                value = part
                if rng is not None:
                    value = part + np.exp(self._log_std[deviation:deviation + size]) * rng.standard_normal(part.shape)
                deviation += size
                value = np.clip(value.reshape(len(part), *leaf.shape), space.low, space.high)
            elif isinstance(space, spaces.MultiBinary):
                likely = sigmoid(part.astype(np.float64))
                value = (likely > 0.5 if rng is None else rng.random(part.shape) < likely).reshape(len(part), *leaf.shape)
            elif isinstance(space, spaces.Discrete):
                value = _choose(part, None if kind == "q_values" else rng) + space.start
            else:
                ends = np.cumsum(np.ravel(space.nvec))
                value = np.stack([_choose(part[:, end - n:end], rng) for end, n in zip(ends, np.ravel(space.nvec))], 1).reshape(len(part), *leaf.shape)
            value = value.astype(space.dtype)
            done.append(value[0] if single else value)
        return self._action.build(done)

    def _explore(self, whose: Array, begun: Array, rng: np.random.Generator) -> list[list[Any]]:
        """The matrices that each row's agent explores by, drawn where they are due: at its first action, where its episode begins, and as often as the model says."""
        freq = next(noise.sample_freq for noise in self._noises if noise)
        found = []
        for slot, begins in zip(whose.tolist(), begun.tolist()):
            matrices, left = self._matrices.get(slot, (None, 0))
            if matrices is None or begins or left == 0:
                matrices, left, at = [], freq if freq > 0 else -1, 0
                for noise, size, count in zip(self._noises, self._heads, self._deviations):
                    matrices.append(None if noise is None else noise.draw(self._log_std[at:at + count], size, rng))
                    at += count
            self._matrices[slot] = matrices, left - 1 if left > 0 else left
            found.append(matrices)
        return found

    def predict(self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = False, action_masks: Any = None) -> tuple[Any, Any]:
        """As a model of Stable Baselines3, for `evaluate_policy` and whatever else takes one: the actions, and `state` as it was given (what a model
        remembers it keeps itself, row by row; `episode_start` says who begins anew)."""
        return self.act(observation, deterministic, action_masks, begins=episode_start if self.recurrent or (self._hidden and not deterministic) else None), state

    def _holds(self, parts: list[Array]) -> bool:
        """Whether a row can hold these numbers as they are: those of a leaf of bytes may come as anything."""
        for leaf, part in zip(self._observation.leaves, parts):
            if leaf.dtype.kind != "f" and not isinstance(leaf.space, (spaces.Discrete, spaces.MultiDiscrete)):
                least, most = (0, 1) if leaf.dtype.kind == "b" else (np.iinfo(leaf.dtype).min, np.iinfo(leaf.dtype).max)
                if part.dtype != leaf.dtype and (part.dtype.kind not in "biu" or part.min() < least or part.max() > most):
                    return False
        return True

    def _act_native(self, native: NativeModel, parts: list[Array], single: bool, mask: Array | None) -> Any:
        room = native.room(self._observation, self._action, len(parts[0]))
        for view, part in zip(room.seen, parts):
            view[...] = part.reshape(view.shape)
        legal = None if mask is None else mask.astype(np.uint8)
        room.mask(legal)
        try:
            native.act(room)
        except ValueError:
            raise ModelMisfit("an observation with NaN or infinity; a policy takes finite numbers") from None
        values = [view.astype(leaf.space.dtype) for view, leaf in zip(room.done, self._action.leaves)]
        return self._action.build([value[0] if single else value for value in values])

    def flatten(self, observation: Any) -> Array:
        """The network's input before it is normalised, as gymnasium.spaces.flatten has it."""
        features, single = self._flatten(observation)
        return features[0] if single else features

    def _flatten(self, observation: Any) -> tuple[Array, bool]:
        parts, single = self._parts(observation)
        return self._encode(parts), single

    def _parts(self, observation: Any) -> tuple[list[Array], bool]:
        """The numbers of each leaf, [rows, numbers], and whether it was one observation alone."""
        parts, single = [], None
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
            parts.append((part[None] if alone else part).reshape(1 if alone else len(part), math.prod(leaf.shape)))
            for column, n, start in zip(parts[-1].T, *_choices(space)):
                legal = (column >= start) & (column < start + n) & (column == np.floor(column))
                if not legal.all():
                    raise ModelMisfit(f"an observation {column[~legal][0]} outside {space}")
        return parts, bool(single)

    def _encode(self, parts: list[Array]) -> Array:
        """The numbers of leaves as the network's input, choices one-hot."""
        pieces = []
        for leaf, rows in zip(self._observation.leaves, parts):
            if isinstance(leaf.space, (spaces.Discrete, spaces.MultiDiscrete)):
                for column, n, start in zip(rows.T, *_choices(leaf.space)):
                    hot = np.zeros((len(rows), n), np.float32)
                    hot[np.arange(len(rows)), column.astype(np.int64) - start] = 1
                    pieces.append(hot)
            else:
                pieces.append(rows.astype(np.float32))
        features = np.concatenate(pieces, 1)
        if not np.isfinite(features).all():
            raise ModelMisfit("an observation with NaN or infinity; a policy takes finite numbers")
        return features

    def _run(self, features: Array, memory: Memory | None = None) -> Array:
        if self._normaliser is not None:
            mean, scale, clip = self._normaliser
            features = np.clip((features - mean) * scale, -clip, clip)
        return self._network(features, memory)

    @staticmethod
    def _rows_of(slots: Any, begins: Any, rows: int) -> tuple[Array, Array]:
        """Whose each row is, and whether its episode begins."""
        whose = np.arange(rows) if slots is None else np.asarray(slots).reshape(-1)
        if len(whose) != rows or whose.dtype.kind not in "iu" or len(np.unique(whose)) != rows or not np.all((whose >= 0) & (whose < MOST_SLOTS)):
            raise ModelMisfit(f"slots {quote(repr(slots), 80)}; expected one whole number from 0 below {MOST_SLOTS} for each of {rows} observations, none of them twice")
        begun = np.zeros(rows, bool) if begins is None else np.asarray(begins).reshape(-1)
        if len(begun) != rows or begun.dtype.kind not in "bui":
            raise ModelMisfit(f"begins {quote(repr(begins), 80)}; expected True or False for each of {rows} observations")
        return whose.astype(np.int64), begun != 0

    def _mask_rows(self, mask: Any, rows: int) -> Array | None:
        if mask is None:
            return None
        choices = self._action.mask_bytes
        expected = f"expected {choices} choices for each of {rows} observations, 1 where legal"
        try:
            if isinstance(mask, (tuple, list)) and mask and isinstance(mask[0], np.ndarray) and rows != 1:
                mask = np.concatenate([np.asarray(part).reshape(rows, -1) for part in mask], 1)
            if rows == 1 and (isinstance(mask, (dict, tuple)) or np.size(mask) != choices):
                mask = np.concatenate(_legal(self.action_space, mask))
            flat = np.asarray(mask)
        except (KeyError, IndexError, TypeError, ValueError):
            raise ModelMisfit(f"a mask that does not fit {self.action_space}; {expected}") from None
        if flat.size != rows * choices or choices == 0 or flat.dtype.kind not in "bui":
            raise ModelMisfit(f"a mask of shape {flat.shape} and type {flat.dtype}; {expected}")
        legal: Array = flat.reshape(rows, choices) != 0
        if not all(part.any(1).all() for part in np.split(legal, np.cumsum(self._masked)[:-1], 1)):
            raise ModelMisfit("a mask without any legal choice; at least one of each is legal")
        return legal

    def _mask_logits(self, head: Array, mask: Array | None) -> Array:
        if mask is None:
            return head
        at = seen = 0
        for leaf, size in zip(self._action.leaves, self._heads):
            part, space = head[:, at:at + size], leaf.space
            at += size
            if isinstance(space, spaces.Box):
                continue
            choices = sum(_masked(space))
            legal = mask[:, seen:seen + choices]
            seen += choices
            if isinstance(space, spaces.MultiBinary):
                part[~legal[:, 0::2]] = -MASKED
                part[~legal[:, 1::2]] = MASKED
            else:
                part[~legal] = MASKED
        return head

    # -- reading

    def _floats(self, name: str, shape: tuple[int, ...]) -> Array:
        tensor = self._tensors.get(name)
        if tensor is None:
            raise ModelDamaged(f"the model lacks the tensor {quote(name)}")
        if tensor.dtype != np.float32 or tensor.shape != shape:
            raise ModelDamaged(f"the model's tensor {quote(name)} is {tensor.dtype} of shape {list(tensor.shape)}, expected float32 of {list(shape)}")
        if not np.isfinite(tensor).all():
            raise ModelDamaged(f"the model's tensor {quote(name)} has NaN or infinity; do not use it")
        return tensor

    def _read_heads(self, heads: Any) -> list[str]:
        """The kind of each leaf's head."""
        names = ["/".join(map(str, leaf.path)) for leaf in self._action.leaves]
        if heads is None:
            return [next(kind for kind, fitting in HEADS.items() if isinstance(leaf.space, fitting)) for leaf in self._action.leaves]
        kinds: list[Any] = [head.get("type") for head in heads if isinstance(head, dict)] if isinstance(heads, list) else []
        fits = len(kinds) == len(names) == len(heads) and all(head.get("leaf") == name for head, name in zip(heads, names))
        if fits and any(kind in BOUNDED and not leaf.space.is_bounded() for kind, leaf in zip(kinds, self._action.leaves) if isinstance(leaf.space, spaces.Box)):
            raise ModelDamaged(f"the model's heads {kinds} need bounds of {self.action_space}")
        if not fits or not all(kind in HEADS and isinstance(leaf.space, HEADS[kind]) for kind, leaf in zip(kinds, self._action.leaves)):
            raise ModelDamaged(f"the model's heads are {heads}, which do not fit its action space {self.action_space}")
        return kinds

    def _read_noises(self, heads: Any) -> list[StateNoise | None]:
        """How each leaf's noise follows the state; None where it does not."""
        noises = [StateNoise.read(head) if kind.endswith("sde_gaussian") else None for kind, head in zip(self.heads, heads or [None] * len(self.heads))]
        following = [noise for noise in noises if noise]
        if len({(noise.features, noise.sample_freq) for noise in following}) > 1:
            raise ModelDamaged("the model's heads explore by different features, or for different times")
        if sum(noise.features * size for noise, size in zip(noises, self._heads) if noise) > LARGEST_EXPLORATION:
            raise ModelDamaged(f"the model's heads explore by more than {LARGEST_EXPLORATION} numbers")
        return noises

    def _read_normaliser(self, normalise: Any) -> tuple[Array, Array, np.float32] | None:
        if normalise is None:
            return None
        if not isinstance(normalise, dict) or type(normalise.get("clip")) not in (int, float) or not 0 < normalise["clip"] < math.inf:
            raise ModelDamaged("the model's normaliser needs mean, scale and a clip above 0")
        if not all(isinstance(normalise.get(key), str) for key in ("mean", "scale")):
            raise ModelDamaged("the model's normaliser does not name its mean and its scale")
        mean, scale = (self._floats(normalise[key], (self.features,)) for key in ("mean", "scale"))
        return mean, scale, np.float32(normalise["clip"])

    def _run_self_test(self, pairs: Any) -> None:
        if not isinstance(pairs, list) or not pairs:
            raise ModelDamaged("the model has no self-test")
        self.selftest_error = 0.0
        for pair in pairs:
            if not isinstance(pair, dict) or type(pair.get("tol")) not in (int, float) or not 0 <= pair["tol"] < math.inf:
                raise ModelDamaged("the model's self-test has no tolerance")
            asked, expected = self._tensors.get(str(pair.get("in"))), self._tensors.get(str(pair.get("out")))
            rows = len(asked) if asked is not None and asked.ndim == 2 else 0
            if rows == 0 or expected is None:
                raise ModelDamaged(f"the model's self-test names tensors that are empty or not there: {quote(pair.get('in'))}, {quote(pair.get('out'))}")
            asked, expected = self._floats(pair["in"], (rows, self.features)), self._floats(pair["out"], (rows, sum(self._heads) + self._hidden))
            error = np.abs(self._run(asked).astype(np.float32).astype(np.float64) - expected)
            if not np.all(error <= pair["tol"] * (1 + np.abs(expected).max())):
                raise ModelDamaged(f"the model fails its own self-test {quote(pair['out'])} by {error.max():g}; do not use it")
            self.selftest_error = max(self.selftest_error, float(error.max()))


def _check_kind(spec: dict[str, Any]) -> dict[str, Any]:
    if spec.get("kind") != "policy":
        raise ModelForeign(f"this is a {quote(spec.get('kind'))}, not a 'policy'; only the program that wrote it can use it")
    required = spec.get("requires", [])
    if not isinstance(required, list):
        raise ModelDamaged("the model's `requires` is no list")
    for feature in required:
        if not isinstance(feature, str) or feature not in FEATURES:
            raise ModelTooNew(f"the model requires {quote(feature)}, which this program does not know; use a newer consac")
    if not isinstance(spec.get("interface"), dict):
        raise ModelDamaged("the model's specification has no interface")
    interface: dict[str, Any] = spec["interface"]
    return interface


def _space(interface: dict[str, Any], name: str) -> spaces.Space[Any]:
    value = interface.get(name)
    if not isinstance(value, dict):
        raise ModelDamaged(f"the model has no {name} space")
    try:
        check_space(value)
        if numbers_in(value, one_hot=True) > LARGEST_LAYER:
            raise ModelDamaged(f"the model's {name} space has over {LARGEST_LAYER} elements")
        return space_from_json(value)
    except ModelError:
        raise
    except Exception as error:
        raise ModelDamaged(f"the model's {name} space cannot be read: {type(error).__name__}: {str(error)[:120]}") from None


def _legal(space: spaces.Space[Any], mask: Any) -> list[Array]:
    """Flat pieces of a mask as `space.sample(mask)` takes it, in a mask row's order."""
    if isinstance(space, spaces.Dict):
        return [piece for name in sorted(space.spaces, key=str.encode) for piece in _legal(space.spaces[name], mask[name])]
    if isinstance(space, (spaces.Tuple, spaces.MultiDiscrete)):
        below = space.spaces if isinstance(space, spaces.Tuple) else [spaces.Discrete(n) for n in np.ravel(space.nvec)]
        if len(mask) != len(below):
            raise ValueError
        return [piece for child, part in zip(below, mask) for piece in _legal(child, part)]
    if isinstance(space, spaces.Box):
        return []
    flat = np.ravel(mask)
    return [np.stack([flat != 1, flat != 0], 1).ravel() if isinstance(space, spaces.MultiBinary) else flat]


def _choices(space: spaces.Space[Any]) -> tuple[list[int], list[int]]:
    """How many values each number of a space has, and where they begin; of a space whose numbers are no choices, none."""
    if isinstance(space, spaces.Discrete):
        return [int(space.n)], [int(space.start)]
    counts = [int(n) for n in np.ravel(space.nvec)] if isinstance(space, spaces.MultiDiscrete) else []
    return counts, [0] * len(counts)


def _masked(space: spaces.Space[Any]) -> list[int]:
    """Bytes of the mask of each choice that a leaf of actions makes."""
    return [2] * math.prod(space.shape) if isinstance(space, spaces.MultiBinary) else _choices(space)[0]


def _features(leaf: Leaf) -> int:
    if isinstance(leaf.space, spaces.Discrete):
        return int(leaf.space.n)
    return int(leaf.space.nvec.sum()) if isinstance(leaf.space, spaces.MultiDiscrete) else math.prod(leaf.shape)


def _stretched(head: Array, kind: str, space: spaces.Box, rng: np.random.Generator | None) -> Array:
    """Numbers from -1 to 1 of a deterministic or squashed head, stretched to the bounds."""
    value = head.astype(np.float64)
    if kind == "squashed_gaussian":
        value, deviations = np.split(value, 2, 1)
        if rng is not None:
            value = value + np.exp(np.clip(deviations, -20, 2)) * rng.standard_normal(value.shape)
        value = np.tanh(value)
    low, high = space.low.ravel().astype(np.float64), space.high.ravel().astype(np.float64)
    return np.clip(low + 0.5 * (value + 1) * (high - low), low, high)


def _choose(logits: Array, rng: np.random.Generator | None) -> Array:
    """The most likely choice of each row, or one drawn."""
    if rng is None:
        best: Array = logits.argmax(1)
        return best
    weights = np.exp(logits.astype(np.float64) - logits.max(1, keepdims=True))
    ends = np.cumsum(weights, 1)
    drawn: Array = (rng.random((len(logits), 1)) * ends[:, -1:] >= ends).sum(1)
    return drawn


def load_policy(path: str | os.PathLike[str], behaviour: str | None = None) -> Policy:
    """The policy in the model file or the run's folder at `path`; of several behaviours the named one. ModelError says in one line why it cannot be used."""
    policies = load_policies(path)
    if behaviour is None and len(policies) == 1:
        return next(iter(policies.values()))
    names = ", ".join(map(quote, policies))
    if behaviour is None:
        raise ModelMisfit(f"'{path}' has models of the behaviours {names}; name one with behaviour=..., or take all with load_policies")
    if behaviour not in policies:
        raise ModelMisfit(f"'{path}' has no model of the behaviour {quote(behaviour)}; there is {names}")
    return policies[behaviour]


def load_policies(path: str | os.PathLike[str]) -> dict[str, Policy]:
    """The policies at `path`, a model file or a run's folder, by the names of their behaviours."""
    path = Path(path)
    if not path.is_dir():
        files = [path]
    elif not (files := _models_of(path)):
        raise ModelForeign(f"'{path}' is a folder without a model; name a run's folder, or a .consac file")
    policies: dict[str, Policy] = {}
    for file in files:
        policy = _load(file)
        if policies.setdefault(policy.behaviour, policy) is not policy:
            raise ModelDamaged(f"'{file}' is a second model of the behaviour {quote(policy.behaviour)} in its folder; name a file")
    return policies


def _models_of(folder: Path) -> list[Path]:
    """model.consac of a run of one behaviour; else a file for each behaviour, of which one may be called model, too."""
    lone, files = folder / "model.consac", sorted(folder.glob("*.consac"))
    return [lone] if lone in files and (len(files) == 1 or _load(lone).behaviour != "model") else files


def _load(path: Path) -> Policy:
    data = path.read_bytes()
    try:
        return Policy(read_model(data), load_model(data))
    except ModelError as error:
        raise type(error)(f"'{path}': {error}") from None
    except (TypeError, ValueError, KeyError, AttributeError, ArithmeticError, RecursionError) as error:  # a member of a kind that no reader expects there
        raise ModelDamaged(f"'{path}': not a usable model file: {type(error).__name__}: {quote(error, 120)}") from None
