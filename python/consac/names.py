"""Text from outside (a peer, a model file, an environment): the one place of this package that makes of it a name or a line for people.

No file is ever named by such text here. The same rules as consac/base/names.h."""
from __future__ import annotations

import re
from collections.abc import Iterable

LONGEST_NAME = 255
LONGEST_LINE = 2000

# What does not show, or changes how its neighbours show: control characters, line ends, what turns the direction of writing, what has no look, and
# halves of UTF-16 pairs. Source: Unicode 15.1, categories Cc, Zl, Zp and Cs, Bidi_Control (UAX 9), zero-width and tag characters.
_HIDDEN = re.compile("[\u0000-\u001f\u007f-\u009f\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ud800-\udfff\ufdd0-\ufdef\ufeff"
                     "\ufff9-\ufffb\ufffe\uffff\U000e0000-\U000e00ff]")

LONGEST_FILE = 224  # bytes of the file that a trainer names after a behaviour, before its extension
_DEVICE = re.compile(r"(?:con|nul|aux|prn|(?:com|lpt)[0-9]) *(?:\.|$)", re.IGNORECASE | re.ASCII)
_CAPITALS = {ord(letter): letter.lower() for letter in "ABCDEFGHIJKLMNOPQRSTUVWXYZ"}


def printable_line(text: object, limit: int = LONGEST_LINE) -> str:
    """`text` as one line of at most `limit` characters; what does not show becomes \\xNN, byte by byte."""
    shown = _HIDDEN.sub(lambda found: "".join(f"\\x{byte:02x}" for byte in found[0].encode("utf-8", "surrogatepass")), str(text)[:limit])
    return shown if len(shown) <= limit else shown[:limit - 3] + "..."


def quote(text: object, limit: int = 80) -> str:
    return f"'{printable_line(text, limit)}'"


def check_name(what: str, name: object) -> str:
    """`name` if it is 1 to 255 bytes that show; ValueError begins with `what`."""
    if not isinstance(name, str) or not name:
        raise ValueError(f"a {what}'s name is {quote(name)}; give it one")
    if _HIDDEN.search(name):
        raise ValueError(f"the {what} name {quote(name)} holds a character that does not show; write it with characters that do")
    if len(name.encode()) > LONGEST_NAME:
        raise ValueError(f"the {what} name {quote(name)} is longer than {LONGEST_NAME} bytes; shorten it")
    return name


def check_optional_name(what: str, name: object) -> str:
    """The same for a name that may be missing ("")."""
    return name if isinstance(name, str) and not name else check_name(what, name)


def check_names_apart(what: str, names: Iterable[object]) -> None:
    """ValueError unless all are names and no two are the same."""
    seen: set[str] = set()
    for name in names:
        checked = check_name(what, name)
        if checked in seen:
            raise ValueError(f"the {what} name {quote(name)} is there twice")
        seen.add(checked)


def check_expected_names(value: object) -> None:
    """Every name in what a client expects, written as in SPEC: they are only compared, and end up in errors. ValueError."""
    if isinstance(value, list):
        for entry in value:
            check_expected_names(entry)
    for key, member in value.items() if isinstance(value, dict) else ():
        if key == "name" and isinstance(member, str):
            check_name("expected", member)
        elif key == "agents" and isinstance(member, list):
            for agent in member:
                if isinstance(agent, str):
                    check_name("expected agent", agent)
        else:
            check_expected_names(member)


def _file_bytes(name: str) -> int:
    """How long the file of a name is (spec/names.md), without its extension."""
    inner = sum(1 if byte < 128 and (chr(byte).isalnum() or chr(byte) in "_-. ") else 3 for byte in name.encode())
    return inner + 2 * sum(name[at] in ". " for at in {0, len(name) - 1}) + 2 * bool(_DEVICE.match(name))


def check_names_together(what: str, names: Iterable[str]) -> None:
    """The same of names that are not told apart by capitals alone either: a trainer makes files of them."""
    names = list(names)
    check_names_apart(what, names)
    for name in names if len(names) > 1 else ():
        if _file_bytes(name) > LONGEST_FILE:
            raise ValueError(f"the {what} name {quote(name)} makes a file name of more than {LONGEST_FILE} bytes; shorten it")
    seen: dict[str, str] = {}
    for name in names:
        other = seen.setdefault(name.translate(_CAPITALS), name)
        if other != name:
            raise ValueError(f"the {what} names {quote(other)} and {quote(name)} differ in capitals alone; rename one")
