"""The table of Unreal symbols (engines/unreal/symbols.csv) and the rules that read it: 6, 61, and A1 to A3."""
import csv
import functools
import pathlib
import re
from dataclasses import dataclass

from .declarations import U_MACROS
from .model import CORE_INCLUDES, CORE_MODULE, Plugin
from .tokens import close_of, spell, split

COLUMNS = ["symbol", "kind", "include", "module", "versions", "page", "evidence"]
KINDS = ("class", "struct", "enum", "type", "template", "delegate", "macro", "function", "member", "value")


@dataclass(frozen=True)
class Symbol:
    symbol: str
    kind: str
    include: str  # alternatives parted by ';'; *.generated.h is the header's own
    module: str
    versions: str
    page: str  # '' where no page is known
    evidence: str
    line: int

    @property
    def includes(self) -> list[str]:
        return self.include.split(";")


@functools.lru_cache(maxsize=8)
def read_rows(text: str):
    """(columns, rows, lines that are no rows) of a table's text."""
    lines = list(csv.reader(text.splitlines()))
    rows = [Symbol(*row, number) for number, row in enumerate(lines[1:], 2) if len(row) == len(COLUMNS)]
    return lines[0], rows, [number for number, row in enumerate(lines[1:], 2) if len(row) != len(COLUMNS)]


class Table:
    def __init__(self, path: pathlib.Path):
        self.path, self.full_path = path.name, path.resolve().as_posix()
        self.columns, self.rows, self.bad_lines = read_rows(path.read_text(encoding="utf-8"))
        self.by_name = {row.symbol: row for row in self.rows}
        self.module_of = {include: row.module for row in self.rows for include in row.includes}
        self.member_names = {row.symbol.rsplit("::", 1)[-1] for row in self.rows if "::" in row.symbol}
        self.macros = {row.symbol for row in self.rows if row.kind == "macro"}
        self.classes = {row.symbol.split("::")[0] for row in self.rows}


def owned(plugin: Plugin, include: str) -> bool:
    """Includes that are no engine headers: the plugin's, the core's, the standard library's."""
    return include.endswith(".generated.h") or include.startswith(CORE_INCLUDES) or "." not in include or bool(plugin.header(include))


def code(file):
    """(index, token) of the words of a file that are code: not in the arguments of U-macros."""
    skip = 0
    for at, token in enumerate(file.tokens):
        if at >= skip and token.kind == "word":
            if token.text in U_MACROS + ("UMETA",) and at + 1 < len(file.tokens) and file.tokens[at + 1].text == "(":
                skip = close_of(file.tokens, at + 1)
            yield at, token


def r6(plugin: Plugin):
    for file in plugin.written:
        reached = plugin.reached(file)
        for include, line in file.includes:
            if include.split("/")[-1].startswith("Consac") and not include.endswith(".generated.h") and not plugin.header(include):
                yield file.path, line, f"no header '{include}' in the plugin"
        reached |= {"*.generated.h" for include in reached if include.endswith(".generated.h")}
        told = set()
        for at, token in code(file):
            if at and file.tokens[at - 1].text in (".", "->", "::"):
                continue
            row = plugin.symbols.by_name.get(token.text)
            declared = at and file.tokens[at - 1].text in ("class", "struct") and file.tokens[at + 1].text == ";"
            if declared:
                told.add(token.text)
            if row and row.kind != "member" and token.text not in told and not set(row.includes) & reached:
                told.add(token.text)
                yield file.path, token.line, f'{token.text} is used without its header; add #include "{row.includes[0]}"'


def r61(plugin: Plugin):
    builds = {build.module: build for build in plugin.builds}
    for file in plugin.written:
        build = builds.get(file.module)
        for include, line in file.includes if build else ():
            header = plugin.header(include)
            module = plugin.symbols.module_of.get(include) or (header.module if header else None)
            if include.startswith(CORE_INCLUDES):
                module = next((m for m, prefixes in plugin.learn_modules.items() if include.startswith(prefixes)), CORE_MODULE)
            public = {name for name, _, _ in build.public}
            if module and module != file.module:
                if module not in public | {name for name, _, _ in build.private}:
                    yield file.path, line, f"'{include}' is of module {module}; add it to {build.path}"
                elif file.public and file.is_header and module not in public:
                    yield file.path, line, f"'{include}' in a public header: {module} belongs into PublicDependencyModuleNames of {build.path}"


NOT_A_TYPE = ("return", "else", "new", "delete", "case", "throw", "goto", "co_return", "co_await", "and", "or", "not")
BUILTIN_MACROS = {"NULL", "__VA_ARGS__", "LOCTEXT_NAMESPACE"}


def declared_names(plugin: Plugin) -> set[str]:
    """Every name that the plugin declares, by the shape of a declaration; with the words of the core's headers."""
    names = set(plugin.core_words) | set(plugin.by_name) | set(plugin.delegates)
    for file in plugin.files:
        for at, token in enumerate(file.tokens):
            if token.kind == "directive":
                found = re.match(r"#\s*define\s+(\w+)", token.text)
                names |= {found.group(1)} if found else set()
            elif token.kind == "word" and 0 < at < len(file.tokens) - 1:
                before, after = file.tokens[at - 1], file.tokens[at + 1].text
                typed = before.kind == "word" and before.text not in NOT_A_TYPE or before.text in (">", "*", "&")
                parameter = before.text in ("typename", "class") and after in (">", ",")  # of a template
                if parameter or typed and after in (";", "=", "{", "(", ",", ")", "[", ":"):
                    names.add(token.text)
        for at in file.macros("IMPLEMENT_SIMPLE_AUTOMATION_TEST", "DECLARE_LOG_CATEGORY_EXTERN"):
            names.add(file.tokens[at + 2].text)
        for at in file.macros("DECLARE_STATS_GROUP", "DECLARE_FLOAT_ACCUMULATOR_STAT"):
            names.add(spell(split(file.tokens[at + 2:close_of(file.tokens, at + 1)])[1]))
        for type_ in file.types:
            if type_.keyword == "enum":
                names |= {t.text for t in type_.body if t.kind == "word"}
    return names - set(plugin.symbols.by_name)


def a1(plugin: Plugin):
    table, own = plugin.symbols, declared_names(plugin)
    functions = table.member_names | set(table.by_name)
    for file in plugin.written:
        tokens, told = file.tokens, set()
        for at, token in code(file):
            text = token.text
            before = tokens[at - 1].text if at else ""
            after = tokens[at + 1].text if at + 1 < len(tokens) else ""
            scope = tokens[at - 2].text if before == "::" and at > 1 else ""
            name, good = text, True
            if scope in ("consac", "std") or text in own and scope not in table.classes:
                continue
            if scope in table.classes and scope not in own:
                name, good = f"{scope}::{text}", f"{scope}::{text}" in table.by_name
            elif re.fullmatch(r"[FUAETIS][A-Z]\w+|[A-Z][A-Z0-9]*_[A-Z0-9_]+", text) and not scope:
                good = text in functions or text in BUILTIN_MACROS or re.fullmatch(r"CONSAC\w*", text)
            elif before in (".", "->") and re.match(r"b?[A-Z]", text):
                good = text in table.member_names or text in table.macros
            elif after in ("(", "<") and re.match(r"[A-Z]\w*[a-z]", text) and (not scope or scope == "Super"):
                good = text in functions
            if not good and name not in told:
                told.add(name)
                yield file.path, token.line, f"{name} is not in {table.path}; use what is there, or add it with its source"


def a2(plugin: Plugin):
    for file in plugin.written:
        for include, line in file.includes:
            if include not in plugin.symbols.module_of and not owned(plugin, include):
                yield file.path, line, f"header '{include}' is not in {plugin.symbols.path}; use what is there, or add it with its source"


def a3(plugin: Plugin):
    table = plugin.symbols
    if table.columns != COLUMNS:
        yield table.full_path, 1, f"the columns are {','.join(COLUMNS)}"
    for line in table.bad_lines:
        yield table.full_path, line, f"a row has {len(COLUMNS)} cells"
    seen, modules = set(), {}
    for row in table.rows:
        if row.symbol in seen:
            yield table.full_path, row.line, f"{row.symbol} is there twice; remove one row"
        seen.add(row.symbol)
        for name in ("symbol", "kind", "include", "module", "versions", "evidence"):
            if not getattr(row, name):
                yield table.full_path, row.line, f"{row.symbol}: the cell '{name}' is empty; fill it"
        if row.kind not in KINDS:
            yield table.full_path, row.line, f"{row.symbol}: kind '{row.kind}' is none of {', '.join(KINDS)}"
        if not re.fullmatch(r"\d\.\d+-\d\.\d+", row.versions):
            yield table.full_path, row.line, f"{row.symbol}: versions '{row.versions}' is no range such as 5.3-5.6"
        for include in row.includes:
            if modules.setdefault(include, row.module) != row.module:
                yield table.full_path, row.line, f"{include} is of module {modules[include]} in another row, of {row.module} here"
