"""What `consac list hyperparameters ALGORITHM --json` says, as typed rows."""
import json
import math
import pathlib
import subprocess
from dataclasses import dataclass

KINDS = {"number": "real", "whole number": "integer", "true/false": "boolean", "number or lin_": "schedule",
         "choice": "choice", "text": "text"}


@dataclass(frozen=True)
class Row:
    name: str
    kind: str  # real, integer, boolean, schedule, choice, text
    default: str  # as text; 'none' where it is absent unless set
    low: float
    high: float
    choices: tuple[str, ...]  # of a choice
    optional: bool  # may be 'none'
    meaning: str
    source: str

    @property
    def tooltip(self) -> str:
        return f"{self.meaning[0].upper()}{self.meaning[1:]}. ({self.source})"


@dataclass(frozen=True)
class Algorithm:
    name: str
    what: str
    rows: tuple[Row, ...]


def pascal(text: str) -> str:
    """learning_rate -> LearningRate."""
    return "".join(word[:1].upper() + word[1:] for word in text.replace("-", "_").split("_"))


def number(text: str) -> float:
    return float(text)


def read_row(row: dict) -> Row:
    kind = KINDS[row["type"]]
    low, high, choices, optional = -math.inf, math.inf, (), False
    if kind == "choice":
        choices = tuple(row["range"].split("|"))
    elif row["range"]:
        bounds, _, rest = row["range"].partition(", ")
        low, high = (number(side) for side in bounds.split(" to "))
        optional = rest == "none"
    return Row(row["name"], kind, row["default"], low, high, choices, optional, row["meaning"], row["source"])


def ask(program: pathlib.Path, *words: str) -> list[dict]:
    return json.loads(subprocess.run([program, "list", *words, "--json"], capture_output=True, text=True, check=True).stdout)


def read(program: pathlib.Path) -> list[Algorithm]:
    """All algorithms with their tables, in the program's order."""
    return [Algorithm(found["algorithm"], found["what"],
                      tuple(read_row(row) for row in ask(program, "hyperparameters", found["algorithm"])))
            for found in ask(program, "algorithms")]
