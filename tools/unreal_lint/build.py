"""Rules 58 to 75 but 61: modules, build files, the descriptor, and what kills or leaks at run time."""
import json
import re

from .model import CORE_MODULES, Plugin
from .properties import pieces
from .tokens import close_of, spell, split, string_value
from .types import is_actor


def r58(plugin: Plugin):
    modules = {m.get("Name") for m in plugin.descriptor().get("Modules", []) if isinstance(m, dict)}
    for build in plugin.builds:
        if build.settings.get("Type") == "ModuleType.External":
            continue
        found = [(f, at) for f in plugin.written if f.module == build.module for at in f.macros("IMPLEMENT_MODULE")]
        if len(found) != 1:
            yield build.path, 1, f"module {build.module} has {len(found)} IMPLEMENT_MODULE; write one, in one .cpp"
        for file, at in found:
            name = spell(split(file.tokens[at + 2:close_of(file.tokens, at + 1)])[-1])
            if name != build.module:
                yield file.path, file.tokens[at].line, f"IMPLEMENT_MODULE names {name}; the module is {build.module}"
        if build.module not in modules:
            yield build.path, 1, f"module {build.module} is not in the .uplugin; add it"


def r59(plugin: Plugin):
    for build in plugin.builds:
        folder = build.path.split("/")[-2] if "/" in build.path else ""
        if not folder == build.module == build.class_name:
            yield build.path, 1, f"folder '{folder}', file '{build.module}' and class '{build.class_name}' must be one name"
        if not build.passes_target:
            yield build.path, 1, "the constructor does not pass the target; write ': base(Target)'"


EDITOR_MODULES = {"UnrealEd", "BlueprintGraph", "Kismet", "KismetCompiler", "PropertyEditor", "EditorStyle", "EditorSubsystem",
                  "LevelEditor", "GraphEditor", "AssetTools", "ToolMenus", "EditorFramework", "DetailCustomizations"}
EDITOR_HEADERS = ("Editor.h", "EditorSubsystem.h", "UnrealEd.h", "K2Node.h")
EDITOR_TYPES = ("Editor", "EditorNoCommandlet", "UncookedOnly")


def module_types(plugin: Plugin) -> dict:
    return {m.get("Name"): m.get("Type") for m in plugin.descriptor().get("Modules", []) if isinstance(m, dict)}


def r60(plugin: Plugin):
    types = module_types(plugin)
    for build in plugin.builds:
        if types.get(build.module) not in EDITOR_TYPES:
            for name, line, guarded in build.public + build.private:
                if not guarded and (name in EDITOR_MODULES or types.get(name) in EDITOR_TYPES):
                    yield build.path, line, f"{build.module} runs in games and depends on the editor's {name}; guard it by 'if (Target.bBuildEditor)'"
                if types.get(name) == "DeveloperTool" and types.get(build.module) != "DeveloperTool":
                    yield build.path, line, f"{build.module} would drag the developer tool {name} into shipped games"
    for file in plugin.written:
        if types.get(file.module) not in EDITOR_TYPES:
            for token in file.tokens:
                if token.kind == "directive" and any(f'"{h}"' in token.text or f'/{h}"' in token.text for h in EDITOR_HEADERS):
                    if "WITH_EDITOR" not in token.conditions:
                        yield file.path, token.line, "an editor header in a runtime module; put it under '#if WITH_EDITOR'"


THROWING = {"throw": "bEnableExceptions", "try": "bEnableExceptions", "catch": "bEnableExceptions",
            "dynamic_cast": "bUseRTTI", "typeid": "bUseRTTI"}


def r62(plugin: Plugin):
    settings = {build.module: build.settings for build in plugin.builds}
    for file in plugin.files:
        for token in file.tokens:
            flag = THROWING.get(token.text) if token.kind == "word" else None
            if flag and settings.get(file.module, {}).get(flag) != "true":
                yield file.path, token.line, f"'{token.text}' in a module without {flag}; return a status instead"


def r63(plugin: Plugin):
    for file in plugin.written:
        opened = None
        for token in file.tokens:
            words = token.text.lstrip("# ").split() if token.kind == "directive" else []
            if words[1:2] == ["LOCTEXT_NAMESPACE"] and words[0] in ("define", "undef"):
                if (words[0] == "define") == (opened is not None):
                    yield file.path, token.line, f"#{words[0]} LOCTEXT_NAMESPACE without its partner"
                opened = token.line if words[0] == "define" else None
        if opened is not None:
            yield file.path, opened, "LOCTEXT_NAMESPACE stays defined; #undef it at the end of the file"


def file_scope(tokens: list):
    """(namespace, name, signature, line) of what a .cpp defines at file scope outside of classes."""
    at, scopes, start = 0, [], 0
    while at < len(tokens):
        scopes = [s for s in scopes if s[1] > at]
        token = tokens[at]
        if token.text == "namespace":
            end = at
            while end < len(tokens) and tokens[end].text not in ("{", ";", "="):
                end += 1
            if end < len(tokens) and tokens[end].text == "{":
                scopes.append((spell(tokens[at + 1:end]), close_of(tokens, end)))
            at = start = end + 1
        elif token.kind == "directive" or token.text in (";", "}"):
            at = start = at + 1
        elif token.text in ("=", "{", "("):
            head, space = tokens[start:at], "::".join(s[0] for s in scopes)
            words = [t.text for t in head]
            close = close_of(tokens, at) if token.text != "=" else at
            end = close
            while end < len(tokens) and tokens[end].text not in (";", "{"):
                end += 1
            if token.text == "{":
                end = close
            elif end < len(tokens) and tokens[end].text == "{":
                end = close_of(tokens, end)
            defined = token.text != "(" or tokens[min(end, len(tokens) - 1)].text == "}"
            if len(head) > 1 and head[-1].kind == "word" and "::" not in words[-2:] and words[0] not in ("using", "extern", "typedef", "template") and defined:
                yield space, words[-1], spell(tokens[at + 1:close]) if token.text == "(" else "", head[-1].line
            at = start = end + 1
        else:
            at += 1


def r64(plugin: Plugin):
    settings = {build.module: build.settings for build in plugin.builds}
    seen = {}
    for file in plugin.sources:
        if settings.get(file.module, {}).get("bUseUnity") != "false":
            for space, name, signature, line in file_scope(file.tokens):
                key = (file.module, space, name, signature)
                if seen.setdefault(key, file.path) != file.path:
                    yield file.path, line, f"'{name}' is defined in {seen[key]} too; a unity build joins the files, so rename one"


COMPILER_MACROS = {"__cplusplus", "_MSC_VER", "__clang__", "__GNUC__"}


def r65(plugin: Plugin):
    own = {m.group(1) for f in plugin.files for t in f.tokens if t.kind == "directive"
           for m in [re.match(r"#\s*define\s+(\w+)", t.text)] if m}
    for file in plugin.written:
        for token in file.tokens:
            found = re.match(r"#\s*(?:el)?if\s+(.*)", token.text) if token.kind == "directive" else None
            for name in re.findall(r"[A-Za-z_]\w*", re.sub(r"defined\s*(\(\s*\w+\s*\)|\w+)", "", found.group(1))) if found else ():
                row = plugin.symbols.by_name.get(name)
                if not (row and row.kind == "macro") and name not in own and name not in COMPILER_MACROS:
                    yield file.path, token.line, f"'{name}' may be undefined in this #if; write defined({name})"
    for file, type_ in plugin.types:
        base = type_.bases[0] if type_.bases else ""
        members = plugin.by_name[base].members if base in plugin.by_name else []
        virtual = {m.name for m in members if "virtual" in m.words_before} | {
            row.symbol.split("::")[1] for row in plugin.symbols.rows if row.symbol.startswith(base + "::") and base}
        for member in type_.members:
            if "virtual" in member.words_before and member.name in virtual and not {"override", "final"} & set(member.words_after):
                yield file.path, member.line, f"{type_.name}::{member.name} overrides; write override"
        plain = type_.keyword != "enum" and not type_.bases and not type_.kind
        interface = "U" + type_.name[1:] in plugin.by_name
        if plain and not interface and any("virtual" in m.words_before for m in type_.members):
            if not any(m.name == "~" + type_.name and "virtual" in m.words_before for m in type_.members):
                yield file.path, type_.line, f"{type_.name} has virtual functions and no virtual destructor; add one"


VERBOSITIES = ("Fatal", "Error", "Warning", "Display", "Log", "Verbose", "VeryVerbose")
CONVERSION = re.compile(r"%(?:%|[-+ #0]*(?:\*|\d+)?(?:\.(?:\*|\d+))?(hs|ls|s|l?l?[dux]|[dioucxXpfgeEG]))")
WIDE = re.compile(r"^\*|^TEXT\(|^UTF8_TO_TCHAR\(|TCHAR|\.Get\(\)$")


def formats(file):
    """(line, format, arguments, verbosity, format as written) of every UE_LOG and FString::Printf."""
    for at in file.macros("UE_LOG", "Printf"):
        parts = split(file.tokens[at + 2:close_of(file.tokens, at + 1)])
        skip = 2 if file.tokens[at].text == "UE_LOG" else 0
        if len(parts) > skip:
            text = "".join(string_value(t) for t in parts[skip] if t.kind == "string")
            yield file.tokens[at].line, text, [spell(p) for p in parts[skip + 1:]], spell(parts[1]) if skip else "Log", spell(parts[skip])


def r66(plugin: Plugin):
    for file in plugin.written:
        for line, text, arguments, verbosity, written in formats(file):
            if verbosity not in VERBOSITIES:
                yield file.path, line, f"no verbosity '{verbosity}'; use one of {', '.join(VERBOSITIES)}"
            if '"' not in written:
                yield file.path, line, "the format must be a literal; write TEXT(\"%s\") and pass the text"
                continue
            wanted = [m.group(1) for m in CONVERSION.finditer(text) if m.group(1)]
            stars = sum(m.group().count("*") for m in CONVERSION.finditer(text))
            if len(wanted) + stars != len(arguments):
                yield file.path, line, f"the format takes {len(wanted) + stars} arguments, {len(arguments)} are given"
            elif not stars:
                for conversion, argument in zip(wanted, arguments):
                    if conversion == "s" and not WIDE.search(argument.split("?")[-1]):
                        yield file.path, line, f"%s takes TCHAR*; write '*{argument}' for an FString, %hs for char*"
                    if conversion not in ("s", "p") and argument.startswith(("*", "TEXT(")) and conversion != "hs":
                        yield file.path, line, f"%{conversion} does not take '{argument}'"


TCHAR_CALLS = {"FString", "FromString", "UE_LOG", "Printf", "CreateDefaultSubobject", "FindConsoleVariable", "FindPlugin", "LoadObject",
               "Combine", "Value", "TestEqual", "TestTrue", "TestFalse", "AddError", "Equals", "StartsWith", "Contains", "AddTicker"}


def r67(plugin: Plugin):
    for file in plugin.written:
        for at, token in enumerate(file.tokens):
            if token.kind != "string" or not token.text.startswith('"') or at < 2:
                continue
            before, call = file.tokens[at - 1].text, ""
            if before in ("(", ",", "{"):
                depth, back = 0, at - 1
                while back >= 0 and depth >= 0 and file.tokens[back].text not in (";", "}"):
                    depth += {")": 1, "(": -1, "{": -1}.get(file.tokens[back].text, 0)
                    back -= 1
                call = file.tokens[back].text if back >= 0 else ""
                if call == ">":
                    while back >= 0 and file.tokens[back].text != "<":
                        back -= 1
                    call = file.tokens[back - 1].text
                declares = back >= 1 and file.tokens[back - 1].text == "FString"
                wrong = call in TCHAR_CALLS or declares
            else:
                wrong = before in ("=", "==", "!=", "+", "+=") and any(
                    t.text == "FString" for t in file.tokens[max(0, at - 4):at])
            if wrong:
                yield file.path, token.line, f"{token.text} is passed as TCHAR*; write TEXT({token.text})"


NOT_IN_CONSTRUCTORS = ("AddDynamic", "AddUObject", "AddLambda", "AddRaw", "AddStatic", "AddWeakLambda", "BindUObject", "BindLambda",
                       "AddTicker", "GetWorld", "GetGameInstance", "NewObject", "RegisterComponent", "GEngine", "thread", "Launch",
                       "CreateSocket", "FRunnableThread", "AsyncTask", "OpenSocket")


def r68(plugin: Plugin):
    for file, body in plugin.bodies:
        owner = plugin.by_name.get(body.owner)
        if owner and owner.kind == "UCLASS" and body.name == owner.name:
            for token in body.tokens:
                if token.text in NOT_IN_CONSTRUCTORS:
                    yield file.path, token.line, f"{token.text} in the constructor of {owner.name}, which also runs for the default object; move it to BeginPlay or Initialize"
        else:
            for token in body.tokens:
                if token.text == "CreateDefaultSubobject":
                    yield file.path, token.line, "CreateDefaultSubobject works in constructors alone; use NewObject here"


LIFECYCLE = ("BeginPlay", "EndPlay", "TickComponent", "BeginDestroy", "Initialize", "Deinitialize", "PostInitProperties")


def r69(plugin: Plugin):
    for file, body in plugin.bodies:
        owner = plugin.by_name.get(body.owner)
        ticks = body.name == "Tick" and owner and is_actor(plugin, owner)
        if owner and owner.kind == "UCLASS" and (body.name in LIFECYCLE or ticks):
            overrides = any(m.name == body.name and "override" in m.words_after for m in owner.members)
            if overrides and f"Super::{body.name}(" not in spell(body.tokens):
                yield file.path, body.line, f"{body.owner}::{body.name} does not call Super::{body.name}(...)"


def r70(plugin: Plugin):
    for file, type_ in plugin.types:
        for member in type_.members if type_.kind == "UCLASS" else ():
            if member.parameters is None and pieces(member.type)[0] in ("TUniquePtr", "std::unique_ptr"):
                helper = any(p.type == "FVTableHelper&" for m in type_.members for p in m.parameters or [])
                destructor = any(m.name == "~" + type_.name and m.body is None for m in type_.members)
                if not (helper and destructor):
                    yield file.path, member.line, f"{type_.name}::{member.name}: the generated code needs the complete type; use TPimplPtr"


TAKES_LAMBDA = ("AsyncTask", "Async", "AddTicker", "AddLambda", "BindLambda", "CreateLambda", "Launch", "AsyncThread")


def r71(plugin: Plugin):
    for file in plugin.written:
        for at in file.macros(*TAKES_LAMBDA):
            arguments = file.tokens[at + 2:close_of(file.tokens, at + 1)]
            for index, token in enumerate(arguments):
                if token.text == "[" and (index == 0 or arguments[index - 1].text in ("(", ",", "{", "=", "return")):
                    for part in split(arguments[index + 1:close_of(arguments, index)]):
                        capture = spell(part)
                        name = part[0].text if part else ""
                        raw = re.search(rf"\b[UA][A-Z]\w*\s*\*\s*{re.escape(name)}\b", file.text) if len(part) == 1 and name.isidentifier() else None
                        if capture in ("this", "&", "=", "*this") or capture.startswith("&") or raw or capture.endswith("=this"):
                            yield file.path, token.line, f"the lambda may outlive '{capture}'; capture a TWeakObjectPtr or plain values"


DESCRIPTOR_KEYS = set("""FileVersion Version VersionName FriendlyName Description Category CreatedBy CreatedByURL DocsURL
    MarketplaceURL SupportURL EnabledByDefault CanContainContent IsBetaVersion IsExperimentalVersion Installed Modules Plugins
    SupportedTargetPlatforms CanBeUsedWithUnrealHeaderTool RequiresBuildPlatform Hidden ExplicitlyLoaded""".split())
MODULE_KEYS = set("""Name Type LoadingPhase PlatformAllowList PlatformDenyList TargetAllowList TargetDenyList
    TargetConfigurationAllowList TargetConfigurationDenyList ProgramAllowList ProgramDenyList GameTargetAllowList
    HasExplicitPlatforms AdditionalDependencies WhitelistPlatforms BlacklistPlatforms""".split())
MODULE_TYPES = ("Runtime", "RuntimeNoCommandlet", "DeveloperTool", "Editor", "EditorNoCommandlet", "UncookedOnly", "Program")
PHASES = ("Default", "PreDefault", "PreLoadingScreen", "PostEngineInit", "PostConfigInit")


def strict(text: str):
    """JSON without the extras of Python's reader: no NaN, no key twice."""
    def constant(name):
        raise ValueError(f"{name} is not JSON")

    def pairs(found):
        keys = [key for key, _ in found]
        twice = next((key for key in keys if keys.count(key) > 1), None)
        if twice:
            raise ValueError(f"key '{twice}' is there twice")
        return dict(found)

    return json.loads(text, parse_constant=constant, object_pairs_hook=pairs)


def r72(plugin: Plugin):
    if len(plugin.descriptors) != 1:
        yield ".", 1, f"{len(plugin.descriptors)} .uplugin files; a plugin has one"
    for path, text in plugin.descriptors:
        def line_of(word):
            return next((n for n, line in enumerate(text.splitlines(), 1) if f'"{word}"' in line), 1)
        try:
            found = strict(text)
        except ValueError as error:
            yield path, getattr(error, "lineno", 1), f"no strict JSON: {error}"
            continue
        if not isinstance(found, dict):
            yield path, 1, "the descriptor is a JSON object"
            continue
        if found.get("FileVersion") != 3 or isinstance(found.get("FileVersion"), bool):
            yield path, line_of("FileVersion"), "FileVersion must be 3"
        if "EngineVersion" in found:
            yield path, line_of("EngineVersion"), "EngineVersion is written when a release is packed; remove it here"
        for key in found:
            if key not in DESCRIPTOR_KEYS | {"EngineVersion"}:
                yield path, line_of(key), f"unknown key '{key}'; correct its spelling"
        modules = found.get("Modules", [])
        for module in modules if isinstance(modules, list) else []:
            name = module.get("Name", "") if isinstance(module, dict) else ""
            if not name:
                yield path, line_of("Modules"), "every module is an object with a Name"
                continue
            for key in module:
                if key not in MODULE_KEYS:
                    yield path, line_of(key), f"module {name}: unknown key '{key}'"
            if module.get("Type") not in MODULE_TYPES:
                yield path, line_of(name), f"module {name}: Type '{module.get('Type')}' is none of {', '.join(MODULE_TYPES)}"
            if module.get("LoadingPhase", "Default") not in PHASES:
                yield path, line_of(name), f"module {name}: LoadingPhase '{module.get('LoadingPhase')}' is none of {', '.join(PHASES)}"
            if name not in {build.module for build in plugin.builds}:
                yield path, line_of(name), f"module {name} has no {name}.Build.cs"


BANNED = set("""check verify ensure checkf verifyf ensureMsgf TEXT PI TRUE FALSE IN OUT OPTIONAL CONST VOID ERROR min max near far
    interface small Yield SendMessage GetMessage PostMessage CreateEvent CreateWindow GetObject GetCurrentTime LoadString DrawText
    GetClassName UpdateResource INFINITE UINT INT FLOAT DWORD TCHAR""".split())


def r73(plugin: Plugin):
    core = [(f.path, f.tokens) for f in plugin.files if f.module in CORE_MODULES and f.public] + plugin.core_headers
    for path, tokens in core:
        for token in tokens:
            words = [token.text] if token.kind == "word" else re.findall(r"\w+", token.text) if (
                token.kind == "directive" and "include" not in token.text and "push_macro" not in token.text) else []
            for word in BANNED & set(words):
                yield path, token.line, f"'{word}' is a macro in Unreal or Windows; rename it"


def r74(plugin: Plugin):
    path = plugin.root / "Config/FilterPlugin.ini"
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines() if path.is_file() else [], 1):
        entry = line.strip()
        if entry and not entry.startswith((";", "[", "#")):
            pattern = entry.lstrip("/").replace("...", "**/*" if entry.endswith("...") else "**")
            if not any(found.is_file() for found in plugin.root.glob(pattern)):
                yield "Config/FilterPlugin.ini", number, f"'{entry}' matches no file of the plugin"


def r75(plugin: Plugin):
    for file in plugin.written:
        for token in file.tokens:
            if token.kind == "string" and re.search(r"(^|[/\\])Source[/\\]|^[A-Za-z]:[/\\]", string_value(token)):
                yield file.path, token.line, f"{token.text}: a packaged game has no source folder; use FPaths or the plugin's folder"
