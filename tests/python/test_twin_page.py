"""docs/twin.md's commands, typed in their order, do not stand in each other's way; and `make build` makes all that they need."""
import os
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/dev"))


def commands():
    blocks = re.findall(r"^```sh\n(.*?)^```", (ROOT / "docs/twin.md").read_text(), re.M | re.S)
    return [line.split("#")[0].strip() for block in blocks for line in block.replace("\\\n", " ").splitlines()]


def test_no_folder_and_no_run_is_made_twice_and_each_is_there_before_it_is_named():
    made, runs = [], []
    for line in commands():
        if import_ := re.match(r"consac twin import .* -o (\S+)", line):
            made.append(import_[1])
        elif train := re.match(r"consac train (\S+) .*--name (\S+)", line):
            runs.append(train[2])
            assert ":" not in train[1] or train[1].split(":")[1] in made, line
        elif named := re.match(r"consac (?:twin (?:fk|check|reach|view)|eval) (\S+)", line):
            assert named[1] in made + runs, line
            assert not (model := re.search(r"--model (\S+)", line)) or model[1] in runs, line
    assert len(made) >= 3 and len(runs) >= 3
    assert len(set(made)) == len(made) and len(set(runs)) == len(runs), (made, runs)


def test_the_slow_test_imports_as_the_page_does():
    story = (ROOT / "tests/slow/twin_story.py").read_text()
    options = next(re.search(r"reach_hints.json(.*)", line)[1] for line in commands() if "twin import" in line and "reach_hints" in line)
    in_story = re.search(r'"twin", "import", .*?"reach_hints.json"(.*)\)', story)[1]
    assert re.findall(r"[\w-]+", in_story) == re.findall(r"[\w-]+", options)


def test_make_build_makes_the_program_and_the_reader_of_step_where_its_library_is():
    command = subprocess.run(["make", "-n", "build"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    target = re.search(r"--target (\S+)", command)[1]

    def asks_ninja(*arguments):
        return subprocess.run(["ninja", "-C", BUILD, "-t", *arguments], capture_output=True, text=True, check=True).stdout

    has_reader = re.search(r"^consac-cad: phony", asks_ninja("targets", "all"), re.M) is not None
    linked = re.findall(r" -o (cli/[\w-]+) ", asks_ninja("commands", target))
    assert sorted(linked) == ["cli/consac"] + ["cli/consac-cad"] * has_reader
