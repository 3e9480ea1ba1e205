"""tools/cross_libraries.sh builds libraries beside each other, and nothing of that outlives a failure."""
import pathlib
import subprocess
import time

import pytest

ROOT = pathlib.Path(__file__).parents[2]
# The libraries beside the others go on for long; of the others the first fails once those have begun.
LIBRARIES = f'''
set -euo pipefail
. {ROOT}/tools/cross_libraries.sh
cross_plain=(long) cross_pictures=(failing)
build_library() {{
  case $1 in
    long) sleep 1000 & echo $! >sleeper; mv sleeper sleeps; wait ;;
    failing) until [ -f sleeps ]; do sleep 0.01; done; return 3 ;;
  esac
}}
build_libraries
'''


def runs(process):
    try:
        return pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not pathlib.Path("/proc/self/stat").exists(), reason="there is no /proc here")
def test_what_builds_beside_a_failure_ends_with_it(tmp_path):
    done = subprocess.run(["bash", "-c", LIBRARIES], cwd=tmp_path, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                          timeout=120)
    sleeper, end = int((tmp_path / "sleeps").read_text()), time.monotonic() + 60
    while runs(sleeper) and time.monotonic() < end:
        time.sleep(0.01)
    alive = runs(sleeper)
    if alive:
        subprocess.run(["kill", str(sleeper)], check=True)
    assert done.returncode == 3 and not alive


def test_a_target_that_is_none_is_refused_in_one_line():
    done = subprocess.run([ROOT / "tools/cross.sh", "linux-sparc"], capture_output=True, text=True, timeout=60)
    known = subprocess.run([ROOT / "tools/cross.sh", "targets"], capture_output=True, text=True, timeout=60).stdout.split()
    assert done.returncode == 2 and done.stdout == f"cross: unknown target 'linux-sparc': one of {' '.join(known)}\n"
    assert {"linux-x86_64-musl", "windows-x86_64"} <= set(known)
