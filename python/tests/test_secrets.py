"""Tokens are compared in a time that does not tell where they differ: by one function, and by nothing else."""
import ast
import hmac
import pathlib

import pytest

import consac
from consac.serve import server

SECRET = {"token", "resume", "secret"}


def words(node):
    return {getattr(part, "id", None) or getattr(part, "attr", None) for part in ast.walk(node)}


def test_nothing_else_compares_them():
    found = []
    for file in pathlib.Path(consac.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Compare) and any(isinstance(how, (ast.Eq, ast.NotEq, ast.In, ast.NotIn)) for how in node.ops) and SECRET & words(node):
                found.append(f"{file.name}:{node.lineno}")
    assert found == []


@pytest.mark.parametrize("given, same", [("right", True), ("righx", False), ("xight", False), ("", False), (None, False), (7, False), ("\ud800", False), ("right\0", False)])
def test_the_one_that_does(given, same, monkeypatch):
    compared = []
    monkeypatch.setattr(server.hmac, "compare_digest", lambda *both: compared.append(both) or _compare(*both))
    assert server._same_secret(given, "right") is same
    assert len(compared) == 1


_compare = hmac.compare_digest
