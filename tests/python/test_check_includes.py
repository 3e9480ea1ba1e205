"""The include checker accepts the tree and rejects planted faults."""
import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import check_includes  # noqa: E402

PLANTED = [
    ("core/src/nn/bad.cpp", '#include "consac/learn/algo/learner.h"', "core may not include learn"),
    ("worlds/road/bad.h", '#include "consac/run/config.h"', "worlds may not include run"),
    ("learn/src/algo/bad.cpp", "#include <worlds/registry.h>", "learn may not include worlds"),
    ("core/src/space/bad.cpp", '#include "consac/policy/policy.h"', "module space may not include policy"),
    ("core/src/base/bad.cpp", "int f(std::vector<int>& v) { return v.at(3); }", "cannot live in an engine"),
    ("learn/src/grad/bad.cpp", "void f() { throw 1; }", "cannot live in an engine"),
    ("run/src/bad.h", "  std::thread thread_;", "consac::Thread"),
    ("cli/bad.cpp", "  auto later = std::async([] { return 1; });", "consac::Thread"),
    ("core/src/server/bad.cpp", "  asio::io_context context;", "Transport and Listener"),
    ("run/src/report/bad.cpp", "  std::ofstream file(path);", "OutputFile"),
]


def test_the_tree_follows_the_arrows():
    assert check_includes.check_tree(ROOT) == []


@pytest.mark.parametrize("path, line, fault", PLANTED)
def test_a_planted_fault_is_found(tmp_path, path, line, fault):
    file = tmp_path / path
    file.parent.mkdir(parents=True)
    file.write_text(line + "\n")
    found = check_includes.check_tree(tmp_path)
    assert len(found) == 1 and fault in found[0]


def test_a_downward_include_is_accepted(tmp_path):
    file = tmp_path / "run/src/good.cpp"
    file.parent.mkdir(parents=True)
    file.write_text('#include "consac/learn/algo/learner.h"\n#include "worlds/registry.h"\n')
    assert check_includes.check_tree(tmp_path) == []
