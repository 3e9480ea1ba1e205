"""Spoilt models, checkpoints and configurations against every verb that reads them."""
from __future__ import annotations

import json
import random
import shutil
import struct
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path

from judge import Arena, Ended, Limits, Running
from mutate import many, nested, spoil_bytes, spoil_json


@lru_cache
def trained(program: str) -> Path:
    """A run of a few updates, trained once."""
    folder = Path(tempfile.mkdtemp(prefix="consac-hostile-"))
    subprocess.run([program, "train", "cartpole-v1", "--name", "r", "--steps", "512", "--set", "n_steps=64", "nminibatches=1", "checkpoint_every_updates=2",
                    "--no-table", "--no-progress"], cwd=folder, check=True, capture_output=True)
    return folder / "runs"


def spoil_model(rng: random.Random, data: bytes) -> bytes:
    """A safetensors file: u64 length of its JSON header, the header, the tensors."""
    length = struct.unpack_from("<Q", data)[0]
    header, tensors = json.loads(data[8:8 + length]), data[8 + length:]
    way = rng.random()
    if way < 0.35:
        return spoil_bytes(rng, data)
    if way < 0.6:
        text = spoil_json(rng, header)
    elif way < 0.9:  # the specification, itself JSON inside a string
        inside = rng.choice([key for key in header["__metadata__"]])
        spoilt = header["__metadata__"][inside]
        spoilt = spoil_json(rng, json.loads(spoilt)) if spoilt.startswith("{") else spoil_bytes(rng, spoilt.encode())
        if rng.random() < 0.15:
            spoilt = rng.choice([nested(6000), nested(200_000, "{"), many(300_000)])
        header["__metadata__"][inside] = spoilt.decode("utf-8", "replace")
        text = json.dumps(header).encode()
    else:
        text = rng.choice([nested(100_000), many(400_000)])
    return struct.pack("<Q", len(text) if rng.random() < 0.9 else rng.choice([0, 2**63, len(text) * 2])) + text + tensors


YAML = ["algorithm: ppo2\nhyperparameters:\n  n_steps: 16\n", "a: &a [x,x,x,x,x,x,x,x]\nb: &b [*a,*a,*a,*a,*a,*a,*a,*a]\nc: [*b,*b,*b,*b,*b,*b,*b,*b]\n",
        "steps: 1e400\n", "seed: -1\n", "name: ../../x\n", "? {a: b}\n: c\n", "[" * 5000, "- " * 5000, "steps: !!python/object:os.system x\n", "name: \"\\e[2J\"\n"]


def experiment(program: str, arena: Arena, rng: random.Random) -> Ended:
    runs = arena.home / "runs"
    shutil.copytree(trained(program), runs)
    what = rng.choice(["model", "model", "model", "checkpoint", "checkpoint", "config"])
    if what == "model":
        model = runs / "r" / "model.consac"
        model.write_bytes(spoil_model(rng, model.read_bytes()))
        verb = rng.choice([["inspect", "r"], ["inspect", "runs/r/model.consac", "--json"], ["eval", "r", "--episodes", "1", "--max-episode-steps", "50"],
                           ["play", "r", "cartpole-v1"]])
    elif what == "checkpoint":
        for checkpoint in (runs / "r" / "checkpoints").iterdir():
            if checkpoint.is_file() and rng.random() < 0.8:
                checkpoint.write_bytes(spoil_model(rng, checkpoint.read_bytes()))
        verb = ["train", "--resume", "--name", "r", "--steps", "768"]
    else:
        config = runs / "r" / "config.yaml"
        text = rng.choice(YAML) if rng.random() < 0.4 else config.read_text()
        config.write_bytes(spoil_bytes(rng, text.encode()) if rng.random() < 0.8 else text.encode())
        verb = rng.choice([["train", "--resume", "--name", "r", "--steps", "576"],
                           ["train", "cartpole-v1", "--config", "runs/r/config.yaml", "--name", "new", "--steps", "64"]])
    return Running([program, *verb], arena).end(Limits(seconds=30))
