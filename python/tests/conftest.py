"""What the tests share, and what they do not take from whoever begins them: ignored signals, a token."""
import os
import signal


def as_begun_at_a_terminal():
    """A job in the background of a script, or one under nohup, ignores these signals, and so would everything that the tests start."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for name in ("SIGHUP", "SIGQUIT", "SIGTERM"):
        if hasattr(signal, name):  # not on Windows
            signal.signal(getattr(signal, name), signal.SIG_DFL)


as_begun_at_a_terminal()
os.environ.pop("CONSAC_TOKEN", None)

import pytest  # noqa: E402

from consac.serve import Limits, Server  # noqa: E402
from model_files import TRAINED  # noqa: E402
from program import PROGRAM, Engines, run  # noqa: E402
from toy_worlds import Counter  # noqa: E402


@pytest.fixture
def serve(tmp_path):
    """Starts `consac serve`: serve(world, *arguments) is its address."""
    engines = Engines(tmp_path)
    yield engines
    engines.kill()


@pytest.fixture
def serve_env():
    """Starts our own server: serve_env(make_env, envs, **options) is its address."""
    servers = []

    def start(make_env, envs=1, **options):
        servers.append(Server(make_env, envs, **options).start())
        return f"tcp://127.0.0.1:{servers[-1].port}"

    yield start
    for server in servers:
        server.close()


@pytest.fixture(scope="module")
def counters():
    """Our own server of two Counters in each session."""
    with Server(Counter, 2, limits=Limits(max_sessions=200)) as server:
        yield server


@pytest.fixture(scope="session")
def trained(tmp_path_factory):
    """The model files that the program trains in the worlds of TRAINED."""
    folder, paths = tmp_path_factory.mktemp("runs"), {}
    for world, settings in TRAINED.items():
        extra = [text for setting in settings for text in ("--set", setting)]
        done = run([PROGRAM, "train", world, "--steps", "1024", "--name", world, "--dir", folder, "--no-tensorboard", "--seed", "3", *extra])
        assert done.returncode == 0, done.stdout + done.stderr
        paths[world] = folder / world / "model.consac"
    return paths
