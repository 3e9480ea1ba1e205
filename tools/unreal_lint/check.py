"""Reads a plugin with its table of symbols and the core's headers, and runs all rules."""
import pathlib

from .model import Plugin
from .rules import lint
from .symbols import Table
from .tokens import tokenize


def check(folder: pathlib.Path, symbols: pathlib.Path, core: list[pathlib.Path] = ()) -> list[tuple[str, int, str, str]]:
    """(file, line, rule, message) of every finding. core: folders of public headers
    that staging puts into the plugin."""
    plugin = Plugin(folder)
    plugin.symbols = Table(symbols)
    for path in sorted(path for folder in core for path in folder.rglob("*.h")):
        plugin.core_headers.append((path.resolve().as_posix(), tokenize(path.read_text(encoding="utf-8"))))
    plugin.core_words = {t.text for _, tokens in plugin.core_headers for t in tokens if t.kind == "word"}
    plugin.core_words |= {t.text for f in plugin.files if f not in plugin.written for t in f.tokens if t.kind == "word"}
    return lint(plugin)
