"""tools/windows.sh builds libraries beside each other, and nothing of that outlives a failure."""
import pathlib
import shutil
import subprocess
import time

import pytest

ROOT = pathlib.Path(__file__).parents[2]
# The libraries beside the others go on for long; of the others the first fails once those have begun.
LIBRARIES = '''
windows_plain=(long) windows_pictures=(failing)
build_library() {
  case $1 in
    long) sleep 1000 & echo $! >sleeper; mv sleeper sleeps; wait ;;
    failing) until [ -f sleeps ]; do sleep 0.01; done; return 3 ;;
  esac
}
'''


def runs(process):
    try:
        return pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not pathlib.Path("/proc/self/stat").exists(), reason="there is no /proc here")
def test_what_builds_beside_a_failure_ends_with_it(tmp_path):
    tools = tmp_path / "tools"
    tools.mkdir()
    shutil.copy(ROOT / "tools/windows.sh", tools)
    (tools / "setup.sh").write_text("#!/bin/sh\n")
    (tools / "setup.sh").chmod(0o755)
    (tools / "cross_libraries.sh").write_text(LIBRARIES)
    done = subprocess.run([tools / "windows.sh", "program"], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=120)
    sleeper, end = int((tmp_path / "sleeps").read_text()), time.monotonic() + 60
    while runs(sleeper) and time.monotonic() < end:
        time.sleep(0.01)
    alive = runs(sleeper)
    if alive:
        subprocess.run(["kill", str(sleeper)], check=True)
    assert done.returncode == 3 and not alive
