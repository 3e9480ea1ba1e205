"""The wrapper for C#: compiled by Mono against stand-ins, its page's example run against them, and every name that it calls
looked up in the add-on. No Godot with .NET is needed, and none has run it."""
import re
import shutil
import subprocess

import pytest

from conftest import missing
from engine import DEADLINE_S, ROOT

ADDON = ROOT / "engines/godot/addons/consac"
HERE = ROOT / "tests/godot/csharp"


def test_the_wrapper_compiles_and_its_example_runs(tmp_path):
    if shutil.which("mcs") is None or shutil.which("mono") is None:
        missing("no Mono here: run tools/setup.sh test")
    example = re.search(r"```csharp\n(.*?)```", (ADDON / "csharp/README.md").read_text(), re.S).group(1)
    (tmp_path / "Walker.cs").write_text(example)
    program = tmp_path / "walker.exe"
    built = subprocess.run(["mcs", "-warnaserror+", f"-out:{program}", HERE / "stubs.cs", HERE / "main.cs", tmp_path / "Walker.cs",
                            ADDON / "csharp/Consac.cs"], capture_output=True, text=True, timeout=DEADLINE_S)
    assert built.returncode == 0, built.stdout + built.stderr
    said = subprocess.run(["mono", program], capture_output=True, text=True, timeout=DEADLINE_S)
    assert said.returncode == 0 and said.stdout.count("ok ") == 6 and "FAIL" not in said.stdout, said.stdout + said.stderr


@pytest.mark.parametrize("pattern, known", [
    (r'Agent\.Connect\("(\w+)"', ("consac_agent.gd", r"^signal {}\b")),
    (r'Agent\.Call\("(\w+)"', ("consac_agent.gd", r"^func {}\(")),
    (r'Agent\.Get\("(\w+)"', ("consac_agent.gd", r"^var {}\b")),
    (r'_node\.Connect\("(\w+)"', ("consac_sync.gd", r"^signal {}\b")),
    (r'_node\.Call\("(\w+)"', ("consac_sync.gd", r"^func {}\(")),
    (r'_node\.Get\("(\w+)"', ("consac_sync.gd", r"^var {}\b")),
    (r'Script\.Call\("(\w+)"', ("consac_bodies.gd", r"^static func {}\(")),
    (r'_model\.Call\("(\w+)"', ("../../extension/src/model.cpp", r'>\(\s*"{}"')),
])
def test_every_name_is_one_of_the_add_on(pattern, known):
    names = set(re.findall(pattern, (ADDON / "csharp/Consac.cs").read_text()))
    source = (ADDON / known[0]).read_text()
    assert names and all(re.search(known[1].format(name), source, re.M) for name in names), (names, known)
