"""A small C++ tokenizer: comments go, strings and raw strings stay whole, every token knows its line and the #if
blocks it stands in. It expands no macros and evaluates no condition. Also reads C# build files well enough."""
import functools
import re
from dataclasses import dataclass


@dataclass(frozen=True)
class Token:
    kind: str  # word, number, string, char, punct, directive
    text: str  # of a directive: without comments, continuation lines joined
    line: int
    conditions: tuple = ()  # the #if conditions around it, outermost first


BLANK = re.compile(r"\s+")
CONTINUED = re.compile(r"\\\r?\n")
LINE_COMMENT = re.compile(r"//(?:\\\r?\n|[^\n])*")
BLOCK_COMMENT = re.compile(r"/\*.*?(?:\*/|\Z)", re.S)
RAW_STRING = re.compile(r'(?:u8|[uUL])?R"([^()\\\s]{0,16})\((.*?)\)\1"', re.S)
STRING = re.compile(r'(?:u8|[uUL@$])?"(?:\\.|[^"\\\n])*"', re.S)
CHAR = re.compile(r"(?:u8|[uUL])?'(?:\\.|[^'\\\n])+'", re.S)
NUMBER = re.compile(r"\.?\d(?:[eEpP][+-]|'(?=\w)|[\w.])*")
WORD = re.compile(r"[A-Za-z_]\w*")
PUNCT = re.compile(r"::|->|\.\.\.|&&|\|\||==|!=|<=|[-+*/|&^]=|\+\+|--|.", re.S)
ORDER = (("blank", BLANK), ("blank", CONTINUED), ("comment", LINE_COMMENT), ("comment", BLOCK_COMMENT),
         ("string", RAW_STRING), ("string", STRING), ("char", CHAR), ("number", NUMBER), ("word", WORD),
         ("punct", PUNCT))


def _directive(text: str, start: int) -> tuple[str, int]:
    """(a directive without comments and continuations, where it ends)."""
    out, at = [], start
    while at < len(text) and text[at] != "\n":
        for pattern, put in ((CONTINUED, " "), (BLOCK_COMMENT, " "), (LINE_COMMENT, ""), (STRING, None), (CHAR, None)):
            found = pattern.match(text, at)
            if found:
                out.append(found.group() if put is None else put)
                at = found.end()
                break
        else:
            out.append(text[at])
            at += 1
    return " ".join("".join(out).split()), at


def _enter(conditions: list, directive: str) -> None:
    """Follows #if, #else and #endif."""
    word, _, rest = directive.lstrip("# ").partition(" ")
    if word in ("if", "ifdef", "ifndef"):
        conditions.append({"if": "", "ifdef": "defined ", "ifndef": "!defined "}[word] + rest)
    elif word == "elif" and conditions:
        conditions[-1] = rest
    elif word == "else" and conditions:
        conditions[-1] = f"!({conditions[-1]})"
    elif word == "endif" and conditions:
        conditions.pop()


@functools.lru_cache(maxsize=1024)
def tokenize(text: str) -> list[Token]:
    """All tokens of a file. The list is kept for the next call with this text: do not change it."""
    tokens, at, line, conditions, fresh = [], 0, 1, [], True
    while at < len(text):
        if fresh and text[at] == "#":
            directive, end = _directive(text, at)
            _enter(conditions, directive)
            tokens.append(Token("directive", directive, line, tuple(conditions)))
        else:
            for kind, pattern in ORDER:
                found = pattern.match(text, at)
                if found:
                    break
            end = found.end()
            if kind not in ("blank", "comment"):
                tokens.append(Token(kind, found.group(), line, tuple(conditions)))
                fresh = False
        newlines = text.count("\n", at, end)
        line += newlines
        fresh = fresh or (newlines > 0 and not text[at:end].strip())
        at = end
    return tokens


def string_value(token: Token) -> str:
    """The text of a string literal: raw strings by their delimiter, simple escapes undone."""
    raw = RAW_STRING.fullmatch(token.text)
    if raw:
        return raw.group(2)
    return re.sub(r"\\(.)", r"\1", token.text[token.text.index('"') + 1:-1])


OPEN = {"(": ")", "[": "]", "{": "}"}


def close_of(tokens: list[Token], start: int) -> int:
    """Index of the bracket that closes tokens[start], or the last index."""
    depth = 0
    for at in range(start, len(tokens)):
        text = tokens[at].text if tokens[at].kind == "punct" else ""
        if text in OPEN:
            depth += 1
        elif text in (")", "]", "}"):
            depth -= 1
            if depth == 0:
                return at
    return len(tokens) - 1


def angle_close(tokens: list[Token], start: int) -> int:
    """Index of the '>' that closes the '<' at start; start itself where it is a comparison."""
    depth, at = 0, start
    while at < len(tokens):
        text = tokens[at].text
        if text == "<":
            depth += 1
        elif text == ">":
            depth -= 1
            if depth == 0:
                return at
        elif text in "([" and text:
            at = close_of(tokens, at)
        elif text in (";", "{", "}", ")", "&&", "||"):
            return start
        at += 1
    return start


def split(tokens: list[Token], comma: str = ",") -> list[list[Token]]:
    """Parts between commas that stand in no bracket and no template argument list."""
    parts, part, at = [], [], 0
    while at < len(tokens):
        token, end = tokens[at], at
        if token.kind == "punct" and token.text in OPEN:
            end = close_of(tokens, at)
        elif token.text == "<" and at and tokens[at - 1].kind == "word":
            end = angle_close(tokens, at)
        elif token.text == comma:
            parts.append(part)
            part, at = [], at + 1
            continue
        part += tokens[at:end + 1]
        at = end + 1
    return parts + [part] if part or parts else []


def spell(tokens: list[Token]) -> str:
    """Tokens as one line of text, words parted by one space."""
    out = ""
    for token in tokens:
        out += (" " if out and out[-1].isalnum() and (token.text[0].isalnum() or token.text[0] == "_") else "") + token.text
    return out
