#!/usr/bin/env python3
"""Steps a second in Godot 4, and what an engine's tick pays. Writes bench/results/godot.md; on a machine with nothing else
to do: CONSAC_BUILD_DIR=$PWD/build/release .venv/bin/python bench/godot_bench.py. Wants tools/godot.sh and consac_godot."""
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/godot"))
from engine import Godot, cache  # noqa: E402

NATIVE = ROOT / "tests/godot/native"
REPEATS = 3  # the median of so many is written
SECONDS = 3


def median(measure, *arguments):
    return statistics.median(measure(*arguments) for _ in range(REPEATS))


class Bench:
    """Measures with one engine at a time."""

    def __init__(self, godot, work):
        self.godot, self.work, self.runs = godot, work, 0
        for script in NATIVE.glob("*.gd"):
            (godot.project / script.name).write_text(script.read_text())

    def road_by_trainer(self, steps, *settings):
        """The example road, learned by `consac train`; steps a second as the engine counts them."""
        engine, port = self.godot.scene("road", f"steps={steps}", "sessions=1", "quit=1", *settings)
        self.runs += 1
        trainer = self.godot.consac("train", f"tcp://127.0.0.1:{port}", "--name", f"run{self.runs}", "--no-table",
                                    "--no-progress", "--no-tensorboard", cwd=self.work)
        return self._rate(engine, trainer)

    def road_inside(self, steps, *settings):
        """The same with the learner inside the engine."""
        arguments = ["mode=train", f"steps={steps}", "sessions=1", "quit=1", *settings]
        return self._rate(self.godot.start(
            self.godot.folder / "godot", "--headless", "--path", self.godot.project, "res://examples/road/road.tscn", "--",
            *(f"--consac-{argument}" for argument in arguments)))

    def _rate(self, engine, trainer=None):
        rate = int(engine.wait_for(r"training completed: .* \((\d+) steps/s\)").group(1))
        for program in (engine, trainer) if trainer else (engine,):
            program.finish()
        return rate

    def crowd(self, agents, who, way, model=""):
        """crowd.gd: (agent steps a second, ms of half of the polls)."""
        engine = self._script("crowd.gd", agents, who, way, SECONDS, *([model] if model else []))
        said = engine.wait_for(r"crowd: \d+ agents, (\d+) agent steps/s, .* half below ([\d.]+) ms")
        engine.finish()
        return int(said.group(1)), float(said.group(2))

    def crowd_over_the_wire(self, agents, way):
        """crowd.gd, asked by a trainer that learns nothing."""
        engine = self._script("crowd.gd", agents, "serve", way, 60)
        port = engine.port()
        client = subprocess.run([sys.executable, NATIVE / "client.py", str(port), str(SECONDS)], capture_output=True, text=True,
                                env={**os.environ, "PYTHONPATH": str(ROOT / "python")}, check=True)
        engine.kill()
        return int(client.stdout)

    def _script(self, name, *arguments):
        return self.godot.start(self.godot.folder / "godot", "--headless", "--path", self.godot.project, "--script",
                                f"res://{name}", "--", *map(str, arguments))


def table(head, rows):
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    return lines + [f"| {' | '.join(row)} |" for row in rows] + [""]


def thousands(number):
    return f"{number:,.0f}"


def one_agent(bench):
    ways = {"frame-bound, 60 ticks a second": ("fast=0", "loop=0", "period=1", 150), "fixed step, a tick for each": ("loop=0", "period=1", 20000),
            "loop mode": ("loop=1", 30000)}
    rows = []
    for way, (*settings, steps) in ways.items():
        text = median(bench.road_by_trainer, steps, *settings)
        wire = median(bench.road_by_trainer, steps, "protocol=auto", *settings)
        inside = median(bench.road_inside, steps, *settings)
        cost = 1e6 * (1 / wire - 1 / inside)
        rows.append([way, thousands(text), thousands(wire), thousands(inside), f"{cost:.0f} us" if steps > 1000 else ""])
        print(rows[-1])
    return table(["the example road, while it learns (PPO2, defaults)", "text 1, GDScript", "protocol 2, extension",
                  "learner inside", "the wire costs a step"], rows)


def many_agents(bench):
    rows = []
    for way in ("frame", "fixed", "loop"):
        one, many = (median(bench.crowd_over_the_wire, agents, way) for agents in (1, 64))
        rows.append([f"over protocol 2, nobody learns, {way}", thousands(one), thousands(many), f"{many / one:.1f}"])
        print(rows[-1])
    for who, what in (("train", "a learner inside, standing still meanwhile"), ("go_on", "a learner inside, going on meanwhile")):
        one, many = (median(lambda *a: bench.crowd(*a)[0], agents, who, "fixed") for agents in (1, 64))
        rows.append([f"{what}, fixed", thousands(one), thousands(many), f"{many / one:.1f}"])
        print(rows[-1])
    return table(["a crowd in one scene (tests/godot/native/crowd.gd), agent steps/s", "1 agent", "64 agents", "ratio"], rows)


def ticks(bench):
    model = bench.work / "crowd.consac"
    bench.crowd(64, "train", "fixed", model)
    rows = [["a 64x64 model acts, 1,000 agents", f"{median(lambda: bench.crowd(1000, 'act', 'fixed', model)[1]):.3f} ms"],
            ["a 64x64 model acts, 1 agent", f"{median(lambda: bench.crowd(1, 'act', 'fixed', model)[1]):.4f} ms"],
            ["a learner inside goes on, 64 agents", f"{median(lambda: bench.crowd(64, 'go_on', 'frame')[1]):.3f} ms"]]
    print(rows)
    return table(["what the engine's thread pays in poll() (median of the ticks)", "a tick"], rows)


def main():
    folder, reason = cache()
    if folder is None:
        sys.exit(f"godot_bench: {reason}")
    with tempfile.TemporaryDirectory() as work:
        godot = Godot(folder, pathlib.Path(work))
        bench = Bench(godot, pathlib.Path(work))
        cpu = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text()).group(1)
        commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
        version = (folder / "version").read_text().strip()
        lines = ["# Godot 4: steps a second", "",
                 f"Written by `bench/godot_bench.py` at commit {commit} on {os.cpu_count()} cores of {cpu}; {version}, without a",
                 f"window. The median of {REPEATS} runs. Trainer and engine share the machine.", ""]
        try:
            for part in (one_agent, many_agents, ticks):
                lines += part(bench)
        finally:
            godot.stop()
    (ROOT / "bench/results/godot.md").write_text("\n".join(lines).rstrip() + "\n")


if __name__ == "__main__":
    main()
