"""A public C++ header as a page: what stands in `///`, `///<` and opening comments, beside the declarations. It reads what this
repository's style writes, not all of C++; what it cannot take apart is shown as it stands."""
import re
from typing import NamedTuple

from .prose import cell, code, prose

TYPE = re.compile(r"(?:typedef\s+)?(enum class|enum|class|struct|union)\s+(?:\[\[[^\]]*\]\]\s*|alignas\([^)]*\)\s*)?(\w+)")
NAMELESS = re.compile(r"(typedef\s+)?(enum|struct|union)\s*\{")
COMMENT = re.compile(r"//[/<]*\s?(.*)$")


class Entry(NamedTuple):
    """One declaration with what is said of it."""
    doc: list[str]
    lines: list[str]  # without what is said behind them
    said: list[str]   # behind them


def bare(line: str) -> str:
    """A line without strings and comments, for counting its brackets."""
    return re.sub(r"//.*$", "", re.sub(r'"(?:[^"\\]|\\.)*"|\'(?:[^\'\\]|\\.)*\'', '""', line))


def depth(line: str) -> int:
    return sum({"(": 1, "{": 1, "[": 1, ")": -1, "}": -1, "]": -1}.get(c, 0) for c in bare(line))


def entries(lines: list[str]) -> list[Entry | str]:
    """Declarations in order; a str is a free comment or an access label."""
    found: list[Entry | str] = []
    doc: list[str] = []
    note: list[str] = []
    i = 0
    while i < len(lines):
        line = lines[i].strip()
        i += 1
        if line.startswith("///<") and found and isinstance(found[-1], Entry):
            found[-1].said.append(COMMENT.match(line)[1])
            continue
        if line.startswith("///"):
            doc.append(line[3:].removeprefix(" "))
            continue
        if line.startswith("//") or line.startswith(("/*", "*")):
            note.append(line.lstrip("/* ").rstrip("/* "))
            continue
        if note:
            found.append(" ".join(note))
            note = []
        if not line:
            doc = []
            continue
        if line in ("public:", "private:", "protected:"):
            found.append(line)
            continue
        if line.startswith("#") and not (line.startswith("#define") and doc):
            while line.endswith("\\") and i < len(lines):
                line, i = lines[i].strip(), i + 1
            continue
        if re.match(r"(inline )?namespace\b|extern \"C\" \{|\}", line):
            continue
        taken, said, open_ = [], [], 0
        i -= 1
        while i < len(lines):
            raw = lines[i]
            i += 1
            open_ += depth(raw)
            spoken = re.search(r"\s*//[/<]*\s?(.*)$", raw) if '"//' not in raw else None
            # Behind a line within braces it is said of a member, or within a function's body of how that works.
            if spoken and not any(bare(line).rstrip().endswith("{") for line in taken) and not TYPE.match(raw.strip()):
                said += [] if spoken[1].startswith("NOLINT") else [spoken[1]]
                raw = raw[:spoken.start()]
            taken.append(raw)
            end = bare(raw).rstrip()
            if line.startswith("#define"):
                if not raw.endswith("\\"):
                    break
            elif open_ <= 0 and end.endswith((";", "}", ",")) and not re.match(r"\s*(template|requires)\b[^;{]*$", end):
                break
        found.append(Entry(doc, taken, said))
        doc = []
    if note:
        found.append(" ".join(note))
    return found


def joined(entry: Entry) -> str:
    return "\n".join(entry.lines)


def without_templates(text: str) -> str:
    """What stands outside < >, so that a function type in a template's arguments is no function."""
    before = None
    while before != text:
        before, text = text, re.sub(r"<[^<>()]*(?:\([^()]*\)[^<>()]*)*>", "", text)
    return text


def signature(entry: Entry) -> str:
    """A declaration without the body of a function."""
    text = joined(entry).rstrip()
    if text.startswith("#define"):
        return text
    level = 0
    for place, c in enumerate(text):
        level += {"(": 1, ")": -1, "[": 1, "]": -1}.get(c, 0)
        if level == 0 and c == "{" and is_function(entry):
            text = text[:place].rstrip()
            text = re.sub(r"\)\s*:\s[^:].*$", ")", text, flags=re.S)
            return dedented(text) + ";"
    return dedented(text)


def dedented(text: str) -> str:
    lines = text.split("\n")
    margin = len(lines[0]) - len(lines[0].lstrip())
    return "\n".join(line[min(margin, len(line) - len(line.lstrip())):] for line in lines)


def is_function(entry: Entry) -> bool:
    text = without_templates(re.sub(r"requires\s*\(.*?\)\)?\s", "", joined(entry), flags=re.S))
    head = re.split(r"=(?!=)|\{|;", text.replace("operator=", "operator"), maxsplit=1)[0]
    return "(" in head and not re.search(r"\(\s*\*+\s*\w*\s*\)|^\s*using\b|^\s*typedef\b", head)


def name_of(entry: Entry) -> str:
    text = joined(entry).strip()
    if found := re.match(r"#define\s+(\w+)", text):
        return found[1]
    text = re.sub(r"^template\s*<.*?>\s*\n", "", text, flags=re.S)
    if found := re.match(r"(?:concept|using)\s+(\w+)", text):
        return found[1]
    if found := NAMELESS.match(text):
        return re.search(r"\}\s*(\w*);", text)[1]
    if found := TYPE.match(text):
        return found[2]
    if found := re.search(r"(operator\s*(?:\(\)|\[\]|[^\s(]+))\s*\(", text):
        return found[1].replace(" ", "")
    text = without_templates(re.sub(r"requires\s*\(.*?\)\)?\s", "", text, flags=re.S))
    if is_function(entry):
        return re.findall(r"(~?\w+)\s*\(", text)[0]
    if found := re.search(r"\(\s*\*+\s*(\w+)\s*\)", text):
        return found[1]
    words = re.findall(r"\w+", re.split(r"=|\{|;|\[", text, maxsplit=1)[0])
    return words[-1] if words else text[:20]


def of_no_interest(entry: Entry, owner: str) -> bool:
    """Nothing is said of it, and its name says it all: what moves, destroys or befriends; a mere announcement of a type."""
    text = joined(entry).strip()
    return not entry.doc and not entry.said and bool(
        re.match(r"(virtual )?~|friend\b|static_assert|CONSAC_\w+\(|(class|struct|enum class)\s+\w+;", text) or "operator=" in text
        or (owner and re.match(rf"(explicit )?{owner}\s*\(\s*(const )?{owner}\s*&", text)) or text in ("};", "}", ";"))


def body_of(entry: Entry) -> list[str] | None:
    """The lines between the braces of a type that has some on lines of their own."""
    text = joined(entry)
    stripped = re.sub(r"^\s*template\s*<.*?>\s*\n", "", text, flags=re.S).strip()
    if not (TYPE.match(stripped) or NAMELESS.match(stripped)) or len(entry.lines) < 2 or "{" not in text:
        return None
    first = next(i for i, line in enumerate(entry.lines) if bare(line).rstrip().endswith("{"))
    return entry.lines[first + 1:-1]


def table(rows: list[Entry]) -> list[str]:
    """Fields, constants, enumerators."""
    out = ["| | |", "|---|---|"]
    for row in rows:
        declared = re.sub(r"\s+", " ", joined(row)).strip().rstrip(";,").strip()
        out.append(f"| {cell(code(declared))} | {cell(prose(' '.join(row.doc + row.said)))} |")
    return out + [""]


def members(lines: list[str], owner: str, shown: bool, enum: bool) -> list[str]:
    out: list[str] = []
    fields: list[Entry] = []
    last = ""
    for entry in entries(lines):
        if isinstance(entry, str):
            shown = {"public:": True, "private:": False, "protected:": True}.get(entry, shown)
            continue
        if not shown or of_no_interest(entry, owner):
            continue
        if enum or not is_function(entry) and body_of(entry) is None:
            fields.append(entry)
            continue
        if fields:
            out, fields = out + table(fields), []
        last, lines_ = described(entry, 3, last, owner)
        out += lines_
    return out + (table(fields) if fields else [])


def described(entry: Entry, level: int, last: str, owner: str = "") -> tuple[str, list[str]]:
    """(its name, the lines of one declaration); overloads stand below one heading."""
    name = name_of(entry)
    out = [] if name in ("", last) else [f"{'#' * level} {code(name)}", ""]
    body = body_of(entry)
    said = prose("\n".join(entry.doc + entry.said))
    if body is None:
        return name, [*out, "```cpp", signature(entry), "```", "", said, ""]
    head = dedented("\n".join(entry.lines[:len(entry.lines) - len(body) - 1])).rstrip().removesuffix("{").rstrip()
    kind = TYPE.search(head)[1] if TYPE.search(head) else head.split()[-1]
    inner = members(body, name, kind != "class", kind.startswith("enum")) if level < 4 else []
    if not name:  # a row of constants, which belongs to what stands before it
        return last, [said, "", *inner]
    return name, [*out, "```cpp", head, "```", "", said, "", *inner]


def opening(lines: list[str]) -> tuple[list[str], int]:
    """What a header says of itself at its beginning, and where that ends."""
    i = 0
    while i < len(lines) and (not lines[i].strip() or lines[i].startswith(("#pragma", "#ifndef", "#define"))):
        i += 1
    said = []
    while i < len(lines) and lines[i].startswith("//"):
        said.append(lines[i].lstrip("/").removeprefix(" "))
        i += 1
    return said, i


def first_sentence(text: str) -> str:
    said = " ".join(line.strip() for line in opening(text.splitlines())[0])
    found = re.match(r".*?[.:](?=\s|$)", said)
    return (found[0] if found else said).rstrip(":.") + "."


def include_name(path: str) -> str:
    """The path that a user writes behind #include."""
    return path.split("include/", 1)[1]


def module_of(path: str) -> str:
    """"core/base", "learn/algo", "host": the folder behind include/, with its part where that is not its name already."""
    part, inside = path.split("/include/", 1)
    module = inside.rpartition("/")[0].removeprefix("consac").strip("/")
    name = part.rpartition("/")[2]
    return module if module.split("/")[0] == name else f"{name}/{module}".strip("/")


def page(path: str, text: str) -> str:
    lines = text.splitlines()
    said, start = opening(lines)
    scope = re.search(r"^namespace ([\w:]+) \{", text, re.M)
    out = [f"# {include_name(path)}", "", "```cpp", f'#include "{include_name(path)}"' + (f"  // namespace {scope[1]}" if scope else ""), "```", "", prose("\n".join(said)), ""]
    constants: list[Entry] = []
    last = ""
    for entry in entries(lines[start:]):
        if isinstance(entry, str) or of_no_interest(entry, ""):
            continue
        if not is_function(entry) and body_of(entry) is None and not re.match(r"\s*(using|template|#define|enum|struct|class|typedef|concept)", joined(entry)):
            constants.append(entry)
            continue
        last, described_ = described(entry, 2, last)
        out += described_
    if constants:
        out += ["## Constants", "", *table(constants)]
    return "\n".join(out) + "\n"
