"""Rules 37 to 57: functions, delegates, specifiers, export."""
import re

from .model import Plugin
from .properties import bare, pieces
from .tokens import close_of, spell, split

CALLABLE = ("BlueprintCallable", "BlueprintPure", "BlueprintImplementableEvent", "BlueprintNativeEvent")


def functions(plugin: Plugin):
    return plugin.members("UFUNCTION")


def is_output(parameter) -> bool:
    """Whether a parameter is an output pin: a reference that is not const and not UPARAM(ref)."""
    return parameter.type.endswith("&") and not re.search(r"\bconst\b", parameter.type) and "UPARAM(ref" not in parameter.type


def bases_of(plugin: Plugin, type_):
    """The base classes that the plugin declares, nearest first."""
    seen = {type_.name}
    while type_.bases and type_.bases[0] in plugin.by_name and type_.bases[0] not in seen:
        type_ = plugin.by_name[type_.bases[0]]
        seen.add(type_.name)
        yield type_


def r37(plugin: Plugin):
    for file, type_, member in functions(plugin):
        if member.has(*CALLABLE) and not member.specifiers.get("Category"):
            yield file.path, member.line, f'{member.name} has no category; add Category="Consac|..."'


def r38(plugin: Plugin):
    for file, type_ in plugin.types:
        seen = {}
        for member in type_.members:
            if member.parameters is None:
                continue
            if member.kind == "UFUNCTION":
                if member.template:
                    yield file.path, member.line, f"{member.name}: a UFUNCTION cannot be a template"
                if "=" in member.words_after:
                    yield file.path, member.line, f"{member.name}: a UFUNCTION cannot be '= delete', '= default' or '= 0'"
            if member.name in seen and "UFUNCTION" in (member.kind, seen[member.name].kind):
                yield file.path, member.line, f"{type_.name}::{member.name} is overloaded; give every UFUNCTION its own name"
            seen[member.name] = member
        for base in bases_of(plugin, type_):
            for other in base.members:
                own = seen.get(other.name)
                if other.kind == "UFUNCTION" and own and [p.type for p in own.parameters] != [p.type for p in other.parameters]:
                    yield file.path, own.line, f"{own.name} overloads the UFUNCTION of {base.name}; give it another name"


def r39(plugin: Plugin):
    for file, type_, member in functions(plugin):
        above = [b.name for b in bases_of(plugin, type_) for m in b.members if m.name == member.name and m.kind == "UFUNCTION"]
        if "override" in member.words_after or above:
            yield file.path, member.line, f"{member.name} overrides; remove UFUNCTION() from the override"


def r40(plugin: Plugin):
    for file, type_, member in functions(plugin):
        for parameter in member.parameters or []:
            if "TObjectPtr" in parameter.type:
                yield file.path, parameter.line, f"{member.name}: parameter {parameter.name} is a raw pointer, not TObjectPtr"
            elif re.match(r"[UA][A-Z]\w*$", bare(parameter.type)) and "*" not in parameter.type and "<" not in parameter.type:
                yield file.path, parameter.line, f"{member.name}: pass {bare(parameter.type)} by pointer"


def r41(plugin: Plugin):
    for file, type_, member in functions(plugin):
        if "BlueprintPure" in member.specifiers and member.specifiers["BlueprintPure"] != "false" and member.type == "void":
            if not any(is_output(p) for p in member.parameters or []):
                yield file.path, member.line, f"{member.name} is pure and returns nothing; make it BlueprintCallable"


def r42(plugin: Plugin):
    for file, type_, member in functions(plugin):
        if member.has("BlueprintImplementableEvent"):
            if "virtual" in member.words_before:
                yield file.path, member.line, f"{member.name} is implemented in Blueprint and cannot be virtual"
            for source, body in plugin.bodies:
                if body.owner == type_.name and body.name == member.name:
                    yield source.path, body.line, f"{member.name} is implemented in Blueprint; remove this body"
            for parameter in member.parameters:
                outer = pieces(bare(parameter.type))[0] if "<" not in parameter.type else pieces(parameter.type)[0]
                struct = outer in ("TArray", "TSet", "TMap", "FString") or (
                    outer in plugin.by_name and plugin.by_name[outer].kind == "USTRUCT")
                if struct and not parameter.type.endswith("&"):
                    yield file.path, parameter.line, f"{member.name}: pass {parameter.name} as const {outer}&"


def r43(plugin: Plugin):
    for file, type_, member in functions(plugin):
        if member.has("BlueprintNativeEvent"):
            own = {body.name: (source, body) for source, body in plugin.bodies if body.owner == type_.name}
            if member.name in own:
                source, body = own[member.name]
                yield source.path, body.line, f"define {member.name}_Implementation; the engine writes {member.name} itself"
            if member.name + "_Implementation" not in own and type_.kind == "UCLASS":
                yield file.path, member.line, f"{type_.name}::{member.name}_Implementation is nowhere defined"


def r44(plugin: Plugin):
    for file, type_, member in functions(plugin):
        if member.has("BlueprintImplementableEvent") and member.has("BlueprintNativeEvent"):
            yield file.path, member.line, f"{member.name} is either BlueprintImplementableEvent or BlueprintNativeEvent"
        if member.has("SealedEvent") and not member.has("Server", "Client", "NetMulticast", "Exec"):
            yield file.path, member.line, f"{member.name}: SealedEvent is for network and exec functions; remove it"


NAMING_META = ("WorldContext", "HidePin", "InternalUseParam", "DefaultToSelf", "ExpandEnumAsExecs", "ExpandBoolAsExecs",
               "AutoCreateRefTerm", "AdvancedDisplay", "LatentInfo")


def r45(plugin: Plugin):
    for file, type_, member in functions(plugin):
        names = {p.name for p in member.parameters or []} | ({"ReturnValue"} if member.type != "void" else set())
        for key in NAMING_META:
            for name in re.split(r"[,|]\s*", member.meta.get(key, "")):
                if name and name not in names and not (key == "AdvancedDisplay" and name.isdigit()):
                    yield file.path, member.line, f"{member.name}: {key} names '{name}', which is no parameter"


def r46(plugin: Plugin):
    for file, type_, member in functions(plugin):
        named = member.meta.get("ExpandEnumAsExecs", "")
        if named and member.has("BlueprintPure"):
            yield file.path, member.line, f"{member.name}: a pure function has no exec pins; remove ExpandEnumAsExecs"
        for name in re.split(r"[,|]\s*", named):
            of = next((p.type for p in member.parameters or [] if p.name == name), member.type if name == "ReturnValue" else "")
            own = plugin.by_name.get(bare(of))
            if of and bare(of) != "bool" and not (own and own.kind == "UENUM" and own.scoped):
                yield file.path, member.line, f"{member.name}: {name} must be an enum class with UENUM, or a bool"


def r47(plugin: Plugin):
    for file, type_, member in functions(plugin):
        infos = [p.name for p in member.parameters or [] if bare(p.type) == "FLatentActionInfo"]
        if "Latent" in member.meta and (len(infos) != 1 or member.meta.get("LatentInfo") != infos[0]):
            yield file.path, member.line, f'{member.name}: a latent function has one FLatentActionInfo, named by LatentInfo="..."'


def r48(plugin: Plugin):
    for file, type_, member in functions(plugin):
        roots = type_.bases[:1] + [base for b in bases_of(plugin, type_) for base in b.bases[:1]]
        if "UBlueprintAsyncActionBase" in roots and member.has("BlueprintCallable"):
            own = bare(member.type) == type_.name
            if "static" in member.words_before:
                if not own or member.meta.get("BlueprintInternalUseOnly") != "true":
                    yield file.path, member.line, f'{member.name}: an async factory returns {type_.name}* and has meta=(BlueprintInternalUseOnly="true")'
            elif own:
                yield file.path, member.line, f"{member.name}: an async factory is static"


COUNTS = {"OneParam": 1, "TwoParams": 2, "ThreeParams": 3, "FourParams": 4, "FiveParams": 5, "SixParams": 6,
          "SevenParams": 7, "EightParams": 8, "NineParams": 9}


def r49(plugin: Plugin):
    for file in plugin.written:
        for delegate in file.delegates:
            returns = "RetVal" in delegate.macro
            arguments = delegate.arguments[returns:]
            name = spell(arguments[0]) if arguments else ""
            if not re.match(r"F[A-Z]\w*$", name):
                yield file.path, delegate.line, f"{delegate.macro}: the name '{name}' must begin with F"
            count = COUNTS.get(delegate.macro.rsplit("_", 1)[-1], 0)
            if len(arguments) != 1 + 2 * count:
                yield file.path, delegate.line, f"{name}: {delegate.macro} takes {count} pairs 'type, name', each parted by a comma"
            for part in arguments[1::2]:
                if "," in spell(part):
                    yield file.path, delegate.line, f"{name}: '{spell(part)}' has a comma; wrap it in a USTRUCT"
        for at in file.macros("AddDynamic", "BindDynamic", "AddUniqueDynamic"):
            bound = spell(split(file.tokens[at + 2:close_of(file.tokens, at + 1)])[-1])
            owner, _, function = bound.replace("&", "").rpartition("::")
            for type_ in [plugin.by_name[owner]] if owner in plugin.by_name else []:
                if not any(m.name == function and m.kind == "UFUNCTION" for t in [type_, *bases_of(plugin, type_)] for m in t.members):
                    yield file.path, file.tokens[at].line, f"{bound} is bound to a dynamic delegate and is no UFUNCTION()"


def r50(plugin: Plugin):
    for file, type_, member in functions(plugin):
        for parameter in member.parameters or []:
            delegate = plugin.delegates.get(bare(parameter.type))
            if delegate and delegate.multicast:
                yield file.path, parameter.line, f"{member.name}: a multicast delegate cannot be a parameter; declare a single one"


def r51(plugin: Plugin):
    for file, type_, member in functions(plugin):
        if "CommutativeAssociativeBinaryOperator" in member.meta:
            types = [p.type for p in member.parameters]
            if len(types) < 2 or types[0] != types[1] or member.type == "void":
                yield file.path, member.line, f"{member.name}: CommutativeAssociativeBinaryOperator takes two parameters of one type and returns a value"


DEFAULT = re.compile(r"""[-+]?[\w.]+f? | "[^"]*" | TEXT\("[^"]*"\) | true | false | nullptr | E\w+::\w+ | NAME_None
                         | F\w+\(\) | FName\(\s*(TEXT\()?"[^"]*"\)?\) | F(Vector|Rotator|Vector2D|LinearColor|Color)\([-+\d.f,\s]*\)
                         | F(Vector|Rotator|Vector2D)::ZeroVector | FRotator::ZeroRotator | FLinearColor::(White|Black)""", re.X)


def r52(plugin: Plugin):
    for file, type_, member in functions(plugin):
        for parameter in member.parameters or []:
            default = spell(parameter.default)
            if default and (not DEFAULT.fullmatch(default) or re.fullmatch(r"[A-Za-z_]\w*", default)
                            and default not in ("true", "false", "nullptr", "NAME_None")):
                yield file.path, parameter.line, f"{member.name}: the header tool cannot read the default '{default}'; use a literal"


def r53(plugin: Plugin):
    for file, type_, member in functions(plugin):
        names = {m.name for t in [type_, *bases_of(plugin, type_)] for m in t.members if m.parameters is None}
        for parameter in member.parameters or []:
            if parameter.name in names:
                yield file.path, parameter.line, f"{member.name}: parameter {parameter.name} shadows a member; rename it"


def r54(plugin: Plugin):
    libraries = set()
    for file, type_ in plugin.types:
        if "UBlueprintFunctionLibrary" in type_.bases:
            libraries.add(type_.name)
            for member in type_.members:
                if member.kind == "UFUNCTION" and "static" not in member.words_before:
                    yield file.path, member.line, f"{member.name}: functions of a library are static"
    for file in plugin.sources:
        for at in range(len(file.tokens) - 2):
            if file.tokens[at].text == "NewObject" and file.tokens[at + 2].text in libraries:
                yield file.path, file.tokens[at].line, f"a function library is never created; call {file.tokens[at + 2].text}::..."


def r55(plugin: Plugin):
    for file, type_, member in functions(plugin):
        for parameter in member.parameters or []:
            if "UPARAM(ref" in parameter.type and (not parameter.type.endswith("&") or re.search(r"\bconst\b", parameter.type)):
                yield file.path, parameter.line, f"{member.name}: UPARAM(ref) {parameter.name} must be a reference that is not const"


# The specifiers and metadata keys that this project uses or may use. One that is not here is refused: an unknown
# specifier stops the header tool, an unknown metadata key is ignored without a word.
SPECIFIERS = {
    "UCLASS": """Abstract Blueprintable BlueprintType ClassGroup Config Const DefaultConfig DefaultToInstanced Deprecated
        EditInlineNew GlobalUserConfig HideCategories HideDropdown Hidden MinimalAPI NotBlueprintable NotBlueprintType NotPlaceable
        Placeable ShowCategories Transient Within""",
    "USTRUCT": "Atomic BlueprintType NoExport Immutable",
    "UENUM": "BlueprintType Flags",
    "UINTERFACE": "BlueprintType Blueprintable MinimalAPI NotBlueprintable",
    "UPROPERTY": """AdvancedDisplay AssetRegistrySearchable BlueprintAssignable BlueprintAuthorityOnly BlueprintCallable BlueprintGetter
        BlueprintReadOnly BlueprintReadWrite BlueprintSetter Category Config DuplicateTransient EditAnywhere
        EditDefaultsOnly EditFixedSize EditInstanceOnly Export GlobalConfig Instanced Interp Localized Native NoClear
        NonPIEDuplicateTransient NonTransactional NotReplicated Replicated ReplicatedUsing SaveGame SimpleDisplay SkipSerialization
        TextExportTransient Transient VisibleAnywhere VisibleDefaultsOnly VisibleInstanceOnly""",
    "UFUNCTION": """BlueprintAuthorityOnly BlueprintCallable BlueprintCosmetic BlueprintGetter BlueprintImplementableEvent
        BlueprintInternalUseOnly BlueprintNativeEvent BlueprintPure BlueprintSetter CallInEditor Category Client
        CustomThunk Exec NetMulticast Reliable SealedEvent Server ServiceRequest ServiceResponse Unreliable WithValidation""",
}
META = set("""AdvancedDisplay AllowPrivateAccess AllowedClasses ArrayParm AutoCreateRefTerm BlueprintInternalUseOnly
    BlueprintSpawnableComponent BlueprintThreadSafe CallInEditor ClampMax ClampMin CommutativeAssociativeBinaryOperator CompactNodeTitle
    DefaultToSelf Delta DeprecatedFunction DeprecationMessage DeterminesOutputType DevelopmentOnly DisplayAfter DisplayName
    DisplayPriority EditCondition EditConditionHides ExpandBoolAsExecs ExpandEnumAsExecs ForceUnits HasDedicatedAsyncNode HasNativeBreak
    HasNativeMake HidePin Hidden HideSelfPin InlineEditConditionToggle InternalUseParam Keywords Latent LatentInfo MakeEditWidget MultiLine
    Multiple ReturnDisplayName ScriptName ShortToolTip ShowOnlyInnerProperties SliderExponent TitleProperty ToolTip Tooltip UIMax
    UIMin Units UnsafeDuringActorConstruction UseEnumValuesAsMaskValuesInEditor WorldContext""".split())


def r56(plugin: Plugin):
    known = {macro: {name.lower() for name in names.split()} for macro, names in SPECIFIERS.items()}
    def unknown(macro, specifiers, meta):
        yield from (f"unknown {macro} specifier '{name}'; correct its spelling" for name in specifiers if name.lower() not in known[macro])
        yield from (f"unknown metadata key '{name}' is ignored by the engine; correct its spelling" for name in meta if name not in META)
    for file, type_ in plugin.types:
        if type_.kind:
            for what in unknown(type_.kind, type_.specifiers, type_.meta):
                yield file.path, type_.line, what
            for member in type_.members:
                for what in unknown(member.kind, member.specifiers, member.meta) if member.kind else ():
                    yield file.path, member.line, what


def r57(plugin: Plugin):
    for file, type_ in plugin.types:
        if type_.kind in ("UCLASS", "USTRUCT", "UINTERFACE") and file.public:
            want = file.module.upper() + "_API"
            if type_.api != want and not (type_.kind == "UINTERFACE" and "MinimalAPI" in type_.specifiers):
                yield file.path, type_.line, f"{type_.name} is public; write '{type_.keyword} {want} {type_.name}'"
        if type_.api and "MinimalAPI" in type_.specifiers:
            yield file.path, type_.line, f"{type_.name} has both {type_.api} and MinimalAPI; keep one"
