"""The network of a `.consac` model with numpy, in float64: blocks over named values, one class per kind of block.

spec/model_file.md is the law. policy.py is what users want; this is what runs inside.
"""
from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from consac.model_file import Array, ModelDamaged, whole

Shape = tuple[int, ...]
Floats = Callable[[str, Shape], Array]  # a tensor by its name
LARGEST_LAYER = 1 << 20  # features of a value, as in the C++ reader


def sigmoid(x: Array) -> Array:
    small = np.exp(-np.abs(x))
    likely: Array = np.where(x >= 0, 1, small) / (1 + small)
    return likely


ACTIVATIONS: dict[str, Callable[[Array], Array]] = {
    "linear": lambda x: x,
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0),
    "sigmoid": sigmoid,
    "elu": lambda x: np.where(x > 0, x, np.expm1(np.minimum(x, 0))),
    "leaky_relu": lambda x: np.where(x > 0, x, 0.01 * x),
    "silu": lambda x: x * sigmoid(x),
    "softplus": lambda x: np.maximum(x, 0) + np.log1p(np.exp(-np.abs(x))),
}


class Dense:
    """act(W x + b)."""

    inputs = 1

    def __init__(self, entry: dict[str, Any], shapes: list[Shape], floats: Floats) -> None:
        self.shape = (whole_size(entry, "out_size"),)
        self.weights = floats("w", (*self.shape, math.prod(shapes[0])))
        self.bias = floats("b", self.shape)

    def __call__(self, x: Array) -> Array:
        out: Array = x @ self.weights.T + self.bias
        return out


class Duelling:
    """V + A - mean A, of the inputs V and A."""

    inputs = 2

    def __init__(self, entry: dict[str, Any], shapes: list[Shape], floats: Floats) -> None:
        if math.prod(shapes[0]) != 1:
            raise ModelDamaged(f"the model's block {entry['name']!r} duels with {math.prod(shapes[0])} values of a state; there is 1")
        self.shape = (math.prod(shapes[1]),)

    def __call__(self, value: Array, advantages: Array) -> Array:
        out: Array = value + advantages - advantages.mean(1, keepdims=True)
        return out


class Convolution:
    """act(patch . w + b) at every pixel of the result, without padding; the result has channels last."""

    inputs = 1

    def __init__(self, entry: dict[str, Any], shapes: list[Shape], floats: Floats) -> None:
        self.image, self.first = shapes[0], entry.get("layout", "HWC") == "CHW"
        self.kernel, self.stride, filters = pair(entry, "kernel"), pair(entry, "stride"), whole_size(entry, "filters")
        if len(self.image) != 3 or entry.get("layout", "HWC") not in ("HWC", "CHW"):
            raise ModelDamaged(f"the model's block {entry['name']!r} reads an image of shape {list(self.image)} and layout {entry.get('layout')!r}")
        *size, channels = (*self.image[1:], self.image[0]) if self.first else self.image
        if size[0] < self.kernel[0] or size[1] < self.kernel[1]:
            raise ModelDamaged(f"the model's block {entry['name']!r} has a kernel of {self.kernel} for an image of {size} pixels")
        self.shape = tuple((pixels - kernel) // stride + 1 for pixels, kernel, stride in zip(size, self.kernel, self.stride)) + (filters,)
        self.weights = floats("w", (filters, *self.kernel, channels)).reshape(filters, -1)
        self.bias = floats("b", (filters,))

    def __call__(self, x: Array) -> Array:
        image = x.reshape(len(x), *self.image)
        if self.first:
            image = image.transpose(0, 2, 3, 1)
        patches = np.lib.stride_tricks.sliding_window_view(image, self.kernel, (1, 2))[:, ::self.stride[0], ::self.stride[1]]
        patches = patches.transpose(0, 1, 2, 4, 5, 3).reshape(-1, self.weights.shape[1])
        out: Array = (patches @ self.weights.T + self.bias).reshape(len(x), -1)
        return out


class Flatten:
    """The same numbers in one row."""

    inputs = 1

    def __init__(self, entry: dict[str, Any], shapes: list[Shape], floats: Floats) -> None:
        self.shape = (math.prod(shapes[0]),)

    def __call__(self, x: Array) -> Array:
        return x


class Concatenation:
    """The inputs one behind the other."""

    inputs = 0  # any number

    def __init__(self, entry: dict[str, Any], shapes: list[Shape], floats: Floats) -> None:
        self.shape = (sum(map(math.prod, shapes)),)

    def __call__(self, *inputs: Array) -> Array:
        return np.concatenate(inputs, 1)


class Slice:
    """The numbers from `offset` on, given a shape and divided."""

    inputs = 1

    def __init__(self, entry: dict[str, Any], shapes: list[Shape], floats: Floats) -> None:
        shape: Any = entry.get("shape")
        self.offset, self.divisor = entry.get("offset", 0), entry.get("divide_by", 1)
        sizes = isinstance(shape, list) and shape and all(whole(size) and 1 <= size <= LARGEST_LAYER for size in shape)
        if not sizes or not whole(self.offset) or not 0 <= self.offset <= math.prod(shapes[0]) - math.prod(shape):
            raise ModelDamaged(f"the model's block {entry['name']!r} slices {shape} from {self.offset!r} on out of {math.prod(shapes[0])} numbers")
        if type(self.divisor) not in (int, float) or not 0 < self.divisor < math.inf:
            raise ModelDamaged(f"the model's block {entry['name']!r} divides by {self.divisor!r}")
        self.shape = tuple(shape)

    def __call__(self, x: Array) -> Array:
        out: Array = x[:, self.offset:self.offset + math.prod(self.shape)] / self.divisor
        return out


class LayerNorm:
    """act(h scale + shift), h the row at mean 0 and deviation 1."""

    inputs = 1

    def __init__(self, entry: dict[str, Any], shapes: list[Shape], floats: Floats) -> None:
        self.epsilon, self.shape, size = entry.get("epsilon", 1e-5), shapes[0], (math.prod(shapes[0]),)
        if type(self.epsilon) not in (int, float) or not 0 < self.epsilon < math.inf:
            raise ModelDamaged(f"the model's block {entry['name']!r} has epsilon {self.epsilon!r}; it is above 0")
        self.scale, self.shift = floats("scale", size), floats("shift", size)

    def __call__(self, x: Array) -> Array:
        out: Array = (x - x.mean(1, keepdims=True)) / np.sqrt(x.var(1, keepdims=True) + self.epsilon) * self.scale + self.shift
        return out


OPS: dict[str, type[Any]] = {"dense": Dense, "duelling": Duelling, "convolution": Convolution, "flatten": Flatten, "concatenation": Concatenation, "slice": Slice, "layer_norm": LayerNorm}
ACTIVATED = {"dense", "convolution", "layer_norm"}  # the others must be linear


def pair(entry: dict[str, Any], name: str) -> tuple[int, int]:
    value: Any = entry.get(name)
    if not isinstance(value, list) or len(value) != 2 or not all(whole(size) and 1 <= size <= LARGEST_LAYER for size in value):
        raise ModelDamaged(f"the model's block {entry.get('name')!r} has {name} {value!r}; it is [height, width], each from 1")
    return value[0], value[1]


def whole_size(entry: dict[str, Any], name: str) -> int:
    value: Any = entry.get(name)
    if not whole(value) or not 1 <= value <= LARGEST_LAYER:
        raise ModelDamaged(f"the model's block {entry.get('name')!r} has {name} {value!r}; it goes from 1 to {LARGEST_LAYER}")
    return value


class Memory:
    """What the blocks with a state remember, for each slot by itself: a row is one agent, whichever call it comes in."""

    def __init__(self) -> None:
        self._states: dict[str, Array] = {}
        self._slots = np.zeros(0, np.int64)

    def begin_step(self, slots: Array, begins: Array) -> None:
        """The rows of the coming run are of these slots; where an episode begins, nothing is remembered."""
        self._slots = slots
        for name, states in self._states.items():
            if len(states) <= slots.max(initial=-1):
                self._states[name] = states = np.concatenate([states, np.zeros((slots.max() + 1 - len(states), states.shape[1]))])
            states[slots[begins]] = 0

    def take(self, name: str, size: int) -> Array:
        """[rows, size] of block `name`."""
        states = self._states.setdefault(name, np.zeros((self._slots.max(initial=-1) + 1, size)))
        return states[self._slots]

    def keep(self, name: str, rows: Array) -> None:
        self._states[name][self._slots] = rows


class Network:
    """The blocks that the first output needs. `floats(name, shape)` gives a tensor of the file or raises.

    A class of OPS whose objects have a `state`, numbers for each slot, is called with its inputs and the rows of that state, [rows, state], and
    gives its output and the state after it.
    """

    def __init__(self, graph: Any, features: int, floats: Floats) -> None:
        inputs: Any
        blocks: Any
        outputs: Any
        inputs, blocks, outputs = (graph.get(key) for key in ("inputs", "blocks", "outputs")) if isinstance(graph, dict) else (None, None, None)
        well_formed = isinstance(inputs, list) and isinstance(blocks, list) and isinstance(outputs, list) and outputs and all(isinstance(piece, dict) for piece in inputs + blocks)
        if not well_formed or len(inputs) != 1 or inputs[0].get("size") != features or not isinstance(inputs[0].get("name"), str):
            raise ModelDamaged(f"the model's graph must have blocks, outputs and one input of {features} features")
        self.input = inputs[0]["name"]
        self._shapes: dict[str, Shape] = {self.input: (features,)}
        self._owners: dict[str, str] = {}
        steps = []
        for entry in blocks:
            steps.append(self._block(entry, floats))
        if not all(isinstance(output, str) and output in self._shapes for output in outputs):
            raise ModelDamaged(f"the model's outputs {outputs} must be blocks' outs")
        self.output, self.size = outputs[0], math.prod(self._shapes[outputs[0]])
        needed, used = {self.output}, []
        for step in reversed(steps):
            if step[0] in needed:
                needed.update(step[1])
                used.append(step)
        self._steps = used[::-1]
        self.remembers = any(getattr(block, "state", 0) for _, _, block, _ in self._steps)

    def _block(self, entry: dict[str, Any], floats: Floats) -> tuple[str, list[str], Any, Callable[[Array], Array]]:
        target: Any
        name: Any
        op: Any
        activation: Any
        target, name, op, activation = (entry.get(key) for key in ("out", "name", "op", "act"))
        sources: Any = [entry["in"]] if isinstance(entry.get("in"), str) else entry.get("in")
        texts = isinstance(sources, list) and all(isinstance(text, str) for text in (*sources, target, name, op, activation))
        if not texts or op not in OPS or activation not in ACTIVATIONS or activation != "linear" and op not in ACTIVATED:
            raise ModelDamaged(f"the model's block {name!r} has op {op!r} and activation {activation!r}; known are {sorted(OPS)} and {sorted(ACTIVATIONS)}")
        shapes = [self._shapes[source] for source in sources if source in self._shapes]
        kind = OPS[op]
        if len(shapes) != len(sources) or kind.inputs not in (0, len(shapes)) or not shapes or entry.get("in_size") != sum(map(math.prod, shapes)) or target in self._shapes:
            raise ModelDamaged(f"the model's block {name!r} goes from {sources} ({entry.get('in_size')}) to {target!r} ({entry.get('out_size')}), which does not fit the blocks before it")
        owner = entry.get("shares", name)
        if owner != name and self._owners.get(owner) != op:
            raise ModelDamaged(f"the model's block {name!r} cannot share the parameters of {owner!r}")
        if owner == name:
            self._owners[name] = op
        block = kind(entry, shapes, lambda part, shape: floats(f"{owner}/{part}", shape).astype(np.float64))
        if entry.get("out_size") != math.prod(block.shape):
            raise ModelDamaged(f"the model's block {name!r} puts out {math.prod(block.shape)} features, not {entry.get('out_size')}")
        self._shapes[target] = block.shape
        return target, sources, block, ACTIVATIONS[activation]

    def __call__(self, features: Array, memory: Memory | None = None) -> Array:
        """[rows, features] to [rows, size]; without memory an episode begins in every row."""
        named = {self.input: features.astype(np.float64)}
        with np.errstate(over="ignore", invalid="ignore"):
            for target, sources, block, activation in self._steps:
                inputs = [named[source] for source in sources]
                if size := getattr(block, "state", 0):
                    output, state = block(*inputs, np.zeros((len(features), size)) if memory is None else memory.take(target, size))
                    if memory is not None:
                        memory.keep(target, state)
                else:
                    output = block(*inputs)
                named[target] = activation(output)
        return named[self.output]
