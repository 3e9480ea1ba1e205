"""What a plugin folder says, read from its text: files with their includes and declarations, build files, descriptors."""
import functools
import json
import pathlib
import re
from dataclasses import dataclass, field

from .declarations import Body, read_bodies, read_delegates, read_types
from .tokens import Token, close_of, spell, split, string_value, tokenize

INCLUDE = re.compile(r'#\s*include\s*[<"]([^">]+)[">]')
CORE_MODULE = "ConsacCore"  # the engine-neutral core, copied in by tools/stage_unreal.py; not written for Unreal
CORE_INCLUDES = ("consac/", "worlds/")  # what includes of its headers begin with
LEARN_MODULES = {"ConsacLearn": ("consac/learn/", "consac/host/", "worlds/")}  # likewise, and what their headers begin with
CORE_MODULES = (CORE_MODULE, *LEARN_MODULES)
STAGED = "/Private/Staged/"  # what compiles them


@dataclass
class File:
    path: str  # in the plugin folder, with '/'
    text: str
    bom: bool
    utf8: bool
    tokens: list
    includes: list  # (path, line)
    module: str
    public: bool
    types: list = field(default_factory=list)
    delegates: list = field(default_factory=list)
    bodies: list = field(default_factory=list)  # of a .cpp

    @property
    def name(self) -> str:
        return self.path.rsplit("/", 1)[-1]

    @property
    def is_header(self) -> bool:
        return self.path.endswith(".h")

    def macros(self, *names: str):
        """Indices of the tokens that begin a call of one of the macros."""
        for at, token in enumerate(self.tokens[:-1]):
            if token.kind == "word" and token.text in names and self.tokens[at + 1].text == "(":
                yield at


@dataclass
class BuildFile:
    """What a .Build.cs says."""
    path: str
    class_name: str
    passes_target: bool
    public: list  # (module, line, whether under bBuildEditor)
    private: list
    settings: dict  # name -> value as written
    stages_files: bool = False  # beside the binaries
    defines: tuple = ()  # macros, as written

    @property
    def module(self) -> str:
        return self.path.rsplit("/", 1)[-1].removesuffix(".Build.cs")


def read_build(path: str, tokens: list) -> BuildFile:
    build = BuildFile(path, "", False, [], [], {})
    for at, token in enumerate(tokens):
        if token.text == "class" and at + 1 < len(tokens) and not build.class_name:
            build.class_name = tokens[at + 1].text
        elif token.text == "base" and [t.text for t in tokens[at + 1:at + 4]] == ["(", "Target", ")"]:
            build.passes_target = True
        elif token.text == "RuntimeDependencies":
            build.stages_files = True
        elif token.text in ("PublicDefinitions", "PrivateDefinitions") and at + 3 < len(tokens) and tokens[at + 3].text == "(":
            build.defines += tuple(string_value(t) for t in tokens[at + 3:close_of(tokens, at + 3)] if t.kind == "string")
        elif token.text in ("PublicDependencyModuleNames", "PrivateDependencyModuleNames",
                            "DynamicallyLoadedModuleNames") and at + 3 < len(tokens) and tokens[at + 3].text == "(":
            guarded = any(t.text == "bBuildEditor" for t in tokens[max(0, at - 12):at])
            names = [(string_value(t), t.line, guarded) for t in tokens[at + 3:close_of(tokens, at + 3)] if t.kind == "string"]
            (build.public if token.text.startswith("Public") else build.private).extend(names)
        elif at + 2 < len(tokens) and tokens[at + 1].text == "=" and token.kind == "word":
            end = at + 2
            while end < len(tokens) and tokens[end].text != ";":
                end += 1
            build.settings[token.text] = spell(tokens[at + 2:end])
    return build


@functools.lru_cache(maxsize=1024)
def read_file(path: str, data: bytes) -> File:
    """A source file from its bytes. Kept for the next call with these bytes: do not change it."""
    bom = data.startswith(b"\xef\xbb\xbf")
    try:
        text, utf8 = data[3 * bom:].decode("utf-8"), True
    except UnicodeDecodeError:
        text, utf8 = data[3 * bom:].decode("utf-8", "replace"), False
    text = text.replace("\r\n", "\n")
    tokens = tokenize(text)
    includes = [(found.group(1), t.line) for t in tokens if t.kind == "directive" for found in [INCLUDE.match(t.text)] if found]
    steps = path.split("/")
    module = steps[1] if steps[0] == "Source" and len(steps) > 2 else ""
    return File(path, text, bom, utf8, tokens, includes, module, "Public" in steps,
                read_types(tokens) if path.endswith((".h", ".cpp")) else [], read_delegates(tokens),
                list(read_bodies(tokens)) if path.endswith(".cpp") else [])


class Plugin:
    """All text of a plugin folder."""

    learn_modules = LEARN_MODULES

    def __init__(self, root: pathlib.Path):
        self.root = root
        self.files: list[File] = []
        self.builds: list[BuildFile] = []
        self.descriptors: list[tuple[str, str]] = []  # (path, text)
        self.symbols = None  # symbols.Table, set by check.py
        self.core_headers: list[tuple[str, list[Token]]] = []  # of a core outside of the plugin
        self.core_words: set[str] = set()
        for path in sorted(root.rglob("*")):
            name = path.relative_to(root).as_posix()
            if path.is_file() and not name.startswith(("Binaries/", "Intermediate/", "Saved/")) and "/ThirdParty/" not in name:
                self._read(path, name)
        self.by_leaf: dict[str, list[File]] = {}
        for file in self.files:
            self.by_leaf.setdefault(file.name, []).append(file)
        self.types = [(file, type_) for file in self.written for type_ in file.types]
        self.by_name = {type_.name: type_ for _, type_ in self.types}
        self.delegates = {spell(d.arguments[0]): d for file in self.written for d in file.delegates
                          if d.arguments and "RetVal" not in d.macro}
        self.delegates.update({spell(d.arguments[1]): d for file in self.written for d in file.delegates
                               if "RetVal" in d.macro and len(d.arguments) > 1})
        self.bodies = [(file, body) for file in self.written for body in file.bodies]
        for file, type_ in self.types:
            for member in type_.members:
                if member.body is not None:
                    self.bodies.append((file, Body(type_.name, member.name, member.line, member.parameters or [], member.body, [])))

    def _read(self, path: pathlib.Path, name: str) -> None:
        if name.endswith(".uplugin"):
            self.descriptors.append((name, path.read_text(encoding="utf-8", errors="replace")))
        elif name.endswith(".Build.cs"):
            self.builds.append(read_build(name, tokenize(path.read_text(encoding="utf-8", errors="replace"))))
        elif path.suffix in (".h", ".hpp", ".cpp", ".inl"):
            self.files.append(read_file(name, path.read_bytes()))

    @property
    def written(self) -> list[File]:
        """The files written for Unreal: all but those that are copied in."""
        return [f for f in self.files if STAGED not in f.path and (f.module not in CORE_MODULES or f.name == f.module + "Module.cpp")]

    @property
    def headers(self) -> list[File]:
        return [f for f in self.written if f.is_header]

    @property
    def sources(self) -> list[File]:
        return [f for f in self.written if f.path.endswith(".cpp")]

    def members(self, *kinds: str):
        """(file, type, member) of every UPROPERTY or UFUNCTION of reflected types."""
        for file, type_ in self.types:
            for member in type_.members:
                if member.kind in kinds:
                    yield file, type_, member

    def header(self, include: str) -> File | None:
        """The plugin's own header that an include names, by its path below Public or Private."""
        for file in self.by_leaf.get(include.split("/")[-1], []):
            if file.path.endswith(("/Public/" + include, "/Private/" + include)) or file.name == include:
                return file
        return None

    def reached(self, file: File) -> set[str]:
        """Includes of a file and of all plugin headers that it includes."""
        seen, todo = set(), [file]
        while todo:
            for include, _ in todo.pop().includes:
                if include not in seen:
                    seen.add(include)
                    header = self.header(include)
                    if header:
                        todo.append(header)
        return seen

    def descriptor(self) -> dict:
        """The .uplugin as an object; empty where it is not JSON."""
        try:
            found = json.loads(self.descriptors[0][1])
            return found if isinstance(found, dict) else {}
        except (IndexError, json.JSONDecodeError):
            return {}
