#!/usr/bin/env python3
"""A row of `consac bench` that trains, beside another program that does the same training and nothing else, on one core, in turn:
seconds of both and the ratio. The program is whatever you have built of a peer, without its final evaluation.

    .venv/bin/python bench/compare/beside_program.py build/release/cli/consac pendulum path/to/program [its arguments]
"""
import json
import re
import statistics
import subprocess
import sys
import time

PAIRS = 5


def ours(consac, row):
    text = subprocess.run([consac, "bench", "--only", row, "--repeats", "1", "--json"], capture_output=True, text=True, check=True).stdout
    found = json.loads(text)
    figure = found["rows"][0]
    seconds = figure["value"] if figure["unit"] == "s" else float(re.search(r"([\d.]+) s$", figure["note"]).group(1))
    return seconds, f"{found['cpu']}, {found['kernels']}"


def theirs(command):
    start = time.perf_counter()
    subprocess.run(command, capture_output=True, check=True)
    return time.perf_counter() - start


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    consac, row, *command = sys.argv[1:]
    pairs = [(ours(consac, row), theirs(command)) for _ in range(PAIRS)]
    print(f"{pairs[0][0][1]}, median of {PAIRS} pairs\n")
    print("| row | consac s | program s | program / consac |\n|---|---|---|---|")
    mine, other = (statistics.median(column) for column in ([p[0][0] for p in pairs], [p[1] for p in pairs]))
    print(f"| {row} | {mine:.3f} | {other:.3f} | {statistics.median(p[1] / p[0][0] for p in pairs):.2f} |")
