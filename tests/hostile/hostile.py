#!/usr/bin/env python3
"""Draws hostile experiments from a seed, judges each, and prints counts and findings. Exit code 1 where there is one.

  python tests/hostile/hostile.py --seconds 600 [--seed S] [--program PATH] [--only CLASS ...] [--first N --count N] [--keep]"""
from __future__ import annotations

import argparse
import collections
import random
import shutil
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import engines  # noqa: E402
import files  # noqa: E402
import limits  # noqa: E402
import signals  # noqa: E402
import trainers  # noqa: E402
from judge import Arena, Ended  # noqa: E402

CLASSES = {"engines": engines.experiment, "trainers": trainers.experiment, "files": files.experiment, "limits": limits.experiment,
           "signals": signals.experiment}


def run_one(name: str, program: str, seed: int, number: int, keep: bool = False) -> Ended:
    """Experiment `number` of a class: the same for the same seed, as far as time lets it."""
    folder = Path(tempfile.mkdtemp(prefix=f"consac-hostile-{name}-"))
    try:
        return CLASSES[name](program, Arena(folder), random.Random(f"{name} {seed} {number}"))
    finally:
        print(f"  kept: {folder}") if keep else shutil.rmtree(folder, ignore_errors=True)


def main() -> int:
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(root / "build/release/cli/consac"))
    parser.add_argument("--seconds", type=float, default=600, help="in all, shared by the classes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", choices=list(CLASSES), default=list(CLASSES))
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, help="experiments of each class, instead of a time")
    parser.add_argument("--keep", action="store_true", help="keep the folders")
    options = parser.parse_args()
    options.program = str(Path(options.program).resolve())
    found = 0
    print(f"seed {options.seed}, {options.program}")
    for name in options.only:
        until, number, findings, codes = time.monotonic() + options.seconds / len(options.only), options.first, 0, collections.Counter()
        while (number < options.first + options.count) if options.count is not None else (time.monotonic() < until):
            ended = run_one(name, options.program, options.seed, number, options.keep)
            for finding in ended.findings:
                print(f"FOUND by {name} {number}: {finding}\n  last output: {ended.output[-400:]!r}", flush=True)
            findings += len(ended.findings)
            codes[ended.code] += 1
            number += 1
        ends = ", ".join(f"{code}: {count}" for code, count in sorted(codes.items()))
        print(f"{name}: {number - options.first} experiments, {findings} findings (exit codes {ends})", flush=True)
        found += findings
    print(f"{found} findings")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
