"""Links of Markdown files: where they stand, where they lead, and which anchors a page has on a code host."""
import pathlib
import posixpath
import re
from collections.abc import Iterator
from typing import NamedTuple

FENCE = re.compile(r"^ *(`{3,}|~{3,}).*?^ *\1`* *$", re.M | re.S)
CODE = re.compile(r"(`+)(?!`).+?(?<!`)\1(?!`)", re.S)
LINK = re.compile(r"\]\(([^()\s]+)\)")
HEADING = re.compile(r"^#{1,6} +(.+?)(?: +#+)?$", re.M)
OUTSIDE = re.compile(r"[a-z][a-z0-9+.-]*:", re.I)


class Link(NamedTuple):
    start: int   # where the target stands in the text
    target: str  # as written
    path: str    # from the repository's root; the page's own for a mere anchor
    anchor: str  # without #; empty: none


def without_code(text: str) -> str:
    """The text with blanks for what is code, so that places stay what they are."""
    def blank(found: re.Match) -> str:
        return re.sub(r"[^\n]", " ", found[0])
    return CODE.sub(blank, FENCE.sub(blank, text))


def links(page: str, text: str) -> Iterator[Link]:
    """The links of a page that lead into the repository."""
    for found in LINK.finditer(without_code(text)):
        if OUTSIDE.match(found[1]):
            continue
        path, _, anchor = found[1].partition("#")
        resolved = posixpath.normpath(posixpath.join(posixpath.dirname(page), path)) if path else page
        yield Link(found.start(1), found[1], resolved, anchor)


def title(text: str) -> str:
    """What the first heading says, as plain text."""
    found = HEADING.search(FENCE.sub("", text))
    return plain(found[1]) if found else ""


def plain(heading: str) -> str:
    return re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").replace("**", "")


def anchors(text: str) -> set[str]:
    """Names of a page's headings as code hosts make them."""
    seen: dict[str, int] = {}
    names = set()
    for found in HEADING.finditer(FENCE.sub("", text)):
        name = re.sub(r"[^\w\- ]", "", plain(found[1]).lower()).replace(" ", "-")
        names.add(name if name not in seen else f"{name}-{seen[name]}")
        seen[name] = seen.get(name, 0) + 1
    return names | set(re.findall(r'<a (?:id|name)="([^"]+)"', text))


def wrong(root: pathlib.Path, files: list[str]) -> Iterator[str]:
    """A line for each link of the Markdown files that leads nowhere: to no file or folder of `files`, or to no heading."""
    there = set(files) | {str(folder) for name in files for folder in pathlib.PurePosixPath(name).parents}
    texts = {name: (root / name).read_text(encoding="utf-8") for name in files if name.endswith(".md")}
    named = {name: anchors(text) for name, text in texts.items()}
    for page, text in texts.items():
        for link in links(page, text):
            line = text.count("\n", 0, link.start) + 1
            if link.path not in there:
                yield f"{page}:{line}: {link.target} leads to no file of the repository"
            elif link.anchor and link.path in named and link.anchor not in named[link.path]:
                yield f"{page}:{line}: {link.target}: {link.path} has no heading of that name"
