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
    """Paragraphs. Lines that are set in are shown as they stand, as an example is, where they begin a paragraph or follow a colon; behind other
    words they go on with these, and every line that is not set in begins anew: "Errors.  What ..."."""
    out: list[str] = []
    for paragraph in re.split(r"\n\s*\n", text.strip("\n")):
        lines = paragraph.split("\n")
        hanging = any(line.startswith("  ") and not before.startswith("  ") and not before.endswith(":") for before, line in zip(lines, lines[1:]))
        for shown, run in runs(lines, hanging):
            if shown:
                out.append("```cpp\n" + "\n".join(line[2:] for line in run) + "\n```")
            elif any(run):
                said = line_of("\n".join(line.strip() for line in run))
                out.append(re.sub(r"^([A-Z]\w*\.)\s+", r"**\1** ", said) if hanging else said)
    return "\n\n".join(out)


def runs(lines: list[str], hanging: bool) -> list[tuple[bool, list[str]]]:
    """(whether they are shown as they stand, lines that belong together)."""
    found: list[tuple[bool, list[str]]] = []
    for line in lines:
        set_in = line.startswith("  ")
        shown = set_in and not hanging
        if not found or (not set_in if hanging else found[-1][0] != shown):
            found.append((shown, []))
        found[-1][1].append(line)
    return found


def cell(text: str) -> str:
    """Markdown that may stand in a table."""
    return text.replace("\n", " ").replace("\\|", "|").replace("|", "\\|")
