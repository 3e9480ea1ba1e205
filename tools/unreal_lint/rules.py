"""The one table of rules: number, who would find the fault at last, title, function; or why text cannot show it."""
from dataclasses import dataclass
from typing import Callable

from . import build, functions, hostile, properties, symbols, types


@dataclass(frozen=True)
class Rule:
    number: str
    enforcer: str  # UHT header tool, C++ compiler, linker, packaging, run time, convention
    title: str
    function: Callable | None
    limit: str = ""  # what the text cannot show of it


RULES = [
    Rule("R1", "UHT", "The .generated.h include is the last one", types.r1),
    Rule("R2", "UHT", "A header with U-macros includes its own .generated.h, any other header none", types.r2),
    Rule("R3", "C++", "Every header has #pragma once", types.r3),
    Rule("R4", "UHT", "U-macros stand in .h files alone", types.r4),
    Rule("R5", "C++", "Own header first, CoreMinimal.h first in headers, no monolithic header", types.r5),
    Rule("R6", "packaging", "Every file includes the header of every engine symbol it names", symbols.r6,
         "what a header of the engine needs itself"),
    Rule("R7", "UHT", "A header with nothing but dynamic delegates carries a UDELEGATE", types.r7),
    Rule("R8", "convention", "UTF-8 without byte-order mark, copyright in the first line", types.r8),
    Rule("R9", "convention", "No core or standard header in a header with U-macros", types.r9),
    Rule("R10", "UHT", "GENERATED_BODY() is the first statement of a reflected type", types.r10),
    Rule("R11", "UHT", "Prefixes U, A, F, E of reflected types", types.r11),
    Rule("R12", "UHT", "One UObject base and interfaces; a struct has at most one base", types.r12),
    Rule("R13", "UHT", "No reflected type is a template, nested, or in a namespace", types.r13),
    Rule("R14", "C++", "Reflected types are default-constructible; classes have no other constructor", types.r14,
         "members that have no default constructor themselves"),
    Rule("R15", "UHT", "No UFUNCTION in a USTRUCT", types.r15),
    Rule("R16", "run time", "Plain members are initialised where they are declared", types.r16),
    Rule("R17", "UHT", "A BlueprintType enum is 'enum class X : uint8' and fits it", types.r17),
    Rule("R18", "UHT", "No #if around U-macros but WITH_EDITOR and WITH_EDITORONLY_DATA", types.r18),
    Rule("R19", "UHT", "Editor properties under WITH_EDITORONLY_DATA, no Blueprint function under either", types.r19),
    Rule("R20", "UHT", "Reflected names begin with Consac and differ in more than the prefix letter", types.r20,
         "names of other plugins; the prefix keeps clear of them"),
    Rule("R21", "UHT", "Header names begin with Consac and are unique", types.r21, "headers of other plugins; the prefix keeps clear of them"),
    Rule("R22", "UHT", "Both halves of an interface, U and I", types.r22),
    Rule("R23", "UHT", "No Placeable class below a NotPlaceable one; no Immutable struct", types.r23, "bases of the engine"),
    Rule("R24", "UHT", "Types of properties, parameters and results that the header tool knows", properties.r24),
    Rule("R25", "UHT", "Integer types that Blueprint knows", properties.r25),
    Rule("R26", "UHT", "No pointer to anything but a UObject", properties.r26),
    Rule("R27", "UHT", "No reference and no const value as a property", properties.r27),
    Rule("R28", "UHT", "No nested containers, no container of delegates, keys that hash", properties.r28),
    Rule("R29", "UHT", "UObject members are TObjectPtr with UPROPERTY()", properties.r29),
    Rule("R30", "UHT", "No private Blueprint-visible property without AllowPrivateAccess", properties.r30),
    Rule("R31", "UHT", "BlueprintAssignable and the like on multicast delegates alone", properties.r31),
    Rule("R32", "packaging", "Every exposed property has a Category", properties.r32),
    Rule("R33", "run time", "EditCondition names a property; ClampMin and the like are strings of digits, without an exponent", properties.r33),
    Rule("R34", "UHT", "Bit fields are 'uint8 bName : 1'", properties.r34),
    Rule("R35", "convention", "Default subobjects are Visible..., not Edit...", properties.r35),
    Rule("R36", "UHT", "No Blueprint-visible C array", properties.r36),
    Rule("R37", "packaging", "Every Blueprint function has a Category", functions.r37),
    Rule("R38", "UHT", "No overloaded, template, deleted or pure UFUNCTION", functions.r38, "overloads of functions of engine classes"),
    Rule("R39", "UHT", "No UFUNCTION() on an override", functions.r39),
    Rule("R40", "UHT", "UObject parameters are raw pointers", functions.r40),
    Rule("R41", "UHT", "A pure function returns something", functions.r41),
    Rule("R42", "UHT", "BlueprintImplementableEvent: no body, not virtual, structs by const&", functions.r42),
    Rule("R43", "linker", "BlueprintNativeEvent: Name_Implementation is defined, Name is not", functions.r43),
    Rule("R44", "UHT", "One kind of event; SealedEvent on network and exec functions alone", functions.r44),
    Rule("R45", "UHT", "Metadata names existing parameters", functions.r45),
    Rule("R46", "UHT", "ExpandEnumAsExecs names an enum class or bool, and is not pure", functions.r46),
    Rule("R47", "run time", "A latent function has one FLatentActionInfo, named by LatentInfo", functions.r47),
    Rule("R48", "packaging", "An async factory is static, returns its class, is BlueprintInternalUseOnly", functions.r48),
    Rule("R49", "UHT", "Dynamic delegates: F name, 'type, name' pairs, bound functions are UFUNCTIONs", functions.r49),
    Rule("R50", "UHT", "No multicast delegate as a parameter", functions.r50),
    Rule("R51", "UHT", "CommutativeAssociativeBinaryOperator: two parameters of one type, and a result", functions.r51),
    Rule("R52", "UHT", "Default arguments that the header tool can read", functions.r52),
    Rule("R53", "UHT", "Parameters do not shadow members", functions.r53, "members of engine classes"),
    Rule("R54", "run time", "Library functions are static, a library is never created", functions.r54),
    Rule("R55", "meaning", "UPARAM(ref) marks a reference that is not const", functions.r55,
         "whether an unmarked reference was meant as an input too: that is intent"),
    Rule("R56", "UHT", "Specifiers and metadata keys are on the known list", functions.r56),
    Rule("R57", "linker", "Public types carry the module's _API macro, and not MinimalAPI as well", functions.r57,
         "free functions and types without macro"),
    Rule("R58", "linker", "One IMPLEMENT_MODULE per module, with its name", build.r58),
    Rule("R59", "build tool", "Folder, file and class of a build file are one name; base(Target) is passed", build.r59),
    Rule("R60", "linker", "No editor module or header in a runtime module", build.r60),
    Rule("R61", "linker", "The module of every include is in the lists of the build file", symbols.r61),
    Rule("R62", "C++", "No exceptions and no RTTI without the module's flag", build.r62),
    Rule("R63", "C++", "LOCTEXT_NAMESPACE is defined and undefined in pairs", build.r63),
    Rule("R64", "C++", "No file-scope name twice in a module that is built in unity", build.r64, "macros and 'using' that leak from one file to the next"),
    Rule("R65", "C++", "No undefined macro in #if, override is written, virtual destructors", build.r65,
         "shadowed locals and unused captures: a compiler's work"),
    Rule("R66", "C++", "UE_LOG and Printf: format and arguments agree", build.r66, "the types of arguments but strings"),
    Rule("R67", "C++", "TEXT() around literals passed as TCHAR*", build.r67, "functions of the plugin that take TCHAR*"),
    Rule("R68", "run time", "Constructors bind nothing, open nothing, ask for no world", build.r68, "what the functions that they call do"),
    Rule("R69", "run time", "Lifecycle overrides call Super", build.r69),
    Rule("R70", "C++", "Hidden state by TPimplPtr", build.r70),
    Rule("R71", "run time", "Lambdas that are kept capture no this, no reference, no raw UObject", build.r71),
    Rule("R72", "run time", "The descriptor is strict JSON with known keys, without EngineVersion", build.r72),
    Rule("R73", "C++", "No macro of Unreal or Windows as a name in the core's public headers", build.r73),
    Rule("R74", "packaging", "The files of FilterPlugin.ini exist", build.r74),
    Rule("R75", "run time", "No path to Source/ and no absolute path in the code", build.r75),
    Rule("R76", "run time", "No maths type without initial numbers", hostile.r76, "arrays of them"),
    Rule("R77", "run time", "Console variables are set with the priority that they have", hostile.r77),
    Rule("R78", "packaging", "Nothing is loaded by a text alone in a game", hostile.r78, "texts in settings"),
    Rule("R79", "run time", "BeginDestroy asks for hidden state before it uses it", hostile.r79, "what the functions that it calls do"),
    Rule("R80", "packaging", "A struct by const& may stay unwired", hostile.r80, "structs of the engine; a space must be wired"),
    Rule("R81", "packaging", "Every module names its platforms", hostile.r81, "whether it works there"),
    Rule("R82", "run time", "A subsystem keeps nothing of a level alive", hostile.r82, "keepers that are no subsystems"),
    Rule("R83", "run time", "A program is launched detached", hostile.r83),
    Rule("R84", "run time", "Components made at the start of play are destroyed at its end", hostile.r84, "which of several; actors that make their own"),
    Rule("R85", "packaging", "What is looked for in the plugin's folder is packed with a game", hostile.r85, "whether it is that file"),
    Rule("R86", "run time", "Threads are consac::Thread, which may fail and never throws", hostile.r86, "threads of what is staged"),
    Rule("R87", "run time", "A module with a std::mutex has the constructor that older runtime libraries know", hostile.r87, "what is staged"),
    Rule("R88", "run time", "What an actor or component holds only in play is not copied with it", hostile.r88, "whether what people set is for play alone"),
    Rule("A1", "convention", "Every engine symbol is in engines/unreal/symbols.csv", symbols.a1,
         "members reached through a name that the plugin declares too"),
    Rule("A2", "convention", "Every engine header is in engines/unreal/symbols.csv", symbols.a2),
    Rule("A3", "convention", "engines/unreal/symbols.csv is complete and has no row twice", symbols.a3),
]


def markdown() -> str:
    """docs/unreal-rules.md."""
    lines = [
        "# Rules of the Unreal plugin", "",
        "What `tools/unreal_lint.py` checks in a plugin folder by its text, where no Unreal is installed. Written by",
        "`tools/unreal_lint.py --rules`; `tests/python/test_unreal_lint.py` proves each with an accepted and a rejected case.",
        "", "Passing says that no rule here is broken. It does not say that the plugin compiles: only Unreal can.", "",
        "`found by` is who would find the fault at last: the header tool (UHT), the compiler, the linker, packaging, the",
        "running game. `not seen` is what of the rule text cannot show.", "",
        "| rule | found by | what | not seen |", "|---|---|---|---|"]
    for rule in RULES:
        lines.append(f"| {rule.number} | {rule.enforcer} | {rule.title} | {rule.limit if rule.function else 'not checked: ' + rule.limit} |")
    return "\n".join(lines) + "\n"


def lint(plugin) -> list[tuple[str, int, str, str]]:
    """(file, line, rule, message) of every finding, in order of file and line, each once."""
    found = {(path, line, rule.number, message) for rule in RULES if rule.function for path, line, message in rule.function(plugin)}
    return sorted(found, key=lambda f: (f[0], f[1], int(f[2][1:]), f[3]))
