"""Rules 1 to 23: files and includes, reflected types."""
import re

from .declarations import U_MACROS
from .model import CORE_INCLUDES, Plugin
from .tokens import split

REFLECTED = ("UCLASS", "USTRUCT", "UENUM", "UINTERFACE", "UFUNCTION", "UPROPERTY", "UDELEGATE")
VERSION_GUARDS = ("WITH_EDITOR", "WITH_EDITORONLY_DATA")


def reflected(file) -> list:
    """Tokens of a file that are U-macros with arguments."""
    return [file.tokens[at] for at in file.macros(*U_MACROS)]


def generated(file) -> str:
    return file.name.removesuffix(".h") + ".generated.h"


def r1(plugin: Plugin):
    for file in plugin.headers:
        own = [i for i, (path, _) in enumerate(file.includes) if path.endswith(".generated.h")]
        if own and own[0] != len(file.includes) - 1:
            yield file.path, file.includes[own[0] + 1][1], "an include stands after .generated.h; move it above"


def r2(plugin: Plugin):
    for file in plugin.headers:
        found = [(path, line) for path, line in file.includes if path.endswith(".generated.h")]
        needs = bool(reflected(file))
        if needs and [path for path, _ in found] != [generated(file)]:
            yield file.path, found[0][1] if found else 1, f'a header with U-macros includes exactly "{generated(file)}"'
        elif not needs and found:
            yield file.path, found[0][1], "no U-macro in this header; remove the .generated.h include"


def r3(plugin: Plugin):
    for file in plugin.headers:
        if not any(t.kind == "directive" and t.text.replace(" ", "") == "#pragmaonce" for t in file.tokens):
            yield file.path, 1, "no #pragma once; add it"


def r4(plugin: Plugin):
    for file in plugin.written:
        if not file.is_header:
            for token in reflected(file):
                yield file.path, token.line, f"{token.text} outside a .h file is not seen by the header tool; move it to a header"


def r5(plugin: Plugin):
    for file in plugin.written:
        for path, line in file.includes:
            if path in ("Engine.h", "UnrealEd.h", "Core.h"):
                yield file.path, line, f"{path} includes everything; include the headers of what is used"
        first = file.includes[0] if file.includes else None
        if file.is_header and first and first[0] != "CoreMinimal.h":
            yield file.path, first[1], "a header includes CoreMinimal.h first"
        if file.path.endswith(".cpp"):
            own = file.name.removesuffix(".cpp") + ".h"
            has = any(header.name == own and header.module == file.module for header in plugin.headers)
            if has and (not first or first[0].split("/")[-1] != own):
                yield file.path, first[1] if first else 1, f'include the own header "{own}" first'


def r7(plugin: Plugin):
    for file in plugin.headers:
        if file.delegates and not reflected(file):
            yield file.path, file.delegates[0].line, "only delegates here: the header tool skips the file; write UDELEGATE() above one"


def r8(plugin: Plugin):
    for file in plugin.written:
        if file.bom:
            yield file.path, 1, "begins with a byte-order mark; save as UTF-8 without it"
        if not file.utf8:
            yield file.path, 1, "is not UTF-8; save it as UTF-8"
        if not file.text.startswith("// Copyright"):
            yield file.path, 1, "the first line is no '// Copyright ...' line; add it"


def r9(plugin: Plugin):
    for file in plugin.headers:
        if reflected(file):
            for path, line in file.includes:
                target = plugin.header(path)
                core = path.startswith(CORE_INCLUDES) or (target and target not in plugin.written) or (
                    target and any(p.startswith(CORE_INCLUDES) for p in plugin.reached(target)))
                standard = "." not in path
                if core or standard:
                    yield file.path, line, f"'{path}' may not enter a header with U-macros; include it in the .cpp"


def r10(plugin: Plugin):
    for file, type_ in plugin.types:
        if type_.kind in ("UCLASS", "USTRUCT", "UINTERFACE"):
            first = next((t.text for t in type_.body if t.kind != "directive"), "")
            if first != "GENERATED_BODY":
                yield file.path, type_.line, f"{type_.name} does not begin with GENERATED_BODY()"
        elif type_.kind == "" and type_.name.startswith("I") and "U" + type_.name[1:] in plugin.by_name:
            if next((t.text for t in type_.body if t.kind != "directive"), "") != "GENERATED_BODY":
                yield file.path, type_.line, f"the interface half {type_.name} does not begin with GENERATED_BODY()"


def is_actor(plugin: Plugin, type_) -> bool:
    """Whether a class comes from an actor, by its bases in the plugin and by the prefix of the first one outside."""
    base = type_.bases[0] if type_.bases else ""
    return is_actor(plugin, plugin.by_name[base]) if base in plugin.by_name and base != type_.name else base.startswith("A")


def r11(plugin: Plugin):
    for file, type_ in plugin.types:
        want = {"USTRUCT": "F", "UENUM": "E", "UINTERFACE": "U"}.get(type_.kind)
        if type_.kind == "UCLASS":
            want = "A" if is_actor(plugin, type_) else "U"
        if want and not re.match(want + "[A-Z]", type_.name):
            yield file.path, type_.line, f"{type_.name} needs the prefix {want}"


def r12(plugin: Plugin):
    for file, type_ in plugin.types:
        if type_.kind == "USTRUCT" and len(type_.bases) > 1:
            yield file.path, type_.line, f"{type_.name} has {len(type_.bases)} bases; a USTRUCT has at most one"
        if type_.kind == "UCLASS":
            objects = [base for base in type_.bases if base[:1] in "UA"]
            others = [base for base in type_.bases[1:] if base[:1] not in ("I", "F")]
            if len(objects) != 1 or type_.bases[0] != objects[0] or others:
                yield file.path, type_.line, f"{type_.name}: one UObject base, first, and interfaces after it"


def r13(plugin: Plugin):
    for file, type_ in plugin.types:
        if type_.kind:
            for wrong, what in ((type_.template, "a template"), (type_.in_namespace, "in a namespace"),
                                (type_.nested, "inside another type")):
                if wrong:
                    yield file.path, type_.line, f"{type_.kind} {type_.name} is {what}; the header tool takes it only at file scope"


def r14(plugin: Plugin):
    for file, type_ in plugin.types:
        if type_.kind in ("UCLASS", "USTRUCT"):
            ctors = [m for m in type_.members if m.name == type_.name and m.parameters is not None]
            good = [m for m in ctors if all(p.default for p in m.parameters)
                    or [p.type for p in m.parameters] in (["const FObjectInitializer&"],)]
            deleted = [m for m in good if "delete" in m.words_after]
            for ctor in deleted or ([] if good or not ctors else ctors[:1]):
                yield file.path, ctor.line, f"{type_.name} cannot be default-constructed; give it a constructor without parameters"
            if type_.kind == "UCLASS":
                for ctor in ctors:
                    if ctor not in good and [p.type for p in ctor.parameters] != ["FVTableHelper&"]:
                        yield file.path, ctor.line, f"the engine never calls this constructor of {type_.name}; set values after NewObject"


def r15(plugin: Plugin):
    for file, type_, member in plugin.members("UFUNCTION"):
        if type_.kind == "USTRUCT":
            yield file.path, member.line, f"{type_.name}::{member.name}: a USTRUCT has no UFUNCTION; move it to a function library"


PLAIN = {"bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "int", "float", "double", "TCHAR"}


def r16(plugin: Plugin):
    for file, type_ in plugin.types:
        for member in type_.members if type_.kind in ("USTRUCT", "UCLASS") else ():
            plain = member.type in PLAIN or member.type.endswith("*") or re.fullmatch(r"E[A-Z]\w*", member.type)
            needs = type_.kind == "USTRUCT" or member.kind == "UPROPERTY"
            if needs and plain and member.parameters is None and not member.initialised and "static" not in member.words_before:
                yield file.path, member.line, f"{type_.name}::{member.name} is not initialised; write '= ...' at its declaration"


def r17(plugin: Plugin):
    for file, type_ in plugin.types:
        if type_.kind == "UENUM":
            if "BlueprintType" in type_.specifiers and (not type_.scoped or type_.underlying != "uint8"):
                yield file.path, type_.line, f"write 'enum class {type_.name} : uint8' for a BlueprintType enum"
            value = -1
            for part in split(type_.body):
                equal = next((i for i, t in enumerate(part) if t.text == "="), None)
                if not part:
                    continue
                given = part[equal + 1].text if equal is not None and equal + 1 < len(part) else ""
                value = int(given, 0) if re.fullmatch(r"0[xX][0-9a-fA-F]+|[1-9]\d*|0", given) else value + 1
                if value > 255 or given == "-":
                    yield file.path, part[0].line, f"{type_.name}::{part[0].text} does not fit uint8 (0 to 255)"


def r18(plugin: Plugin):
    for file in plugin.headers:
        for token in reflected(file):
            for condition in token.conditions:
                if condition not in VERSION_GUARDS:
                    yield file.path, token.line, f"{token.text} under '#if {condition}'; only WITH_EDITOR and WITH_EDITORONLY_DATA may guard it"


def r19(plugin: Plugin):
    for file, type_, member in plugin.members("UPROPERTY", "UFUNCTION"):
        if member.kind == "UPROPERTY" and "WITH_EDITOR" in member.conditions:
            yield file.path, member.line, f"{member.name}: an editor property stands under WITH_EDITORONLY_DATA"
        if member.kind == "UFUNCTION" and set(VERSION_GUARDS) & set(member.conditions) and any(s.startswith("Blueprint") for s in member.specifiers):
            yield file.path, member.line, f"{member.name}: Blueprints of a packaged game would lose this function; take it out of the #if"


def r20(plugin: Plugin):
    seen = {}
    for file, type_ in plugin.types:
        if type_.kind:
            if not re.match(r"[UAFEI]Consac", type_.name):
                yield file.path, type_.line, f"{type_.name}: reflected names are global; begin with {type_.name[:1]}Consac"
            if type_.name[1:] in seen:
                yield file.path, type_.line, f"{type_.name} and {seen[type_.name[1:]]} differ in the prefix alone; rename one"
            seen[type_.name[1:]] = type_.name
    for name, delegate in plugin.delegates.items():
        if not name.startswith("FConsac"):
            path = next(f.path for f in plugin.written if delegate in f.delegates)
            yield path, delegate.line, f"delegate {name}: reflected names are global; begin with FConsac"


def r21(plugin: Plugin):
    seen = {}
    for file in plugin.headers:
        if not file.name.startswith("Consac"):
            yield file.path, 1, "header names are global in a target; begin with Consac"
        if file.name.lower() in seen:
            yield file.path, 1, f"the same header name as {seen[file.name.lower()]}; rename one"
        seen[file.name.lower()] = file.path


def r22(plugin: Plugin):
    for file, type_ in plugin.types:
        if type_.kind == "UINTERFACE":
            if "UInterface" not in type_.bases:
                yield file.path, type_.line, f"{type_.name} derives from UInterface"
            if not any(t.name == "I" + type_.name[1:] for t in file.types):
                yield file.path, type_.line, f"no class I{type_.name[1:]} in this header; it is the other half of the interface"


def r23(plugin: Plugin):
    for file, type_ in plugin.types:
        base = plugin.by_name.get(type_.bases[0]) if type_.bases else None
        if "Placeable" in type_.specifiers and base and "NotPlaceable" in base.specifiers:
            yield file.path, type_.line, f"{type_.name} is Placeable and its base {base.name} is not; remove one specifier"
        if type_.kind == "USTRUCT" and "Immutable" in type_.specifiers:
            yield file.path, type_.line, f"{type_.name}: Immutable is for the engine's own structs; remove it"
