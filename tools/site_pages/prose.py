"""Comments are plain text; these make Markdown of them that shows what they say."""
import re

# What is code in a comment: shapes and ranges, names with an underscore or a scope, k-constants, calls, flags.
NAME = re.compile(r"(?<![\w`.\"/-])(\[[^\[\]()`]*[\])]|(?:\w+::)+~?\w+(?:\(\))?|k[A-Z]\w+|\w+\(\)|[A-Za-z]\w*_\w+|--[a-z][\w-]+)(?![\w`/])")


def escaped(text: str) -> str:
    return re.sub(r"([\\*_<>\[\]#|~])", lambda found: "&lt;" if found[0] == "<" else "&gt;" if found[0] == ">" else "\\" + found[0], text)


def code(text: str) -> str:
    fence = "``" if "`" in text else "`"
    return f"{fence}{text}{fence}"


def line_of(text: str) -> str:
    """A stretch of text: what stands between ` stays, names become code, all else is escaped."""
    out = []
    for i, part in enumerate(text.split("`")):
        if i % 2:
            out.append(code(part))
        else:
            out += [code(piece) if j % 2 else escaped(piece) for j, piece in enumerate(NAME.split(part))]
    return "".join(out)


def prose(text: str) -> str:
    """Paragraphs; lines that are set in by three blanks or more are shown as they stand."""
    out: list[str] = []
    for paragraph in re.split(r"\n\s*\n", text.strip("\n")):
        for shown, lines in runs(paragraph.split("\n")):
            if shown:
                out.append("```cpp\n" + "\n".join(line[2:] for line in lines) + "\n```")
            elif lines and any(lines):
                out.append(line_of("\n".join(lines)))
    return "\n\n".join(out)


def runs(lines: list[str]) -> list[tuple[bool, list[str]]]:
    found: list[tuple[bool, list[str]]] = []
    for line in lines:
        shown = line.startswith("  ")
        if not found or found[-1][0] != shown:
            found.append((shown, []))
        found[-1][1].append(line)
    return found


def cell(text: str) -> str:
    """Markdown that may stand in a table."""
    return text.replace("\n", " ").replace("\\|", "|").replace("|", "\\|")
