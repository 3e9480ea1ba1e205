"""A fixed part of the hostile suite; all of it is hostile.py (`make test-slow`)."""
from __future__ import annotations

import os
import random
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import judge  # noqa: E402
import mutate  # noqa: E402
from hostile import CLASSES, run_one  # noqa: E402

PROGRAM = str(Path(os.environ.get("CONSAC_BUILD_DIR", Path(__file__).resolve().parents[2] / "build/dev")) / "cli/consac")


@pytest.mark.parametrize("name", CLASSES)
def test_nothing_gives_way(name):
    count = 12
    found = [f"{name} {number}: {finding}" for number in range(count) for finding in run_one(name, PROGRAM, 1, number).findings]
    assert not found


def test_the_judge_sees_what_is_wrong(tmp_path):
    arena = judge.Arena(tmp_path)
    script = "printf '\\033[2J\\nHOSTILE-MARK x\\n'; echo mine > ../notes.txt; kill -SEGV $$"
    ended = judge.Running(["/bin/sh", "-c", script], arena).end(judge.Limits())
    assert len(ended.findings) == 4, ended.findings
    slow = judge.Running(["/bin/sleep", "5"], judge.Arena(tmp_path / "other")).end(judge.Limits(seconds=0.1))
    assert slow.findings == ["still running after 0.1 s"]


def test_what_is_drawn_does_not_depend_on_what_was_drawn_before():
    before = repr(mutate.NASTY_VALUES)
    value = {"rows": [1, 2, {"names": [{}]}], "text": "x"}
    first = [mutate.spoil_json(random.Random(seed), value) for seed in range(300)]
    assert repr(mutate.NASTY_VALUES) == before
    assert [mutate.spoil_json(random.Random(seed), value) for seed in range(300)] == first
