"""A `.consac` model file as bytes: its specification and its tensors. spec/model_file.md is the law; what they mean is in policy.py.

Nothing in a file is executed; damaged, cut and foreign files are refused.
"""
from __future__ import annotations

import hashlib
import math
import struct
from dataclasses import dataclass, field
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt

from consac import wire
from consac.errors import ConsacError
from consac.names import quote

Array = npt.NDArray[Any]
VERSION = 1
LARGEST_HEADER = 1 << 24
MOST_HEADER_VALUES = 1_048_576  # in it, lists and objects counted
DEEPEST_HEADER = 8


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


@dataclass
class ModelFile:
    """A `.consac` container: its specification and its tensors."""

    spec: dict[str, Any]
    tensors: dict[str, Array] = field(repr=False)


def read_model(data: bytes) -> ModelFile:
    """The container in `data`, checked as spec/model_file.md says."""
    if len(data) < 8:
        raise ModelDamaged(f"not a usable model file: it has only {len(data)} bytes")
    size = struct.unpack_from("<Q", data)[0]
    if size > LARGEST_HEADER or size > len(data) - 8:
        if all(byte >= 9 for byte in data[:8]):
            raise ModelForeign(f"this is no .consac file: it begins with {wire.shown_bytes(data[:8])}")
        raise ModelDamaged(f"not a usable model file: its header claims {size} bytes of a file of {len(data)}")
    header = _header(data[8:8 + size])
    body = memoryview(data)[8 + size:]
    metadata = header.pop("__metadata__", None)
    if not isinstance(metadata, dict) or not all(isinstance(value, str) for value in metadata.values()):
        raise ModelForeign("a safetensors file without CONSAC's metadata; convert it first")
    if metadata.get("format") != "consac":
        raise ModelForeign(f"a safetensors file of format {quote(metadata.get('format'))}, not 'consac'")
    version = metadata.get("consac.version", "")
    if not (version.isascii() and version.isdigit() and len(version) < 10 and int(version) >= 1):
        raise ModelDamaged(f"its version {quote(version)} is no number from 1")
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
    told = metadata.get("consac.tensors.sha256")
    if told is not None and told != _tensors_digest(header):
        raise ModelDamaged("not a usable model file: the SHA-256 of its tensors' names and shapes does not match; the file is damaged")
    return ModelFile(_json(text, "specification"), tensors)


def _tensors_digest(header: dict[str, Any]) -> str:
    digest = hashlib.sha256()
    for name, entry in sorted((name.encode(), entry) for name, entry in header.items()):
        digest.update(b"%s\t%s\t%s\n" % (name, entry["dtype"].encode(), b"".join(b"%d " % size for size in entry["shape"])))
    return digest.hexdigest()


def _header(text: bytes) -> dict[str, Any]:
    if not text.startswith(b"{"):
        raise ModelDamaged("not a usable model file: its header is no JSON object")
    header = _json(text, "header")
    if not _shallow(header, DEEPEST_HEADER):
        raise ModelDamaged("not a usable model file: its header is nested too deep")
    return header


def _json(text: bytes, what: str) -> dict[str, Any]:
    try:
        return wire.load_json(text, LARGEST_HEADER, MOST_HEADER_VALUES)
    except wire.WireError as error:
        raise ModelDamaged(f"not a usable model file: its {what} cannot be read: {error.message}") from None


def _shallow(value: object, levels: int) -> bool:
    below = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return levels >= 0 and all(_shallow(item, levels - 1) for item in below)


def whole(value: object) -> TypeGuard[int]:
    """Whether `value` is a size."""
    return type(value) is int and 0 <= value < 1 << 62


def _tensors(header: dict[str, Any], body: memoryview) -> dict[str, Array]:
    places = []
    for name, entry in header.items():
        dtype, shape, offsets = (entry.get(key) for key in ("dtype", "shape", "data_offsets")) if isinstance(entry, dict) else (None, None, None)
        if not isinstance(dtype, str) or dtype not in wire.DTYPES:
            raise ModelDamaged(f"not a usable model file: tensor {quote(name)} has dtype {quote(dtype)}, which is not known")
        if not isinstance(shape, list) or len(shape) > 16 or not all(map(whole, shape)):
            raise ModelDamaged(f"not a usable model file: tensor {quote(name)} has an impossible size")
        if not isinstance(offsets, list) or len(offsets) != 2 or not all(map(whole, offsets)):
            raise ModelDamaged(f"not a usable model file: tensor {quote(name)} has no usable data_offsets")
        needed = math.prod(shape) * np.dtype(wire.DTYPES[dtype]).itemsize
        if offsets[1] - offsets[0] != needed:
            raise ModelDamaged(f"not a usable model file: tensor {quote(name)} has {offsets[1] - offsets[0]} bytes, its shape needs {needed}")
        places.append((*offsets, name, dtype, shape))
    at, tensors = 0, {}
    for begin, end, name, dtype, shape in sorted(places):
        if begin != at:
            raise ModelDamaged(f"not a usable model file: tensor {quote(name)} begins at byte {begin}, expected {at}")
        at = end
    if at != len(body):
        raise ModelDamaged(f"not a usable model file: it has {len(body)} bytes of data, its tensors need {at}")
    for begin, end, name, dtype, shape in places:
        tensors[name] = np.frombuffer(body[begin:end], np.dtype(wire.DTYPES[dtype]).newbyteorder("<")).reshape(shape)
    return tensors
