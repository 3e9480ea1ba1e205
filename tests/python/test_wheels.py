"""tools/wheels.py: what it makes of a build is installed in a venv of its own, where the program trains and models act in C++."""
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import venv
import zipfile

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/dev"))
sys.path.insert(0, str(ROOT / "tools"))
import wheels  # noqa: E402

EPOCH = 1_700_000_000
TRAINS = """
import sys, numpy, consac
done = consac.train("cartpole-v1", steps=4000, seed=1, progress=False)
policy = done.policy
print(consac.find_program(), done.steps, policy.backend, policy.action_space.contains(policy.act(numpy.zeros(4, numpy.float32))))
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("wheels")
    done = subprocess.run([sys.executable, ROOT / "tools/wheels.py", "--native", BUILD, "--out", out, "--epoch", str(EPOCH)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return sorted(out.iterdir())


def installed(wheel, folder):
    """A venv that has the wheel, and numpy and gymnasium of the Python that runs this."""
    venv.EnvBuilder(with_pip=False, symlinks=True).create(folder)
    python = folder / "bin/python"
    there = subprocess.run([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], capture_output=True, text=True, check=True).stdout.strip()
    pathlib.Path(there, "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    subprocess.run([sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", "--no-index", "--force-reinstall", wheel], check=True,
                   env={**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1"})
    return python


def run(python, text, cwd):
    alone = {name: value for name, value in os.environ.items() if not name.startswith(("CONSAC_", "PYTHONPATH"))}
    return subprocess.run([python, "-c", text], capture_output=True, text=True, timeout=300, cwd=cwd, env=alone)


def test_there_is_a_wheel_for_this_machine_one_for_every_other_and_the_source(made):
    version = re.search(r'__version__ = "([^"]+)"', (ROOT / "python/consac/__init__.py").read_text())[1]
    assert [path.name for path in made] == [f"consac-{version}-py3-none-any.whl", f"consac-{version}-py3-none-linux_{os.uname().machine}.whl", f"consac-{version}.tar.gz"]
    assert all(path.stat().st_size < 15e6 for path in made)


def test_the_wheel_with_the_program_trains_and_acts_in_cpp(made, tmp_path):
    python = installed(made[1], tmp_path / "venv")
    said = run(python, TRAINS, tmp_path)
    assert said.returncode == 0, said.stderr
    assert said.stdout.split() == [str(tmp_path / "venv/bin/consac"), "4000", "native", "True"]
    told = subprocess.run([tmp_path / "venv/bin/consac", "--version"], capture_output=True, text=True)
    assert told.stdout.startswith("consac "), told


def test_the_wheel_for_every_other_machine_acts_with_numpy_and_says_what_it_lacks(made, tmp_path):
    python = installed(made[0], tmp_path / "venv")
    refused = run(python, "import os, consac; os.environ['PATH'] = ''; consac.train('cartpole-v1')", tmp_path)
    assert refused.returncode == 1 and refused.stderr.splitlines()[-1].startswith("consac.errors.ProgramError: the program 'consac' is not here"), refused.stderr
    assert run(python, "import consac.native; print(consac.native.find_library())", tmp_path).stdout == "None\n"


def test_the_same_inputs_give_the_same_bytes():
    files, source = wheels.pure(ROOT, EPOCH)
    inside = (b"a program", "libconsac.so", b"a library")
    first = wheels.wheel(files, "manylinux_2_17_x86_64.manylinux2014_x86_64", EPOCH, inside)
    again, source_again = wheels.pure(ROOT, EPOCH)
    assert wheels.wheel(dict(reversed(again.items())), "manylinux_2_17_x86_64.manylinux2014_x86_64", EPOCH, inside) == first and source == source_again
    assert first[0].endswith("-py3-none-manylinux_2_17_x86_64.manylinux2014_x86_64.whl")


@pytest.mark.parametrize("target", wheels.SYSTEMS)
def test_a_wheel_says_where_it_may_be_installed_and_runs_there(target, tmp_path):
    tag = wheels.SYSTEMS[target][0]
    files = {"consac/__init__.py": b"", "consac-1.0.dist-info/WHEEL": b"", "consac-1.0.dist-info/METADATA": b"Metadata-Version: 2.1\nName: consac\nVersion: 1.0\n"}
    name, text = wheels.wheel(files, tag, EPOCH, (b"program", "consac.dll", b"library"), {"sboms/consac.cdx.json": b"{}"})
    (tmp_path / name).write_bytes(text)
    with zipfile.ZipFile(tmp_path / name) as archive:
        program = "consac-1.0.data/scripts/consac" + (".exe" if "windows" in target else "")
        assert archive.read(program) == b"program" and archive.getinfo(program).external_attr >> 16 == 0o100755
        said = archive.read("consac-1.0.dist-info/WHEEL").decode()
        assert [line.split("-")[-1] for line in said.splitlines() if line.startswith("Tag:")] == tag.split(".") and "Purelib: false" in said
        recorded = {line.rsplit(",", 2)[0] for line in archive.read("consac-1.0.dist-info/RECORD").decode().splitlines()}
        assert recorded == set(archive.namelist()) and "consac-1.0.dist-info/sboms/consac.cdx.json" in recorded


def test_what_is_not_there_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["wheels.py", "--native", str(tmp_path), "--out", str(tmp_path / "out"), "--epoch", "0"])
    assert wheels.main() == 1 and "build the targets consac and consac_c" in capsys.readouterr().err
