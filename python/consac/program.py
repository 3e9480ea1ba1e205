"""Where the program `consac` is: a wheel carries it, pip puts it where its scripts are; else whatever the machine has."""
from __future__ import annotations

import os
import shutil
import sysconfig
from collections.abc import Iterator
from pathlib import Path

from .errors import ProgramError
from .names import quote

NAME = "consac.exe" if os.name == "nt" else "consac"


def find_program() -> Path:
    """The program's path. ProgramError where there is none.

    First what the variable CONSAC_PROGRAM names, then what was installed with this package, then what a shell would find, then what was
    built in the repository that this file is part of.
    """
    named = os.environ.get("CONSAC_PROGRAM")
    if named:
        if Path(named).is_file():
            return Path(named)
        raise ProgramError(f"CONSAC_PROGRAM names no file: {quote(named)}")
    for path in _places():
        if path.is_file():
            return path
    raise ProgramError("the program 'consac' is not here: the wheel for your system carries it (pip install consac); else build it and put it on the PATH, "
                       "or name it in the environment's variable CONSAC_PROGRAM")


def _places() -> Iterator[Path]:
    package = Path(__file__).resolve().parent
    yield Path(sysconfig.get_path("scripts")) / NAME
    user = sysconfig.get_preferred_scheme("user")
    yield Path(sysconfig.get_path("scripts", scheme=user)) / NAME
    yield package.parent / "bin" / NAME  # pip install --target
    if (found := shutil.which("consac")) is not None:
        yield Path(found)
    yield package.parents[1] / "build/release/cli" / NAME
