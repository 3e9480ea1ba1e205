#!/usr/bin/env python3
"""The nature CNN on 84 x 84 x 4 images, forward and with its gradient: `consac_cnn_bench` beside PyTorch (oneDNN), on one
core, in turn. Both begin with bytes, divide by 255 and end with a gradient of every parameter; the sum of the values is
the loss. PyTorch runs in its own memory format and channels last; the better counts.

    .venv/bin/python bench/compare/cnn_speed.py build/release/bench/consac_cnn_bench
"""
import re
import statistics
import subprocess
import sys
import time

import torch
from torch import nn

from in_turn import PAIRS, in_turn

torch.set_num_threads(1)


def network():
    convolutions = [nn.Conv2d(4, 32, 8, 4), nn.ReLU(), nn.Conv2d(32, 64, 4, 2), nn.ReLU(), nn.Conv2d(64, 64, 3, 1), nn.ReLU()]
    return nn.Sequential(*convolutions, nn.Flatten(), nn.Linear(3136, 512), nn.ReLU(), nn.Linear(512, 6))


def best(work, seconds=1.0):
    """CPU milliseconds of one call, the best of what fits into the time."""
    work()
    found, end = [], time.perf_counter() + seconds
    while time.perf_counter() < end:
        start = time.process_time()
        work()
        found.append(time.process_time() - start)
    return min(found) * 1e3


def theirs(rows):
    """(forward, with gradient)."""
    results = []
    for memory_format in (torch.contiguous_format, torch.channels_last):
        model = network().to(memory_format=memory_format)
        images = torch.randint(0, 256, (rows, 4, 84, 84), dtype=torch.uint8).contiguous(memory_format=memory_format)

        def forward():
            with torch.no_grad():
                model(images.float() / 255)

        def both():
            model.zero_grad(set_to_none=True)
            model(images.float() / 255).sum().backward()

        results.append((best(forward), best(both)))
    return tuple(min(numbers) for numbers in zip(*results))


def ours(program):
    """{rows: (forward, with gradient)} and the machine's line."""
    text = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    found = re.findall(r"nature CNN, (\d+) images: forward ([\d.]+) ms .*?, with gradient ([\d.]+) ms", text)
    return {int(rows): (float(forward), float(both)) for rows, forward, both in found}, text.splitlines()[0]


if __name__ == "__main__":
    pairs = in_turn(lambda: ours(sys.argv[1]), lambda: {rows: theirs(rows) for rows in (32, 256)})
    print(f"{pairs[0][0][1]}; torch {torch.__version__}, one thread; CPU time, the median of {PAIRS} pairs\n")
    print("| nature CNN, 84 x 84 x 4 | images | consac ms | PyTorch ms | PyTorch / consac |\n|---|---|---|---|---|")
    for rows in (32, 256):
        for place, what in enumerate(("forward", "forward and backward")):
            a = [mine[0][rows][place] for mine, _ in pairs]
            b = [other[rows][place] for _, other in pairs]
            ratio = statistics.median(y / x for x, y in zip(a, b))
            print(f"| {what} | {rows} | {statistics.median(a):.2f} | {statistics.median(b):.2f} | {ratio:.2f} |")
