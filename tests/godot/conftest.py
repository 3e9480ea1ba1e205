"""The engine for the tests of this folder: skipped where a person has not fetched it, a failure in CI."""
import os
import shutil
import signal
import subprocess

import pytest

from engine import CONSAC, DEADLINE_S, ROBOT, Godot, cache

# Where the tests run in the background of a script Ctrl-C is ignored, also by every engine that they start; unless it is heard here.
signal.signal(signal.SIGINT, signal.default_int_handler)


def missing(reason):
    if os.environ.get("CI") or os.environ.get("CONSAC_REQUIRE_GODOT") == "1":
        pytest.fail(f"no engine, and one is required here: {reason}")
    pytest.skip(reason)


@pytest.fixture(scope="session")
def imported(tmp_path_factory):
    folder, reason = cache()
    if folder is None:
        missing(reason)
    return Godot(folder, tmp_path_factory.mktemp("godot"))


@pytest.fixture(scope="session")
def yumi(tmp_path_factory):
    """The twin of ABB's YuMi, as anybody imports it."""
    folder = tmp_path_factory.mktemp("twin") / "yumi"
    subprocess.run([CONSAC, "twin", "import", ROBOT / "yumi_description/urdf/yumi_calibrated.urdf", "-o", folder],
                   check=True, capture_output=True, timeout=DEADLINE_S)
    return folder


@pytest.fixture
def godot(imported):
    yield imported
    imported.stop()


@pytest.fixture
def display(godot):
    """A display that draws into memory, for the engine started within."""
    if shutil.which("Xvfb") is None:
        missing("no Xvfb here: run tools/setup.sh godot")
    server = subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "1600x900x24", "-nolisten", "tcp"],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    godot.environment["DISPLAY"] = ":" + server.stdout.readline().strip()
    yield
    server.terminate()
    server.wait()
