#!/usr/bin/env python3
"""A row of `consac bench` that trains, beside another program that does the same training and nothing else, on one core, in turn:
processor seconds of both and the ratio. The program is whatever you have built of a peer, without its final evaluation; its start
counts. `make bench` does not run this: it has no peer.

    .venv/bin/python bench/compare/beside_program.py build/release/cli/consac pendulum path/to/program [its arguments]
"""
import resource
import subprocess
import sys

from in_turn import PAIRS, bench_row, in_turn, medians


def children():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def theirs(command):
    start = children()
    subprocess.run(command, capture_output=True, check=True)
    return children() - start


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    consac, row, *command = sys.argv[1:]
    pairs = in_turn(lambda: bench_row(consac, row), lambda: theirs(command))
    mine, other, ratio = medians([(found["seconds"], seconds) for (found, _), seconds in pairs])
    print(f"{pairs[0][0][1]}, processor seconds, the median of {PAIRS} pairs\n")
    print("| row | consac s | program s | program / consac |\n|---|---|---|---|")
    print(f"| {row} | {mine:.3f} | {other:.3f} | {1 / ratio:.2f} |")
