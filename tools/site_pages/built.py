"""What is wrong with a built site: links and anchors that lead nowhere, and whatever a page would fetch from elsewhere."""
import pathlib
import re
import urllib.parse
from collections.abc import Iterator
from html.parser import HTMLParser

FETCHED = {("script", "src"), ("link", "href"), ("img", "src"), ("iframe", "src"), ("source", "src"), ("object", "data"), ("use", "href")}


class Page(HTMLParser):
    def __init__(self, text: str):
        super().__init__()
        self.names: set[str] = set()
        self.targets: list[tuple[str, str, str]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id" or (tag == "a" and name == "name"):
                self.names.add(value or "")
            elif name in ("href", "src", "data") and value:
                self.targets.append((tag, name, value))


def wrong(site: pathlib.Path) -> Iterator[str]:
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    for path, page in pages.items():
        if path.name == "404.html":  # its links are absolute: a server shows it at any place
            continue
        for tag, attribute, target in page.targets:
            parts = urllib.parse.urlsplit(target)
            if parts.scheme in ("http", "https") or target.startswith("//"):
                if (tag, attribute) in FETCHED:
                    yield f"{path.relative_to(site)}: <{tag}> fetches {target}"
                continue
            if parts.scheme:
                continue
            to = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            to = to / "index.html" if to.is_dir() else to
            if not to.is_file():
                yield f"{path.relative_to(site)}: {target} leads to no file"
            elif parts.fragment and to in pages and urllib.parse.unquote(parts.fragment) not in pages[to].names | {"__search", "__drawer"}:
                yield f"{path.relative_to(site)}: {target}: no such name on that page"
    for path in sorted(site.rglob("*.css")):
        for target in re.findall(r"(?:@import\s+|url\()[\"']?(https?:[^\"')]+)", path.read_text(encoding="utf-8")):
            yield f"{path.relative_to(site)}: fetches {target}"
