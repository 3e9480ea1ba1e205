"""The stand-alone examples, which use nothing but a socket, work with our server and our trainer."""
import os
import pathlib
import re
import subprocess
import sys
import time

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONSAC = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/release")) / "cli/consac"


def start(*command, **options):
    return subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)


@pytest.mark.parametrize("newline", [[], ["--no-newline"]])
def test_a_thesis_style_client_drives_our_server(tmp_path, newline):
    port_file = tmp_path / "port"
    server = start(CONSAC, "serve", "road-v0", "--port", "0", "--port-file", port_file, "--steps", "500", "--sessions", "1", *newline)
    deadline = time.monotonic() + 10
    while not port_file.exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    client = start(sys.executable, ROOT / "examples/thesis_client.py", "--port", port_file.read_text().strip())
    output, _ = client.communicate(timeout=60)
    server.communicate(timeout=10)
    assert client.returncode == 0 and "training completed: 500 steps" in output, output
    assert float(re.search(r"mean reward ([\d.]+)", output).group(1)) > 0.9


def test_our_trainer_learns_from_a_thesis_style_server(tmp_path):
    server = start(sys.executable, ROOT / "examples/thesis_server.py", "--port", "0", "--steps", "1000")
    port = re.search(r"port (\d+)", server.stdout.readline()).group(1)
    trainer = start(CONSAC, "train", f"tcp://127.0.0.1:{port}", "--name", "thesis", "--no-progress", cwd=tmp_path)
    output, _ = trainer.communicate(timeout=120)
    server.communicate(timeout=10)
    assert trainer.returncode == 0, output
    assert (tmp_path / "runs/thesis/model.consac").exists()
