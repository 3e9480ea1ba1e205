"""The C interface of CONSAC by ctypes: what makes `policy.act` as quick as in C++. A wheel for this system carries the library; without one
numpy acts, which `policy.backend` says."""
from __future__ import annotations

import ctypes
import logging
import os
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .layout import Layout

NAME = {"win32": "consac.dll", "darwin": "libconsac.dylib"}.get(sys.platform, "libconsac.so")
ABI_MAJOR, ABI_MINOR = 0, 1  # of consac.h, as this file knows it


class _Acting(ctypes.Structure):
    """consac_acting."""
    _fields_ = [("size", ctypes.c_size_t), ("observations", ctypes.c_void_p), ("actions", ctypes.c_void_p), ("rows", ctypes.c_int64), ("masks", ctypes.c_void_p),
                ("agents", ctypes.c_void_p), ("begins", ctypes.c_void_p), ("sample", ctypes.c_int32)]


class Room:
    """Rows of one call: an array for each leaf of what is seen and of what is done, [rows, *shape] each, and the call itself."""

    def __init__(self, observation: Layout, action: Layout, rows: int):
        self.rows = rows
        self._seen, self._done = np.zeros((rows, observation.row_bytes), np.uint8), np.zeros((rows, action.row_bytes), np.uint8)
        self.seen, self.done = observation.views(self._seen, rows, 0), action.views(self._done, rows, 0)
        self._acting = _Acting(ctypes.sizeof(_Acting), self._seen.ctypes.data, self._done.ctypes.data, rows)
        self.call = ctypes.byref(self._acting)

    def mask(self, mask: npt.NDArray[np.uint8] | None) -> None:
        """[rows, mask bytes] without gaps, which must live until the call; None: everything is legal."""
        self._acting.masks = None if mask is None else mask.ctypes.data


class NativeModel:
    """A model that acts in C++."""

    def __init__(self, library: ctypes.PyDLL, data: bytes):
        """ValueError where the library does not take the model."""
        self._library, self._handle, self._data = library, ctypes.c_void_p(), data
        if library.consac_model_load_bytes(data, len(data), ctypes.byref(self._handle)) != 0:
            raise ValueError(_said(library))
        self._rooms = threading.local()  # each thread has rows of its own

    def room(self, observation: Layout, action: Layout, rows: int) -> Room:
        """The calling thread's room for so many rows; the same one for as many as the last time."""
        room: Room | None = getattr(self._rooms, "last", None)
        if room is None or room.rows != rows:
            room = self._rooms.last = Room(observation, action, rows)
        return room

    def act(self, room: Room) -> None:
        """The best action of each row. ValueError in the library's words."""
        if self._library.consac_model_act_rows(self._handle, room.call) != 0:
            raise ValueError(_said(self._library))

    def __reduce__(self) -> tuple[Any, ...]:
        return load_model, (self._data,)  # a copy is a model of its own, and none where there is no library

    def __del__(self) -> None:
        handle, self._handle = getattr(self, "_handle", None), ctypes.c_void_p()
        if handle:
            self._library.consac_model_free(handle)


def _said(library: ctypes.PyDLL) -> str:
    text: bytes = library.consac_last_error()
    return text.decode("utf-8", "replace")


def load_model(data: bytes) -> NativeModel | None:
    """The bytes of a model file as one that acts in C++; None where there is no library, or one that does not take it: then numpy is to act."""
    library = find_library()
    if library is None:
        return None
    try:
        return NativeModel(library, data)
    except ValueError as error:
        logging.getLogger("consac").debug("acting with numpy: %s", error)
        return None


_found: dict[str, ctypes.PyDLL | None] = {}


def find_library() -> ctypes.PyDLL | None:
    """The library that the variable CONSAC_LIBRARY names ("" for none), else the one in this package; None where there is none that can be used."""
    named = os.environ.get("CONSAC_LIBRARY")
    path = str(Path(__file__).with_name("lib") / NAME) if named is None else named
    if path not in _found:
        _found[path] = _open(path) if named or os.path.isfile(path) else None
    return _found[path]


def _open(path: str) -> ctypes.PyDLL | None:
    log = logging.getLogger("consac")
    try:
        library = ctypes.PyDLL(path)  # a call takes microseconds: the others may as well wait
        library.consac_abi_version.restype = ctypes.c_uint32
        version = library.consac_abi_version()
    except (OSError, AttributeError) as error:
        log.warning("acting with numpy: %s cannot be loaded: %s", path, error)
        return None
    if version >> 16 != ABI_MAJOR or version & 0xFFFF < ABI_MINOR:
        log.warning("acting with numpy: %s has the ABI %d.%d, not %d.%d", path, version >> 16, version & 0xFFFF, ABI_MAJOR, ABI_MINOR)
        return None
    takes: dict[str, tuple[Any, list[Any]]] = {
        "consac_last_error": (ctypes.c_char_p, []),
        "consac_model_load_bytes": (ctypes.c_int32, [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_void_p]),
        "consac_model_free": (None, [ctypes.c_void_p]),
        "consac_model_act_rows": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p]),
    }
    for name, (result, arguments) in takes.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library
