"""Dockerfile and workflows, as far as they can be held without a code host and Docker: tools/hosting.sh lints them besides."""
import fnmatch
import os
import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILES = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()
WORKFLOWS = [name for name in FILES if name.startswith(".github/workflows/")]
PROGRAM = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/dev")) / "cli/consac"


def sent(name):
    """Whether .dockerignore lets a file into the build: the last pattern that fits it, or a folder that it is in, decides."""
    paths = [str(path) for path in (pathlib.PurePosixPath(name), *pathlib.PurePosixPath(name).parents)][:-1]
    kept = True
    for line in (ROOT / ".dockerignore").read_text().splitlines():
        if not line or line.startswith("#"):
            continue
        pattern = line.removeprefix("!")
        deep = pattern.removeprefix("**/")
        if any(fnmatch.fnmatch(path.rpartition("/")[2] if deep != pattern else path, deep) and (deep != pattern or path.count("/") == pattern.count("/")) for path in paths):
            kept = line.startswith("!")
    return kept


def test_the_container_is_given_all_that_the_program_includes():
    given = {name for name in FILES if sent(name)}
    assert "README.md" not in given and not [name for name in given if "/test/" in name]
    places = ["", *sorted({name[:name.index("/include/") + 9] for name in given if "/include/" in name} | {name[:name.index("/src/") + 5] for name in given if "/src/" in name})]
    missing = [(name, header) for name in given if name.endswith((".h", ".cpp")) and not name.endswith("_test.cpp")
               for header in re.findall(r'^#include "([^"]+)"', (ROOT / name).read_text(), re.M)
               if not any(place + header in given for place in [*places, name.rpartition("/")[0] + "/"]) and any(place + header in FILES for place in places)]
    assert missing == []
    read = {found for name in given if name.endswith("CMakeLists.txt") and name.startswith("cli/") for found in re.findall(r"PROJECT_SOURCE_DIR\}/([\w/]+)", (ROOT / name).read_text())}
    assert "spec/conformance/protocol2/" in read and all(any(name.startswith(folder) for name in given) for folder in read)


def test_the_container_is_given_all_folders_that_it_builds():
    off = re.findall(r"-D(CONSAC_BUILD_\w+)=OFF", (ROOT / "Dockerfile").read_text())
    under: list[str] = []  # conditions of the ifs that a line of CMakeLists.txt is in
    for line in (ROOT / "CMakeLists.txt").read_text().splitlines():
        if found := re.match(r"\s*(?:else)?if\((.*)\)(\s*#.*)?$", line):
            under = (under[:-1] if "elseif" in line else under) + [found[1]]
        elif line.strip() == "endif()":
            under.pop()
        elif (found := re.match(r"\s*add_subdirectory\((.*)\)", line)) and not any(name in condition for name in (*off, "CONSAC_BUILD_FUZZ") for condition in under):
            if "CONSAC_EMBED" not in under:
                assert sent(f"{found[1]}/CMakeLists.txt"), f".dockerignore leaves out {found[1]}, which CMakeLists.txt builds: add a line !{found[1]}"


def test_the_container_copies_what_there_is():
    copied = [path for line in re.findall(r"^COPY (?!--)(.*)$", (ROOT / "Dockerfile").read_text(), re.M) for path in line.split()[:-1]]
    assert "tools/setup.sh" in copied and [path for path in copied if not (ROOT / path).exists() or (path != "." and not sent(path))] == []


def test_the_container_has_the_programs_libraries():
    needed = re.findall(r"\(NEEDED\).*\[(.*)\]", subprocess.run(["readelf", "-d", PROGRAM], check=True, capture_output=True, text=True).stdout)
    assert "libcairo.so.2" in needed
    owners = {subprocess.run(["dpkg", "-S", f"*/{library}"], check=True, capture_output=True, text=True).stdout.partition(":")[0]
              for library in needed if not re.match(r"lib(a|t|ub)san|lib(c|m|gcc_s|stdc\+\+|clang_rt.*)\.so|ld-", library)}
    installed = re.search(r"--no-install-recommends (fonts[^\\]*)", (ROOT / "Dockerfile").read_text())[1].split()
    assert owners <= set(installed) and set(installed) - owners == {"fonts-dejavu-core"}


@pytest.mark.parametrize("name", WORKFLOWS)
def test_a_workflow_trusts_nobody_more_than_it_must(name):
    text = (ROOT / name).read_text()
    used = re.findall(r"uses: (.*)", text)
    assert used and [one for one in used if not re.fullmatch(r"actions/[\w-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", one)] == []
    assert re.search(r"^permissions:\n  contents: read\n(?! )", text, re.M) and re.search(r"^concurrency:", text, re.M)
    assert text.count("runs-on:") == text.count("timeout-minutes:") and text.count("actions/checkout@") == text.count("persist-credentials: false")


def test_workflows_call_what_there_is():
    commands = {command for name in WORKFLOWS for command in re.findall(r"(?:run: |\$\()((?:make |\.ci/|tools/)[\w./-]+)", (ROOT / name).read_text())}
    assert {".ci/run", "make site"} <= commands
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.M))
    assert [one for one in commands if not (one.removeprefix("make ") in targets if one.startswith("make ") else os.access(ROOT / one, os.X_OK))] == []
