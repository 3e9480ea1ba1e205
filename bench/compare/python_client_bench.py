#!/usr/bin/env python3
"""The Python clients against `consac serve`: steps/s with one world and with many, over TCP and in shared memory.

    PYTHONPATH=python .venv/bin/python bench/compare/python_client_bench.py build/release/cli/consac
"""
import argparse
import contextlib
import os
import pathlib
import platform
import statistics
import subprocess
import tempfile
import time

import gymnasium
import numpy as np

import consac


@contextlib.contextmanager
def engine(program, world, envs):
    """The address of `consac serve WORLD --envs N`."""
    with tempfile.TemporaryDirectory() as folder:
        port_file = pathlib.Path(folder) / "port"
        process = subprocess.Popen([program, "serve", world, "--envs", str(envs), "--port", "0", "--port-file", port_file], stdout=subprocess.DEVNULL)
        try:
            while not port_file.is_file():
                if process.poll() is not None:
                    raise SystemExit(f"consac serve {world} ended with {process.returncode}")
                time.sleep(0.01)
            yield f"tcp://127.0.0.1:{int(port_file.read_text())}"
        finally:
            process.kill()
            process.wait()


def one_world(url, shared_memory, seconds):
    """Steps/s of consac.make, resets included."""
    with consac.make(url, shared_memory=shared_memory) as env:
        assert env.connection.in_memory == shared_memory
        env.reset(seed=1)
        env.action_space.seed(1)
        actions, step, done, begun = [env.action_space.sample() for _ in range(64)], env.step, 0, time.perf_counter()
        while (now := time.perf_counter()) - begun < seconds:
            for action in actions:
                _, _, terminated, truncated, _ = step(action)
                if terminated or truncated:
                    env.reset()
            done += len(actions)
        return done / (now - begun)


def many_worlds(url, shared_memory, seconds):
    """Steps/s of consac.make_vec, all worlds together."""
    with contextlib.closing(consac.make_vec(url, shared_memory=shared_memory, autoreset_mode=gymnasium.vector.AutoresetMode.SAME_STEP)) as envs:
        assert envs.connection.in_memory == shared_memory
        envs.reset(seed=1)
        envs.action_space.seed(1)
        actions, step, done, begun = [envs.action_space.sample() for _ in range(64)], envs.step, 0, time.perf_counter()
        while (now := time.perf_counter()) - begun < seconds:
            for action in actions:
                step(action)
            done += len(actions) * envs.num_envs
        return done / (now - begun)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program", help="consac of a release build")
    parser.add_argument("--world", default="point-v0")
    parser.add_argument("--envs", type=int, default=64, help="worlds of the second row")
    parser.add_argument("--seconds", type=float, default=2.0, help="of each run")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    print(f"Python {platform.python_version()}, numpy {np.__version__}, gymnasium {gymnasium.__version__}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.2f}")
    print(f"{options.world}, median of {options.repeats} runs of {options.seconds:g} s\n\n| worlds | TCP steps/s | shared memory steps/s | ratio |\n|---|---|---|---|")
    for envs, measure in ((1, one_world), (options.envs, many_worlds)):
        with engine(options.program, options.world, envs) as url:
            pairs = [(measure(url, False, options.seconds), measure(url, True, options.seconds)) for _ in range(options.repeats)]
        tcp, memory = (statistics.median(column) for column in zip(*pairs))
        print(f"| {envs} | {tcp:,.0f} | {memory:,.0f} | {memory / tcp:.1f} |", flush=True)
