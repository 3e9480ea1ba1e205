"""Declarations as a file's tokens say them: reflected types with their properties and functions, delegates, bodies of functions.
A parser for the way Unreal headers are written, not for all of C++."""
from dataclasses import dataclass, field

from .tokens import angle_close, close_of, spell, split, string_value

TYPE_MACROS = ("UCLASS", "USTRUCT", "UENUM", "UINTERFACE")
MEMBER_MACROS = ("UPROPERTY", "UFUNCTION")
U_MACROS = TYPE_MACROS + MEMBER_MACROS + ("UDELEGATE", "GENERATED_BODY", "GENERATED_UCLASS_BODY",
                                          "GENERATED_USTRUCT_BODY", "GENERATED_UINTERFACE_BODY")


@dataclass
class Parameter:
    type: str
    name: str
    default: list
    line: int


@dataclass
class Member:
    """A property, a function, or a plain declaration of a class body."""
    kind: str  # UPROPERTY, UFUNCTION, '' where there is no macro
    specifiers: dict  # name -> value ('' where it has none), as written
    meta: dict
    type: str
    name: str
    line: int
    access: str
    conditions: tuple
    tokens: list
    parameters: list | None = None  # None: a variable
    words_before: tuple = ()  # static, virtual, ...
    words_after: tuple = ()  # const, override, ...
    body: list | None = None  # tokens between the braces
    initialised: bool = False
    array: bool = False  # T Name[3]
    bits: bool = False  # T Name : 1
    template: bool = False

    def has(self, *names: str) -> bool:
        return any(name in self.specifiers for name in names)


@dataclass
class Type:
    kind: str  # UCLASS ... or '' for a plain class or struct
    keyword: str
    specifiers: dict
    meta: dict
    name: str
    line: int
    bases: list  # names, templates with arguments
    api: str
    conditions: tuple
    nested: bool
    in_namespace: bool
    template: bool
    body: list
    members: list = field(default_factory=list)
    underlying: str = ""
    scoped: bool = False


@dataclass
class Delegate:
    macro: str
    arguments: list  # of token lists
    line: int

    @property
    def multicast(self) -> bool:
        return "MULTICAST" in self.macro


def read_specifiers(tokens: list) -> tuple[dict, dict]:
    """(specifiers, meta) of a macro's arguments."""
    specifiers, meta = {}, {}
    for part in split(tokens):
        if not part:
            continue
        name, value = part[0].text, part[2:] if len(part) > 1 and part[1].text == "=" else []
        if name == "meta":
            inner = value[1:-1] if value and value[0].text == "(" else value
            for entry in split(inner):
                meta[entry[0].text] = _value(entry[2:])
        else:
            specifiers[name] = _value(value)
    return specifiers, meta


class Quoted(str):
    """A value that was written as a string literal."""


def _value(tokens: list) -> str:
    return Quoted(string_value(tokens[0])) if len(tokens) == 1 and tokens[0].kind == "string" else spell(tokens)


def read_parameters(tokens: list) -> list:
    """Parameters between the parentheses of a function."""
    found = []
    for part in split(tokens):
        default = []
        for at, token in enumerate(part):
            if token.text == "=":
                part, default = part[:at], part[at + 1:]
                break
        if not part or spell(part) == "void":
            continue
        if part[-1].kind == "word" and len(part) > 1 and part[-2].text != "::":
            found.append(Parameter(spell(part[:-1]), part[-1].text, default, part[0].line))
        else:
            found.append(Parameter(spell(part), "", default, part[0].line))
    return found


PREFIX_WORDS = ("static", "virtual", "inline", "explicit", "constexpr", "friend", "mutable", "FORCEINLINE")


def _member(kind, specifiers, meta, tokens, access, body, line) -> Member:
    """One declaration of a class body, without its macro and without the ';'."""
    template = bool(tokens) and tokens[0].text == "template"
    if template and len(tokens) > 1:
        tokens = tokens[angle_close(tokens, 1) + 1:]
    words = []
    while tokens and (tokens[0].text in PREFIX_WORDS or tokens[0].text.endswith("_API")):
        words.append(tokens[0].text)
        tokens = tokens[1:]
    member = Member(kind, specifiers, meta, "", "", line, access, tokens[0].conditions if tokens else (), tokens,
                    words_before=tuple(words), body=body, template=template)
    end = len(tokens)
    for at, token in enumerate(tokens):
        if token.text == "=" and at and tokens[at - 1].text != "operator":
            member.initialised, end = True, at
            break
        if token.text == "(" and at and tokens[at - 1].kind == "word" and tokens[at - 1].text not in ("decltype", "UPARAM"):
            close = close_of(tokens, at)
            member.parameters = read_parameters(tokens[at + 1:close])
            member.words_after = tuple(t.text for t in tokens[close + 1:])
            end = at
            break
    head = tokens[:end]
    for at, token in enumerate(head):
        if token.text == "{":
            member.initialised, head = True, head[:at]
            break
    for at, token in enumerate(head):
        if token.text == ":":
            member.bits, head = True, head[:at]
            break
    if head and head[-1].text == "]":
        member.array = True
        head = head[:next((at for at, t in enumerate(head) if t.text == "["), len(head))]
    if head and head[-1].kind == "word":
        member.name, head = head[-1].text, head[:-1]
        if head and head[-1].text == "~":
            member.name, head = "~" + member.name, head[:-1]
    member.type = spell(head)
    return member


def read_members(body: list, struct: bool) -> list:
    """Declarations of a class body; nested types are skipped (they are types of their own)."""
    members, at, access = [], 0, "public" if struct else "private"
    macro, start = None, 0
    while at < len(body):
        token = body[at]
        following = body[at + 1].text if at + 1 < len(body) else ""
        if token.kind == "directive" or token.text == ";":
            at += 1
        elif token.text in ("public", "protected", "private") and following == ":":
            access, at = token.text, at + 2
        elif token.text in U_MACROS or (token.text.startswith("GENERATED_") and following == "("):
            close = close_of(body, at + 1)
            if token.text in MEMBER_MACROS:
                macro, start = (token.text, *read_specifiers(body[at + 2:close])), token.line
            elif token.text.startswith("GENERATED_"):
                access = "public" if struct else "private"
            at = close + 1
        else:
            end, block = at, None
            while end < len(body) and body[end].text != ";":
                text = body[end].text if body[end].kind == "punct" else ""
                if text in ("(", "["):
                    end = close_of(body, end)
                elif text == "{":
                    close = close_of(body, end)
                    head = [t.text for t in body[at:end]]
                    if ")" in head and "=" not in head or head[:1] in (["class"], ["struct"], ["enum"], ["union"]):
                        block = body[end + 1:close]
                        break
                    end = close
                end += 1
            piece = [t for t in body[at:end] if t.kind != "directive"]
            if piece and piece[0].text not in ("class", "struct", "enum", "union", "using", "friend", "typedef") or macro:
                kind, specifiers, meta = macro or ("", {}, {})
                if piece:
                    members.append(_member(kind, specifiers, meta, piece, access, block, start if macro else piece[0].line))
                macro = None
            at = (close_of(body, end) if block is not None else end) + 1
    return members


def read_types(tokens: list) -> list:
    """All types of a header, nested ones too."""
    types, scopes, macro, at = [], [], None, 0
    while at < len(tokens):
        token = tokens[at]
        if token.text in TYPE_MACROS and at + 1 < len(tokens) and tokens[at + 1].text == "(":
            close = close_of(tokens, at + 1)
            macro = (token.text, token.line, *read_specifiers(tokens[at + 2:close]), at)
            at = close
        elif token.text == "namespace":
            while at < len(tokens) and tokens[at].text not in ("{", ";", "="):
                at += 1
            if at < len(tokens) and tokens[at].text == "{":
                scopes.append(("namespace", close_of(tokens, at)))
        elif token.text in ("class", "struct", "enum") and not (at and tokens[at - 1].text in ("<", ",", "enum", "friend")):
            found = _type(tokens, at, macro, scopes)
            if found:
                type_, opening, closing = found
                types.append(type_)
                scopes.append(("type", closing))
                at, macro = opening, None
        at += 1
        scopes = [scope for scope in scopes if scope[1] > at - 1]
    return types


def _type(tokens, at, macro, scopes):
    """(type, index of '{', index of '}') of a definition that begins at a keyword; None for a declaration."""
    keyword, end = tokens[at].text, at + 1
    scoped = keyword == "enum" and tokens[end].text in ("class", "struct")
    end += scoped
    while end < len(tokens) and tokens[end].text not in ("{", ";", "(", ")", ">", "="):
        end = angle_close(tokens, end) if tokens[end].text == "<" else end
        end += 1
    if end >= len(tokens) or tokens[end].text != "{":
        return None
    head = [t for t in tokens[at + 1 + scoped:end] if t.kind != "directive"]
    colon = next((i for i, t in enumerate(head) if t.text == ":"), len(head))
    names = [t.text for t in head[:colon] if t.text != "final"]
    bases = [spell([t for t in part if t.text not in ("public", "protected", "private", "virtual")])
             for part in split(head[colon + 1:])]
    close = close_of(tokens, end)
    kind, line, specifiers, meta, first = macro or ("", tokens[at].line, {}, {}, at)
    before = first - 1
    template = before >= 0 and tokens[before].text == ">" and any(t.text == "template" for t in tokens[max(0, first - 30):first])
    body = tokens[end + 1:close]
    type_ = Type(kind, keyword, specifiers, meta, names[-1] if names else "", line, bases,
                 next((n for n in names if n.endswith("_API")), ""), tokens[at].conditions,
                 any(s[0] == "type" for s in scopes), any(s[0] == "namespace" for s in scopes), template, body,
                 underlying=bases[0] if keyword == "enum" and bases else "", scoped=scoped)
    if keyword != "enum":
        type_.members = read_members(body, keyword == "struct")
    return type_, end, close


def read_delegates(tokens: list) -> list:
    """DECLARE_DYNAMIC_* of a file."""
    found = []
    for at, token in enumerate(tokens[:-1]):
        if token.kind == "word" and token.text.startswith("DECLARE_DYNAMIC_") and tokens[at + 1].text == "(":
            found.append(Delegate(token.text, split(tokens[at + 2:close_of(tokens, at + 1)]), token.line))
    return found


@dataclass
class Body:
    """A function defined outside its class, or a free function, in a .cpp file."""
    owner: str
    name: str
    line: int
    parameters: list
    tokens: list
    initialisers: list  # between ')' and '{'


def read_bodies(tokens: list):
    """Function bodies of a .cpp file."""
    at = 0
    while at < len(tokens):
        if tokens[at].text == "namespace":
            while at < len(tokens) and tokens[at].text not in ("{", ";", "="):
                at += 1
        elif tokens[at].text == "(" and at and tokens[at - 1].kind == "word":
            close = close_of(tokens, at)
            end = close + 1
            while end < len(tokens) and tokens[end].text not in ("{", ";", "=", ")", ",") and tokens[end].kind != "directive":
                if tokens[end].text == "(":
                    end = close_of(tokens, end)
                    if end + 1 < len(tokens) and tokens[end + 1].text == ",":
                        end += 1
                end += 1
            if end < len(tokens) and tokens[end].text == "{":
                finish = close_of(tokens, end)
                owner = tokens[at - 3].text if at > 2 and tokens[at - 2].text == "::" else ""
                if at > 3 and tokens[at - 2].text == "~" and tokens[at - 3].text == "::":
                    owner = tokens[at - 4].text
                name = ("~" if tokens[at - 2].text == "~" else "") + tokens[at - 1].text
                yield Body(owner, name, tokens[at - 1].line, read_parameters(tokens[at + 1:close]),
                           tokens[end + 1:finish], tokens[close + 1:end])
                at = finish
            else:
                at = close
        at += 1
