"""Rules 76 to 88: what compiles, works on the author's machine, and fails in a packaged game, after a Hot Reload or a travel."""
import re

from .build import EDITOR_TYPES, module_types
from .functions import functions
from .model import Plugin
from .tokens import close_of, spell, split
from .types import is_actor

UNINITIALISED = ("FVector", "FQuat", "FRotator", "FColor")
PLATFORMS = ("Win64", "Linux", "LinuxArm64", "Mac", "IOS", "Android", "TVOS", "VisionOS")
SHOWN = ("EditAnywhere", "EditInstanceOnly", "EditDefaultsOnly", "BlueprintReadWrite")  # what people set is saved and copied
MUST_BE_WIRED = ("FConsacSpace",)  # a default would pass unseen where the node cannot do without


def r76(plugin: Plugin):
    for file in plugin.written:
        for at, token in enumerate(file.tokens[:-3]):
            after = [t.text for t in file.tokens[at + 1:at + 3]]
            named = file.tokens[at + 1].kind == "word" and after[1] == ";"
            if token.kind == "word" and token.text in UNINITIALISED and (after == ["(", ")"] or named):
                yield file.path, token.line, f"a {token.text} without arguments is garbage; give its numbers, or a constant as FVector::ZeroVector"


def r77(plugin: Plugin):
    for file in plugin.written:
        if not any(t.kind == "directive" and "HAL/IConsoleManager.h" in t.text for t in file.tokens):
            continue
        for at, token in enumerate(file.tokens[:-1]):
            if token.text == "Set" and file.tokens[at + 1].text == "(" and at and file.tokens[at - 1].text in ("->", "."):
                yield file.path, token.line, "Set is refused after a setting on the console, and raises the priority; use SetWithCurrentPriority"


def r78(plugin: Plugin):
    types = module_types(plugin)
    for file in plugin.written:
        for token in file.tokens if types.get(file.module) not in EDITOR_TYPES else ():  # what an editor puts into a level is packed with that
            if token.kind == "word" and token.text in ("LoadObject", "StaticLoadObject", "LoadClass"):
                yield file.path, token.line, f"what only the text of {token.text} names is not packed with a game; use ConstructorHelpers::FObjectFinder in a constructor"


def r79(plugin: Plugin):
    for file, body in plugin.bodies:
        owner = plugin.by_name.get(body.owner) if body.name == "BeginDestroy" else None
        for member in owner.members if owner else ():
            hidden = member.parameters is None and member.type.startswith("TPimplPtr")
            text = spell(body.tokens)
            if hidden and re.search(rf"\b{member.name}->", text) and f"{member.name}.IsValid()" not in text:
                yield file.path, body.line, f"{body.owner}::BeginDestroy takes {member.name} for granted; a temporary object of Hot Reload has none: ask {member.name}.IsValid()"


def r80(plugin: Plugin):
    for file, type_, member in functions(plugin):
        covered = re.split(r",\s*", member.meta.get("AutoCreateRefTerm", ""))
        for parameter in member.parameters or [] if member.has("BlueprintCallable", "BlueprintPure") else ():
            struct = re.fullmatch(r"const\s+(F\w+)\s*&", parameter.type.strip())
            known = struct and struct.group(1) in plugin.by_name and struct.group(1) not in MUST_BE_WIRED
            if known and parameter.name not in covered:
                yield file.path, member.line, f"{member.name}: a graph that leaves {parameter.name} unwired does not compile; add AutoCreateRefTerm=\"{parameter.name}\""


def r81(plugin: Plugin):
    for path, text in plugin.descriptors:
        modules = plugin.descriptor().get("Modules", [])
        for module in modules if isinstance(modules, list) else []:
            name = module.get("Name", "") if isinstance(module, dict) else ""
            line = next((n for n, words in enumerate(text.splitlines(), 1) if f'"{name}"' in words), 1)
            allowed = module.get("PlatformAllowList") if isinstance(module, dict) else None
            if not allowed:
                yield path, line, f"module {name} has no PlatformAllowList; name the platforms that it is for"
            for platform in allowed or []:
                if platform not in PLATFORMS:
                    yield path, line, f"module {name}: unknown platform '{platform}'"


def is_of_a_level(plugin: Plugin, name: str) -> bool:
    """Whether objects of a class live in a level: actors and their components."""
    type_ = plugin.by_name.get(name)
    return name.endswith("Component") or (is_actor(plugin, type_) if type_ else name.startswith("A"))


def r82(plugin: Plugin):
    for file, type_ in plugin.types:
        for member in type_.members if type_.kind == "UCLASS" and type_.bases and type_.bases[0].endswith("Subsystem") else ():
            for name in re.findall(r"TObjectPtr\s*<\s*(\w+)", member.type) if member.parameters is None else ():
                if is_of_a_level(plugin, name):
                    yield file.path, member.line, f"{type_.name}::{member.name} keeps {name} alive beyond its level, which then cannot go; use TWeakObjectPtr"


def r83(plugin: Plugin):
    for file in plugin.written:
        for at in file.macros("CreateProc"):
            arguments = split(file.tokens[at + 2:close_of(file.tokens, at + 1)])
            if len(arguments) > 2 and spell(arguments[2]) != "true":
                yield file.path, file.tokens[at].line, "on Linux CloseProc waits until a program has ended that was not launched detached; pass true as the third argument"


def r84(plugin: Plugin):
    for file, body in plugin.bodies:
        if body.name == "EndPlay" or "RegisterComponent(" not in spell(body.tokens):
            continue
        own = {other.name: spell(other.tokens) for _, other in plugin.bodies if other.owner == body.owner}
        end = own.get("EndPlay", "")
        ends = [end, *(text for name, text in own.items() if f"{name}(" in end)]  # and what it calls
        if not any("DestroyComponent(" in text for text in ends):
            yield file.path, body.line, f"{body.owner}::{body.name} makes a component at every start of play and EndPlay destroys none: a level that is hidden and shown leaves one behind"


def r85(plugin: Plugin):
    builds = {build.module: build for build in plugin.builds}
    for file in plugin.written:
        build = builds.get(file.module)
        for token in file.tokens if build and not build.stages_files else ():
            if token.text == "GetBaseDir":
                yield file.path, token.line, f"a packaged game has no file of the plugin's folder that {build.path} does not name; add it to RuntimeDependencies"


def r86(plugin: Plugin):
    for file in plugin.written:
        for space, _, token in zip(file.tokens, file.tokens[1:], file.tokens[2:]):
            if spell([space, _, token]) in ("std::thread", "std::jthread", "std::async"):
                yield file.path, token.line, f"std::{token.text} throws where the system has no thread, which ends the game; use consac::Thread"


OLD_MUTEX = "_DISABLE_CONSTEXPR_MUTEX_CONSTRUCTOR"


def r87(plugin: Plugin):
    builds = {build.module: build for build in plugin.builds}
    for file in plugin.written:
        build = builds.get(file.module)
        for space, _, token in zip(file.tokens, file.tokens[1:], file.tokens[2:]):
            if build and OLD_MUTEX not in build.defines and spell([space, _, token]) in ("std::mutex", "std::recursive_mutex"):
                yield file.path, token.line, f"on Windows a std::{token.text} made by a compiler newer than the player's runtime library ends the game when it is locked; define {OLD_MUTEX} in {build.path}"


def r88(plugin: Plugin):
    for file, type_, member in plugin.members("UPROPERTY"):
        of_a_level = type_.kind == "UCLASS" and (type_.name.endswith("Component") or is_actor(plugin, type_))
        if not of_a_level or "TObjectPtr" not in member.type or member.has(*SHOWN):
            continue
        made = any(f"{member.name}=CreateDefaultSubobject" in spell(body.tokens).replace(" ", "")
                   for _, body in plugin.bodies if body.owner == type_.name == body.name)
        if not made and not (member.has("Transient") and member.has("DuplicateTransient")):
            yield file.path, member.line, f"{type_.name}::{member.name} is found or made in play: a copy of the object would begin with the other one's; add Transient, DuplicateTransient"
