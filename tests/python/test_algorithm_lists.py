"""Every algorithm that the program has is named where the documents list them, and has its page."""
import json
import os
import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/dev"))
PAGES = {path.name: path.read_text() for path in (ROOT / "docs/algorithms").glob("*.md")}


@pytest.fixture(scope="module")
def algorithms():
    said = subprocess.run([BUILD / "cli/consac", "list", "algorithms", "--json"], capture_output=True, text=True, check=True).stdout
    return [row["algorithm"] for row in json.loads(said)]


def named(text):
    """What stands in backticks."""
    return set(re.findall(r"`([^`\s]+)`", text))


def passage(file, begins, ends):
    """The text of a document from `begins` to `ends`, both of which it has once."""
    text = (ROOT / file).read_text()
    assert text.count(begins) == 1, f"{file} has not one '{begins}'"
    return text.partition(begins)[2].partition(ends)[0]


@pytest.mark.parametrize("file, begins, ends", [
    ("README.md", "What works today: ", "with Stable Baselines' hyperparameters"),
    ("docs/logs.md", "Algorithms of the first generation", "**Progress.**"),
    ("docs/logs.md", "| algorithm | tags |", "\n\n"),
])
def test_lists_name_every_algorithm(algorithms, file, begins, ends):
    assert not set(algorithms) - named(passage(file, begins, ends))


def test_every_algorithm_has_its_page_and_the_readme_leads_to_it(algorithms):
    titles = {name: text.partition("\n")[0] for name, text in PAGES.items()}
    assert algorithms
    for algorithm in algorithms:
        assert [page for page, title in titles.items() if algorithm in named(title)], f"no page of docs/algorithms has `{algorithm}` in its title"
    linked = set(re.findall(r"\(docs/algorithms/(\S+?\.md)\)", (ROOT / "README.md").read_text()))
    assert linked == set(PAGES)


def test_pages_are_of_algorithms_that_there_are(algorithms):
    for page, text in PAGES.items():
        code = re.search(r"\(`(learn/src/algo/\w+\.cpp)`", text.partition("\n##")[0])
        assert code is None or (ROOT / code[1]).is_file(), page
        if code:
            assert named(text.partition("\n")[0]) <= set(algorithms), page
