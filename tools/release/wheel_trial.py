"""Wheels in fresh environments, one for each Python that is here, and what other people's tools say of them; a part of trial.py."""
import os
import pathlib
import re
import shutil
import subprocess
import zipfile

OLDEST, NEWEST = 10, 14  # of Python 3, as python/pyproject.toml has them
TOOLS = ".venv-release-check/bin"
TRAINS = """
import consac
done = consac.train("cartpole-v1", envs=8, steps=8192, seed=1, progress=False)
acts = done.policy
print(done.weights_hash, acts.backend)
"""
PLAIN = "import consac; print(consac.train('cartpole-v1').steps)"


def pythons() -> dict[str, pathlib.Path]:
    """What is on the PATH or was installed by pyenv: its version -> the interpreter, the newest of each."""
    found = [pathlib.Path(path) for minor in range(OLDEST, NEWEST + 1) if (path := shutil.which(f"python3.{minor}"))]
    found += sorted(pathlib.Path(os.environ.get("PYENV_ROOT", pathlib.Path.home() / ".pyenv")).glob("versions/*/bin/python"))
    versions = {}
    for path in found:
        told = subprocess.run([path, "-c", "import sys, ensurepip; print('%d.%d.%d' % sys.version_info[:3])"], capture_output=True, text=True)
        if told.returncode == 0 and OLDEST <= int(told.stdout.split(".")[1]) <= NEWEST:
            versions.setdefault(told.stdout.strip().rpartition(".")[0], path)
    return dict(sorted(versions.items(), key=lambda item: int(item[0].split(".")[1])))


def in_venv(wheel: pathlib.Path, python: pathlib.Path, folder: pathlib.Path) -> list[str]:
    """Installed by pip with what it asks for: the version, the demo, a training from Python, who acts, and a training with no argument but the world."""
    shutil.rmtree(folder, ignore_errors=True)
    alone = {name: value for name, value in os.environ.items() if not name.startswith(("CONSAC_", "PYTHON", "VIRTUAL_ENV"))}
    alone["PIP_DISABLE_PIP_VERSION_CHECK"] = "1"

    def run(*command: str | pathlib.Path, limit: float = 900) -> str:
        done = subprocess.run([str(part) for part in command], cwd=folder.parent if not folder.exists() else folder, capture_output=True, text=True,
                              timeout=limit, env=alone)
        if done.returncode:
            raise RuntimeError(f"{pathlib.Path(command[0]).name}: exit code {done.returncode}: {(done.stderr or done.stdout).strip().splitlines()[-1:]}")
        return done.stdout

    cells = []
    try:
        run(python, "-m", "venv", folder)
        programs = folder / "bin"
        run(programs / "python", "-m", "pip", "install", "-q", wheel)
        cells.append(run(programs / "consac", "--version").splitlines()[0])
        run(programs / "consac", "demo", "--steps", "2000", "--dir", "demo")
        cells.append("yes")
        cells += run(programs / "python", "-c", TRAINS).split()
        cells.append(run(programs / "python", "-c", PLAIN).strip())
    except (RuntimeError, subprocess.TimeoutExpired) as error:
        cells.append(f"FAILED: {error}")
    return cells + [""] * (5 - len(cells))


def carried(wheel: pathlib.Path, tried: dict[str, bytes]) -> str:
    """Whose program and library a wheel carries; those of the archives have been tried on their own."""
    with zipfile.ZipFile(wheel) as archive:
        names = [name for name in archive.namelist() if re.search(r"\.data/scripts/consac(\.exe)?$|^consac/lib/", name)]
        texts = {name: archive.read(name) for name in names}
    return ", ".join(next((f"that of {name}" for name, each in tried.items() if each == text), f"FAILED: {inside} is of no archive here")
                     for inside, text in sorted(texts.items())) or "none"


def looked_at(root: pathlib.Path, wheel: pathlib.Path) -> str:
    """The last words of auditwheel or delvewheel, and twine's; for macOS there is no such tool outside of macOS."""
    def told(tool: str, *arguments: str) -> str:
        path = os.pathsep.join((str((root / TOOLS).resolve()), os.environ["PATH"]))
        done = subprocess.run([root / TOOLS / tool, *arguments, str(wheel)], capture_output=True, text=True, env=os.environ | {"PATH": path})
        text = " ".join((done.stdout + done.stderr).split())
        return text if done.returncode == 0 else f"FAILED: {tool}: {text[-300:]}"

    twine = told("twine", "check", "--strict")
    cells = ["twine check --strict: " + ("passed" if "PASSED" in twine else twine)]
    if "manylinux" in wheel.name:
        text = told("auditwheel", "show")
        fits = re.search(r'following platform tag: "([^"]+)"', text)
        asked = re.search(r"versioned symbols from external shared libraries: (.+?)\. ?This", text) or re.search(r"system-provided shared libraries: (.+?) The", text)
        cells.append("auditwheel show: " + (f"consistent with {fits[1]}" + (f" ({asked[1]})" if asked else "") if fits else text))
    elif "win_" in wheel.name:
        text = told("delvewheel", "show", "--analyze-existing", "--analyze-existing-exes")
        copied = re.search(r"will be copied into the wheel\. (.+?) The following .+ will not be copied into the wheel\. (.+)$", text)
        cells.append("delvewheel show: " + (f"copies {copied[1].lower()}, of the system: {copied[2]}" if copied else text))
    return "; ".join(cells)


def pages(root: pathlib.Path, dist: pathlib.Path, tried: dict[str, bytes], scratch: pathlib.Path) -> str:
    """What of the page is about Python."""
    text = ("\n## Wheels\n\nEach in a fresh environment, with numpy and gymnasium as pip finds them; hash and steps are of `consac.train`, the last of "
            "`consac.train('cartpole-v1')`.\n\n| wheel | Python | `--version` | `demo` | ppo2, CartPole | who acts | steps |\n|---|---|---|---|---|---|---|\n")
    here = pythons()
    wheel = next(dist.glob("consac-*-manylinux*_x86_64.whl"), None)
    if wheel is None:
        text += "| FAILED: there is no wheel for manylinux on x86_64; run make release | | | | | | |\n"
    for version, python in here.items() if wheel else ():
        row = [wheel.name, version, *in_venv(wheel, python, scratch / f"venv-{version}")]
        print("release_check: " + " | ".join(row), flush=True)
        text += f"| {' | '.join(row)} |\n"
    absent = [f"3.{minor}" for minor in range(OLDEST, NEWEST + 1) if f"3.{minor}" not in here]
    text += f"\nNot here, so not tried: Python {', '.join(absent)}.\n" if absent else ""
    text += "\n| file | its library and program | what is said of it |\n|---|---|---|\n"
    for each in sorted((*dist.glob("consac-*.whl"), *(path for path in dist.glob("consac-*.tar.gz") if re.fullmatch(r"consac-[\d.]+\.tar\.gz", path.name)))):
        text += f"| {each.name} | {carried(each, tried) if each.suffix == '.whl' else 'none'} | {looked_at(root, each)} |\n"
    return text
