"""The node table: every Blueprint node of the plugin with its pins, read from the headers, which are the one source."""
import re

from unreal_lint.declarations import Member, Type
from unreal_lint.functions import is_output
from unreal_lint.model import File, Plugin
from unreal_lint.properties import bare, pieces
from unreal_lint.tokens import spell, split, string_value

TYPES = {"bool": "bool", "uint8": "byte", "int32": "int", "int64": "int64", "float": "float", "double": "double",
         "FString": "string", "FName": "name", "FText": "text"}


def doc_above(file: File, line: int) -> str:
    """The /** */ comment that ends right above a line, without its stars; '' where there is none."""
    lines = file.text.split("\n")
    end = line - 2
    if end < 0 or not lines[end].rstrip().endswith("*/"):
        return ""
    start = end
    while start >= 0 and "/**" not in lines[start]:
        start -= 1
    text = "\n".join(lines[start:end + 1]).strip().removeprefix("/**").removesuffix("*/")
    return "\n".join(re.sub(r"^\s*\*? ?", "", part).rstrip() for part in text.split("\n")).strip()


def read_doc(text: str) -> tuple[str, dict[str, str]]:
    """(what a node does, parameter -> what it is) of a comment."""
    what, *parameters = re.split(r"\s*@param\s+", text)
    named = {}
    for part in parameters:
        name, _, rest = part.partition(" ")
        named[name] = " ".join(rest.split())
    return " ".join(what.split()), named


def display(name: str) -> str:
    """A name as the editor shows it: bAtGoal -> At Goal, GetOpenPort -> Get Open Port."""
    name = re.sub(r"^b(?=[A-Z])", "", name)
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name)


def type_name(written: str) -> str:
    """A pin's type: int, string, FConsacSpace, UConsacModel; with [] where it is an array."""
    written = re.sub(r"UPARAM\(.*?\)", "", written).replace("const ", "").rstrip("& ")
    outer, arguments = pieces(written)
    if outer == "TArray":
        return type_name(arguments[0]) + "[]"
    if outer in ("TObjectPtr", "TWeakObjectPtr", "TEnumAsByte"):
        return type_name(arguments[0])
    if outer == "TSubclassOf":
        return f"class {type_name(arguments[0])}"
    return TYPES.get(bare(outer), bare(outer))


def value_of(tokens: list) -> str:
    """A default as a pin shows it."""
    text = spell(tokens)
    literal = next((t for t in tokens if t.kind == "string"), None)
    if literal:
        return string_value(literal)
    if re.fullmatch(r"[-+]?[\d.]+f?", text):
        return text.rstrip("f") if "." not in text else text.rstrip("f").rstrip("0").rstrip(".") or "0"
    return text.rsplit("::", 1)[-1]


def enumerators(plugin: Plugin, name: str) -> list[tuple[str, str]]:
    """(enumerator, what it means) of an enum of the plugin."""
    file, type_ = next((f, t) for f, t in plugin.types if t.name == name)
    lines = file.text.split("\n")
    found = []
    for part in split(type_.body):
        if part:
            line = part[0].line
            found.append((part[0].text, " ".join(doc_above(file, line).split()) if lines[line - 2].strip().endswith("*/") else ""))
    return found


def pin(name: str, way: str, type_: str, **more) -> dict:
    return {"pin": name, "way": way, "type": type_} | {key: value for key, value in more.items() if value not in ("", False, None)}


def needs_link(parameter, member: Member) -> bool:
    """A struct or an array by reference has no default: an unlinked pin would stop the Blueprint's compiler."""
    kind = type_name(parameter.type)
    by_reference = parameter.type.endswith("&") and (kind.endswith("[]") or kind[:1] == "F")
    return by_reference and parameter.name not in member.meta.get("AutoCreateRefTerm", "").split(",")


def exec_pins(plugin: Plugin, member: Member) -> tuple[list[dict], list[dict], set[str]]:
    """(exec inputs, exec outputs, parameters that became exec pins) of a function that is not pure."""
    inputs, outputs, taken = [pin("execute", "in", "exec")], [pin("then", "out", "exec")], set()
    for name in filter(None, re.split(r"[,|]\s*", member.meta.get("ExpandEnumAsExecs", ""))):
        parameter = next(p for p in member.parameters if p.name == name)
        taken.add(name)
        made = [pin(e, "out" if is_output(parameter) else "in", "exec", says=says)
                for e, says in enumerators(plugin, bare(parameter.type))]
        if is_output(parameter):
            outputs = made
        else:
            inputs = made
    return inputs, outputs, taken


def is_pure(member: Member) -> bool:
    """Whether the node has no exec pins: said so, or const and nothing else said."""
    said = member.specifiers.get("BlueprintPure")
    return said != "false" and (said is not None or "const" in member.words_after)


def function_node(plugin: Plugin, file: File, type_: Type, member: Member) -> dict:
    what, says = read_doc(doc_above(file, member.line))
    static = "static" in member.words_before
    pure = is_pure(member)
    inputs, outputs, taken = ([], [], set()) if pure else exec_pins(plugin, member)
    if not static:
        inputs.append(pin("self", "in", type_.name, says="Target"))
    advanced = re.split(r",\s*", member.meta.get("AdvancedDisplay", ""))
    for parameter in member.parameters or []:
        if parameter.name in taken:
            continue
        if is_output(parameter):
            outputs.append(pin(parameter.name, "out", type_name(parameter.type), says=says.get(parameter.name, "")))
        else:
            inputs.append(pin(parameter.name, "in", type_name(parameter.type), default=value_of(parameter.default),
                              must_link=needs_link(parameter, member), says=says.get(parameter.name, ""),
                              hidden=parameter.name == member.meta.get("WorldContext"), advanced=parameter.name in advanced))
    if member.type != "void":
        outputs.append(pin("ReturnValue", "out", type_name(member.type)))
    node = {"node": member.meta.get("DisplayName", display(member.name)), "kind": "pure" if pure else "function",
            "class": type_.name, "function": member.name, "static": static, "category": member.specifiers.get("Category", ""),
            "header": file.name, "tooltip": what, "pins": inputs + outputs}
    if member.meta.get("BlueprintInternalUseOnly") == "true":
        as_async(plugin, type_, node)
    return node


def delegate_pins(plugin: Plugin, name: str) -> list[dict]:
    arguments = plugin.delegates[name].arguments[1:]
    return [pin(spell(arguments[at + 1]), "out", type_name(spell(arguments[at]))) for at in range(0, len(arguments), 2)]


def as_async(plugin: Plugin, type_: Type, node: dict) -> None:
    """An async factory's node: an exec pin for each event of its class, and the events' values."""
    file = next(f for f, t in plugin.types if t is type_)
    events = [m for m in type_.members if m.has("BlueprintAssignable")]
    node["kind"] = "async"
    node["pins"] = [p for p in node["pins"] if p["pin"] != "ReturnValue"]
    node["pins"] += [pin(e.name, "out", "exec", says=read_doc(doc_above(file, e.line))[0]) for e in events]
    node["pins"] += delegate_pins(plugin, events[0].type) if events else []


def event_node(plugin: Plugin, file: File, type_: Type, member: Member) -> dict:
    what, _ = read_doc(doc_above(file, member.line))
    return {"node": display(member.name), "kind": "event", "class": type_.name, "function": member.name, "static": False,
            "delegate": member.type, "category": member.specifiers.get("Category", ""), "header": file.name, "tooltip": what,
            "pins": [pin("then", "out", "exec"), *delegate_pins(plugin, member.type)]}


def property_row(file: File, type_: Type, member: Member) -> dict:
    what, _ = read_doc(doc_above(file, member.line))
    tokens = member.tokens
    at = next((i for i, t in enumerate(tokens) if t.text == "="), len(tokens))
    row = {"property": display(member.name), "class": type_.name, "name": member.name, "type": type_name(member.type),
           "default": value_of(tokens[at + 1:]), "category": member.specifiers.get("Category", ""), "tooltip": what}
    return row | {key: member.meta[key] for key in ("ClampMin", "ClampMax") if key in member.meta}


def is_asset(plugin: Plugin, type_: Type) -> bool:
    """Generated assets of hyperparameters: their one table is the program's."""
    return "UConsacHyperparameters" in type_.bases


def table(plugin: Plugin) -> dict:
    """{"nodes": [...], "properties": [...], "types": [...]} of the plugin's own module, in the headers' order."""
    nodes, properties, types = [], [], []
    for file, type_ in plugin.types:
        if not type_.kind or file.module != "Consac":
            continue
        base = type_.bases[0] if type_.bases and type_.keyword != "enum" else ""
        types.append({"type": type_.name, "kind": type_.kind, "base": base, "header": file.name,
                      "tooltip": read_doc(doc_above(file, type_.line))[0]})
        if type_.kind == "UENUM":
            types[-1]["values"] = [{"value": name, "says": says} for name, says in enumerators(plugin, type_.name)]
        for member in type_.members:
            if member.kind == "UFUNCTION" and member.has("BlueprintCallable", "BlueprintPure"):
                nodes.append(function_node(plugin, file, type_, member))
            elif member.has("BlueprintAssignable"):
                if type_.bases[0] != "UBlueprintAsyncActionBase":
                    nodes.append(event_node(plugin, file, type_, member))
            elif member.kind == "UPROPERTY" and member.has("EditAnywhere", "BlueprintReadOnly", "BlueprintReadWrite"):
                if not is_asset(plugin, type_):
                    properties.append(property_row(file, type_, member))
    return {"nodes": nodes, "properties": properties, "types": types}
