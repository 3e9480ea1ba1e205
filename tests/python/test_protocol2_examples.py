"""examples/javascript and examples/csharp: both ends of protocol 2 in other languages, before every case, and learned from."""
import os
import pathlib
import re
import socket
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/dev")) / "cli/consac"
JAVASCRIPT, CSHARP = ROOT / "examples/javascript", ROOT / "examples/csharp"


@pytest.fixture(scope="session")
def compiled(tmp_path_factory):
    """Engine.cs as Unity's language has it, for Mono."""
    program = tmp_path_factory.mktemp("csharp") / "engine.exe"
    subprocess.run(["mcs", "-langversion:7", "-warnaserror", f"-out:{program}", *sorted(CSHARP.glob("*.cs"))], check=True)
    return program


class Engine:
    """An engine of an example, on a port of its own."""

    def __init__(self, *command):
        self.process = subprocess.Popen([*map(str, command)], stdout=subprocess.PIPE, text=True)
        self.url = re.fullmatch(r"listening on (tcp://127\.0\.0\.1:\d+)\n", self.process.stdout.readline())[1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


@pytest.fixture(params=["javascript", "csharp"])
def engine(request):
    """With an odd number of worlds, so that the blocks of requests have padding."""
    command = ["node", JAVASCRIPT / "engine.js"] if request.param == "javascript" else ["mono", request.getfixturevalue("compiled")]
    with Engine(*command, 0, 7) as running:
        running.name = request.param
        yield running


def run(*command, cwd=None):
    return subprocess.run([*map(str, command)], cwd=cwd, capture_output=True, text=True, timeout=300)


def holds(output):
    return re.search(r"(\d+) of \1 cases of protocol 2 hold", output)


def test_every_case_holds_for_the_engine(engine):
    done = run(PROGRAM, "doctor", "--conformance", engine.url)
    assert done.returncode == 0 and holds(done.stdout), done.stdout + done.stderr


# Doing nothing comes to less than 0 in either world: half of the pucks stay where they begin, 0.5 from the middle; an actor that walks at random pays 0.05 a step.
@pytest.mark.parametrize("steps", [40000])
def test_our_trainer_learns_from_it(engine, steps, tmp_path):
    trained = run(PROGRAM, "train", engine.url, "--steps", steps, "--name", "other", "--seed", 1, "--no-table", "--no-progress", cwd=tmp_path)
    assert trained.returncode == 0, trained.stderr
    judged = run(PROGRAM, "eval", "other", engine.url, "--episodes", 50, "--seed", 3, cwd=tmp_path)
    assert judged.returncode == 0, judged.stderr
    reached = float(re.search(r"mean reward (-?[\d.]+)", judged.stdout)[1])
    assert reached > {"javascript": 0.6, "csharp": 4.0}[engine.name], judged.stdout


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def test_every_case_holds_for_the_trainer():
    port = free_port()
    with subprocess.Popen([str(PROGRAM), "doctor", "--conformance-trainer", f"tcp://127.0.0.1:{port}", "--timeout", "60"], stdout=subprocess.PIPE, text=True) as doctor:
        doctor.stdout.readline()
        with subprocess.Popen(["node", str(JAVASCRIPT / "trainer.js"), str(port), "0", "12"]) as trainer:
            said = doctor.stdout.read()
            trainer.kill()
    assert doctor.returncode == 0 and holds(said) and "holds        nobody takes part for as long" in said, said


def test_the_trainer_learns_from_the_engine_beside_it():
    with Engine("node", JAVASCRIPT / "engine.js", 0, 8) as engine:
        done = run("node", JAVASCRIPT / "trainer.js", engine.url.rpartition(":")[2], 40000)
    assert done.returncode == 0, done.stdout
    assert float(re.search(r"mean return of the last 200: (-?[\d.]+)", done.stdout)[1]) > 0.6


def test_examples_stay_small():
    for path in (*JAVASCRIPT.glob("*.js"), *CSHARP.glob("*.cs")):
        assert len(path.read_text().splitlines()) < 250, path
