"""Rules 24 to 36: types of properties, parameters and results; properties."""
import re

from .declarations import Quoted
from .model import Plugin
from .tokens import angle_close, spell, split, tokenize

BLUEPRINT_NUMBERS = {"bool", "uint8", "int32", "int", "int64", "float", "double"}
OTHER_NUMBERS = {"int8", "int16", "uint16", "uint32", "uint64"}
VALUES = {"FString", "FName", "FText", "FVector", "FRotator", "FQuat", "FTransform", "FColor", "FLinearColor",
          "FLatentActionInfo"}
POINTERS = ("TObjectPtr", "TSubclassOf", "TSoftObjectPtr", "TSoftClassPtr", "TScriptInterface", "TWeakObjectPtr")
CONTAINERS = ("TArray", "TSet", "TMap")
ENGINE_ENUMS = {"ECollisionChannel"}  # enums of C, which stand in a TEnumAsByte


def pieces(type_name: str) -> tuple[str, list[str]]:
    """(outer name, template arguments) of a type; no arguments where it is no template."""
    tokens = tokenize(type_name)
    for at, token in enumerate(tokens):
        if token.text == "<":
            end = angle_close(tokens, at)
            return spell(tokens[:at]), [spell(part) for part in split(tokens[at + 1:end])]
    return type_name, []


def bare(type_name: str) -> str:
    """A type without const, reference, pointer, UPARAM(...), class or struct."""
    without = re.sub(r"UPARAM\(.*?\)", "", type_name)
    return re.sub(r"\b(const|class|struct|enum)\b|[&*]", "", without).strip()


def unknown(plugin: Plugin, type_name: str) -> str:
    """The part of a type that the header tool does not know; '' where all is known."""
    if "::" in type_name:
        return type_name
    type_name = re.sub(r"UPARAM\(.*?\)", "", type_name)
    outer, arguments = pieces(bare(type_name) if "<" not in type_name else type_name.replace("const ", "").rstrip("&* "))
    if arguments:
        if outer in CONTAINERS:
            return next((u for u in (unknown(plugin, a) for a in arguments) if u), "")
        if outer == "TEnumAsByte":
            return "" if arguments[0] in ENGINE_ENUMS else arguments[0]
        return "" if outer in POINTERS else outer
    name = bare(type_name)
    own = plugin.by_name.get(name)
    known = (name in BLUEPRINT_NUMBERS | OTHER_NUMBERS | VALUES or name in plugin.delegates
             or (own is not None and (own.kind or "U" + name[1:] in plugin.by_name)) or (own is None and re.match(r"[UA][A-Z]", name)))
    return "" if known else name


def properties(plugin: Plugin):
    return plugin.members("UPROPERTY")


def r24(plugin: Plugin):
    for file, type_, member in plugin.members("UPROPERTY", "UFUNCTION"):
        for where in [member.type] + [p.type for p in member.parameters or []]:
            wrong = unknown(plugin, where) if where != "void" and not member.template else ""
            if wrong:
                yield file.path, member.line, f"{type_.name}::{member.name}: the header tool knows no type '{wrong}'; use a UCLASS, USTRUCT, UENUM or plain type"
    for file in plugin.written:
        for delegate in file.delegates:
            for part in delegate.arguments[1 + ("RetVal" in delegate.macro)::2]:
                wrong = unknown(plugin, spell(part).strip("()"))
                if wrong:
                    yield file.path, delegate.line, f"delegate: the header tool knows no type '{wrong}'; use a UCLASS, USTRUCT, UENUM or plain type"


def blueprint(member) -> bool:
    return member.has("BlueprintReadOnly", "BlueprintReadWrite")


def numbers(type_name: str) -> set:
    return set(re.findall(r"\w+", type_name)) & OTHER_NUMBERS


def r25(plugin: Plugin):
    for file, type_, member in plugin.members("UPROPERTY", "UFUNCTION"):
        if member.kind == "UPROPERTY" and blueprint(member) and not member.bits:
            for name in numbers(member.type):
                yield file.path, member.line, f"{member.name}: Blueprint has no {name}; use int32 or int64"
        if member.kind == "UFUNCTION" and any(s.startswith("Blueprint") for s in member.specifiers):
            for where in [member.type] + [p.type for p in member.parameters or []]:
                for name in numbers(where):
                    yield file.path, member.line, f"{member.name}: Blueprint has no {name}; use int32 or int64"


def r26(plugin: Plugin):
    for file, type_, member in plugin.members("UPROPERTY", "UFUNCTION"):
        for where in [member.type] + [p.type for p in member.parameters or []]:
            stars = where.count("*")
            if stars > 1 or (stars and not re.match(r"[UA][A-Z]|I[A-Z]", bare(where)) and "<" not in where):
                yield file.path, member.line, f"{member.name}: '{where}' is no pointer to a UObject; pass it by value or reference"
            elif stars and re.search(r"<\s*F\w+\*", where):
                yield file.path, member.line, f"{member.name}: '{where}' holds pointers to structs; hold values"


def r27(plugin: Plugin):
    for file, type_, member in properties(plugin):
        if "&" in member.type:
            yield file.path, member.line, f"{member.name}: a property cannot be a reference"
        elif re.match(r"const\b(?!.*\*)", member.type):
            yield file.path, member.line, f"{member.name}: a property cannot be const; remove const"


UNHASHABLE = CONTAINERS + ("FText",)


def r28(plugin: Plugin):
    for file, type_, member in plugin.members("UPROPERTY", "UFUNCTION"):
        for where in [member.type] + [p.type for p in member.parameters or []]:
            outer, arguments = pieces(re.sub(r"UPARAM\(.*?\)", "", where).replace("const ", ""))
            if outer in CONTAINERS:
                if any(pieces(a)[0] in CONTAINERS for a in arguments):
                    yield file.path, member.line, f"{member.name}: nested containers are not supported; put the inner one into a USTRUCT"
                elif any(bare(a) in plugin.delegates for a in arguments):
                    yield file.path, member.line, f"{member.name}: no container of delegates"
                key = plugin.by_name.get(bare(arguments[0])) if arguments and outer in ("TMap", "TSet") else None
                if arguments and outer in ("TMap", "TSet") and (bare(arguments[0]) in UNHASHABLE or (
                        key and key.kind == "USTRUCT" and not any("GetTypeHash" in f.text for f in plugin.headers))):
                    yield file.path, member.line, f"{member.name}: {arguments[0]} has no GetTypeHash; use a name or a number as key"


def r29(plugin: Plugin):
    for file, type_ in plugin.types:
        for member in type_.members if type_.kind in ("UCLASS", "USTRUCT") else ():
            if member.parameters is None and "static" not in member.words_before:
                if re.search(r"\b[UA][A-Z]\w*\s*\*", member.type):
                    yield file.path, member.line, f"{type_.name}::{member.name}: write TObjectPtr<...> with UPROPERTY() instead of a raw pointer"
                elif "TObjectPtr" in member.type and member.kind != "UPROPERTY":
                    yield file.path, member.line, f"{type_.name}::{member.name}: without UPROPERTY() it dangles after garbage collection"


def r30(plugin: Plugin):
    for file, type_, member in properties(plugin):
        if blueprint(member) and member.access == "private" and member.meta.get("AllowPrivateAccess") != "true":
            yield file.path, member.line, f'{member.name} is private and Blueprint-visible; make it public or add meta=(AllowPrivateAccess="true")'


def r31(plugin: Plugin):
    for file, type_, member in properties(plugin):
        if member.has("BlueprintAssignable", "BlueprintCallable", "BlueprintAuthorityOnly"):
            delegate = plugin.delegates.get(member.type)
            if not delegate or not delegate.multicast:
                yield file.path, member.line, f"{member.name}: BlueprintAssignable and BlueprintCallable are for dynamic multicast delegates"


EXPOSED = ("EditAnywhere", "EditDefaultsOnly", "EditInstanceOnly", "VisibleAnywhere", "VisibleDefaultsOnly",
           "VisibleInstanceOnly", "BlueprintReadOnly", "BlueprintReadWrite", "BlueprintAssignable", "BlueprintCallable")


def r32(plugin: Plugin):
    for file, type_, member in properties(plugin):
        if member.has(*EXPOSED) and not member.specifiers.get("Category"):
            yield file.path, member.line, f'{member.name} is exposed without a category; add Category="Consac|..."'


NUMERIC_META = ("ClampMin", "ClampMax", "UIMin", "UIMax", "Delta", "Multiple", "SliderExponent")


def r33(plugin: Plugin):
    for file, type_, member in properties(plugin):
        names = {m.name for m in type_.members}
        base = plugin.by_name.get(type_.bases[0]) if type_.bases else None
        while base:
            names |= {m.name for m in base.members}
            base = plugin.by_name.get(base.bases[0]) if base.bases and base.bases[0] != base.name else None
        condition = member.meta.get("EditCondition", "")
        for word in re.findall(r"(?<![:\w])[A-Za-z_]\w*(?!\w*::)", condition):
            if word not in names and word not in ("true", "false"):
                yield file.path, member.line, f"{member.name}: EditCondition names '{word}', which is no property of {type_.name}"
        for name, value in member.meta.items():
            if name in NUMERIC_META and not isinstance(value, Quoted):
                yield file.path, member.line, f'{member.name}: write {name}="..." as a string'
            elif name in NUMERIC_META and not re.fullmatch(r"[+-]?\d+(\.\d+)?", value):
                yield file.path, member.line, f'{member.name}: {name}="{value}" is no number to the header tool; write digits with one dot, and no exponent'


def r34(plugin: Plugin):
    for file, type_, member in properties(plugin):
        if member.bits:
            if member.type not in ("uint8", "uint32"):
                yield file.path, member.line, f"{member.name}: a bit field is uint8 or uint32, not {member.type}"
            if not re.match(r"b[A-Z]", member.name) or spell(member.tokens[-1:]) != "1" and not member.initialised:
                yield file.path, member.line, f"{member.name}: a bit field is a bool: 'uint8 bName : 1'"


def r35(plugin: Plugin):
    for file, body in plugin.bodies:
        owner = plugin.by_name.get(body.owner)
        for at, token in enumerate(body.tokens if owner else ()):
            if token.text == "CreateDefaultSubobject" and at > 1 and body.tokens[at - 1].text == "=":
                name = body.tokens[at - 2].text
                for member in owner.members:
                    if member.name == name and any(s.startswith("Edit") for s in member.specifiers):
                        where = next(f.path for f, t in plugin.types if t is owner)
                        yield where, member.line, f"{name} is a default subobject; use VisibleAnywhere instead of Edit..."


def r36(plugin: Plugin):
    for file, type_, member in properties(plugin):
        if member.array and blueprint(member):
            yield file.path, member.line, f"{member.name}: Blueprint has no C arrays; use TArray"
