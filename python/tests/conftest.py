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

from consac.serve import Server  # noqa: E402
from program import Engines  # noqa: E402


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
