"""What the site is made of: every Markdown file of the repository at its own path, a page for each public header, for each source file
that a page links to and for each folder; and the pictures that pages show. So relative links lead to the same here and on a code host."""
import pathlib
import posixpath
import re

from . import headers, python_api
from .links import LINK, OUTSIDE, links, without_code

PICTURES = (".png", ".svg", ".gif", ".jpg", ".webp")
LANGUAGES = {".py": "python", ".h": "cpp", ".cpp": "cpp", ".js": "javascript", ".mjs": "javascript", ".cs": "csharp", ".json": "json", ".sh": "bash", ".gd": "gdscript",
             ".c": "c", ".yml": "yaml", ".yaml": "yaml", ".toml": "toml", ".cmake": "cmake", ".lua": "lua", ".rs": "rust"}
HEADER = re.compile(r"(?<!test/)(?<!shim/)include/consac(/|\.h$).*")
LARGEST = 64 << 10  # of a source file that gets a page of its own
HOME, INDEX, PYTHON = "README.md", "reference/README.md", "reference/python.md"
# What mkdocs is told of a page: in a search guides come before headers, and a source file is looked for where it is linked.
SAID_OF = {"home": "---\nhide: [navigation]\n---\n", "header": "---\nsearch:\n  boost: 0.5\n---\n", "source": "---\nsearch:\n  exclude: true\n---\n"}


class Tree:
    """Pages by their path in the site's sources."""

    def __init__(self, root: pathlib.Path, files: list[str]):
        self.root = root
        self.files = [name for name in files if "third_party" not in name and not name.startswith(".")]
        self.folders = {str(folder) for name in self.files for folder in pathlib.PurePosixPath(name).parents} - {"."}
        self.headers = [name for name in self.files if name.endswith(".h") and HEADER.search(name)]
        self.pages: dict[str, str] = {}
        self.pictures: set[str] = set()
        for name in self.files:
            if name.endswith(".md"):
                self.take(name, self.text(name))
        for name in self.headers:
            self.pages[self.page_of(name)] = SAID_OF["header"] + headers.page(name, self.text(name))
        self.pages[HOME] = SAID_OF["home"] + self.pages[HOME]
        self.pages[PYTHON] = python_api.page(root / "python/consac")
        self.pages[INDEX] = self.index()

    def text(self, name: str) -> str:
        return (self.root / name).read_text(encoding="utf-8")

    def page_of(self, path: str) -> str:
        """The page that a link to `path` is to lead to; a picture's own path."""
        if path in self.folders:
            return f"{path}/README.md" if f"{path}/README.md" in self.files else f"{path}/index.md"
        return path if path.endswith((".md", *PICTURES)) else f"{path}.md"

    def take(self, name: str, text: str) -> None:
        """A Markdown file, with its links led to pages, and whatever it links to."""
        self.pages[name] = ""  # it may link to itself
        out, end = [], 0
        for link in links(name, text):
            page = self.page_of(link.path)
            target = posixpath.relpath(page, posixpath.dirname(name) or ".") + (f"#{link.anchor}" if link.anchor and page == link.path else "")
            out += [text[end:link.start], f"#{link.anchor}" if link.path == name else target]
            end = link.start + len(link.target)
            self.add(link.path, page)
        self.pages[name] = as_markdown_of_python("".join(out) + text[end:])

    def add(self, path: str, page: str) -> None:
        if page.endswith(PICTURES):
            self.pictures.add(page)
        elif page in self.pages or page in self.files or path in self.headers:
            pass
        elif path in self.folders:
            self.pages[page] = ""
            self.pages[page] = self.folder(path)
        elif path in self.files:
            self.pages[page] = SAID_OF["source"] + source(path, self.text(path))

    def folder(self, path: str) -> str:
        out = [f"# {path}", ""]
        for name in self.files:
            if not name.startswith(path + "/") or name.endswith(PICTURES):
                continue
            shown = name.removeprefix(path + "/")
            page = self.page_of(name)
            if page not in self.files and ((self.root / name).stat().st_size > LARGEST or not is_text(self.root / name)):
                out.append(f"- {shown}")
                continue
            self.add(name, page)
            out.append(f"- [{shown}]({posixpath.relpath(page, path)})")
        return "\n".join(out) + "\n"

    def index(self) -> str:
        """All public headers, by part and module, with what each says first."""
        out = ["# C++ headers", "", "Made from the headers' own comments. [The tour](../README.md#a-tour) says which to read first. Python: [its page](python.md).", ""]
        part = ""
        for name in self.headers:
            module = headers.module_of(name)
            if module != part:
                out += ["", f"## {module}", "", "| | |", "|---|---|"]
                part = module
            said = headers.prose(headers.first_sentence(self.text(name)))
            out.append(f"| [{posixpath.basename(name)}](../{self.page_of(name)}) | {headers.cell(said)} |")
        return "\n".join(out) + "\n"


def is_text(path: pathlib.Path) -> bool:
    try:
        path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        return False
    return True


def source(path: str, text: str) -> str:
    fence = "`" * max([3, *(len(run) + 1 for run in re.findall(r"`{3,}", text))])
    return f"# {path}\n\n{fence}{LANGUAGES.get(posixpath.splitext(path)[1], 'text')}\n{text.rstrip()}\n{fence}\n"


def as_markdown_of_python(text: str) -> str:
    """What code hosts read, as Python-Markdown reads it: a blank line before a list, four blanks for what is inside one."""
    out: list[str] = []
    fence = ""
    shift = 0
    item = re.compile(r"([-*+]|\d+\.) ")
    inside = False  # a list
    for line in text.split("\n"):
        set_in = len(line) - len(line.lstrip(" "))
        mark = re.match(r"(`{3,}|~{3,})", line.lstrip())
        if fence:
            out.append(" " * shift + line if line else line)
            if mark and mark[1].startswith(fence):
                fence = ""
            continue
        if line.strip() and not set_in:
            inside = bool(item.match(line))
        shift = 0 if not inside or set_in < 2 else 4 - set_in if set_in < 4 else max(8 - set_in, 0)
        if mark:
            fence = mark[1]
        if item.match(line) and out and out[-1].strip() and out[-1][0] != " " and not item.match(out[-1]):
            out.append("")
        out.append(" " * shift + line if line.strip() else line)
    return "\n".join(out)
