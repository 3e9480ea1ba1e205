"""A graph as text that the Blueprint editor takes from the clipboard. Written after public examples of such text; nobody
has pasted these yet."""
import hashlib
import re

from .graph import Catalogue, Graph, Node

SELF_MODULE = "/Script/Consac"
PACKAGE = f"/Script/CoreUObject.Package'{SELF_MODULE}'"
CLASSES = {"function": "K2Node_CallFunction", "pure": "K2Node_CallFunction", "own": "K2Node_CallFunction", "async": "K2Node_AsyncAction",
           "override": "K2Node_Event", "custom": "K2Node_CustomEvent", "event": "K2Node_ComponentBoundEvent", "branch": "K2Node_IfThenElse",
           "get": "K2Node_VariableGet", "set": "K2Node_VariableSet", "break": "K2Node_BreakStruct"}


def path_of(name: str) -> str:
    """UConsacSocket -> /Script/Consac.ConsacSocket; an engine path stays."""
    return name if name.startswith("/") else f"{SELF_MODULE}.{name if name[:1] == 'E' else name[1:]}"


def ref(kind: str, name: str) -> str:
    return f"\"/Script/CoreUObject.{kind}'{path_of(name)}'\""


ENGINE_OBJECTS = {"UObject": "/Script/CoreUObject.Object", "AActor": "/Script/Engine.Actor", "FVector": "/Script/CoreUObject.Vector"}


def pin_type(type_: str) -> str:
    """PinType fields of a type."""
    array, base = type_.endswith("[]"), type_.removesuffix("[]")
    category, sub, target = base, "", "None"
    if base in ("float", "double"):
        category, sub = "real", base
    elif base[:1] == "E":
        category, target = "byte", ref("Enum", base)
    elif base[:1] == "F" and base not in ("FString",):
        category, target = "struct", ref("ScriptStruct", ENGINE_OBJECTS.get(base, base))
    elif base[:1] in "UA":
        category, target = "object", ref("Class", ENGINE_OBJECTS.get(base, base))
    container = "Array" if array else "None"
    return (f'PinType.PinCategory="{category}",PinType.PinSubCategory="{sub}",PinType.PinSubCategoryObject={target},'
            f"PinType.PinSubCategoryMemberReference=(),PinType.PinValueType=(),PinType.ContainerType={container},PinType.bIsReference=False,"
            "PinType.bIsConst=False,PinType.bIsWeakPointer=False,PinType.bIsUObjectWrapper=False,PinType.bSerializeAsSinglePrecisionFloat=False")


def identity(*words: str) -> str:
    """32 hexadecimal digits that stay the same from one writing to the next."""
    return hashlib.md5("/".join(words).encode(), usedforsecurity=False).hexdigest().upper()


def number(graph: Graph, node: Node) -> str:
    """The object's name: its class and a number."""
    same = [n for n in graph.nodes.values() if CLASSES[n.row["kind"]] == CLASSES[node.row["kind"]]]
    return f"{CLASSES[node.row['kind']]}_{same.index(node)}"


def signature(row: dict) -> str:
    """The function that the header tool makes of an event's delegate."""
    return f"{row['delegate'][1:]}__DelegateSignature"


def bound(graph: Graph, node: Node) -> list[str]:
    """What ties an event's node to its component: without the last two it is pasted and never called."""
    row = node.row
    name = f"BndEvt__Consac_{row['component']}_{number(graph, node)}_{signature(row)}"
    return [f'DelegatePropertyName="{row["function"]}"', f"DelegateOwnerClass={ref('Class', row['class'])}",
            f'ComponentPropertyName="{row["component"]}"', f"EventReference=(MemberParent=\"{PACKAGE}\",MemberName=\"{signature(row)}\")",
            "bInternalEvent=True", f'CustomFunctionName="{name}"']


def head(graph: Graph, node: Node) -> list[str]:
    """What tells the editor which node it is."""
    row, kind = node.row, node.row["kind"]
    if kind in ("function", "pure"):
        pure = ["bIsPureFunc=True"] if kind == "pure" else []
        return [f'FunctionReference=(MemberParent={ref("Class", row["class"])},MemberName="{row["function"]}")', *pure]
    if kind == "own":
        return [f'FunctionReference=(MemberName="{row["function"]}",bSelfContext=True)']
    if kind == "async":
        class_ = ref("Class", row["class"])
        return [f'ProxyFactoryFunctionName="{row["function"]}"', f"ProxyFactoryClass={class_}", f"ProxyClass={class_}"]
    if kind == "override":
        return [f'EventReference=(MemberParent={ref("Class", row["class"])},MemberName="{row["function"]}")', "bOverrideFunction=True"]
    if kind == "custom":
        return [f'CustomFunctionName="{row["function"]}"']
    if kind == "event":
        return bound(graph, node)
    if kind in ("get", "set"):
        return [f'VariableReference=(MemberName="{row["function"]}",bSelfContext=True)']
    if kind == "break":
        return [f"StructType={ref('ScriptStruct', row['class'])}"]
    return []


def pin_line(graph: Graph, node: Node, pin: dict, links: dict) -> str:
    fields = [f"PinId={identity(graph.name, node.id, pin['pin'], pin['way'])}", f'PinName="{pin["pin"]}"']
    if pin["way"] == "out":
        fields.append('Direction="EGPD_Output"')
    fields.append(pin_type(pin["type"]))
    value = node.values.get(pin["pin"], pin.get("default", ""))
    if value and pin["way"] == "in":
        fields.append(f'DefaultValue="{value}"')
    joined = links.get((node.id, pin["pin"], pin["way"]), [])
    if joined:
        ends = (f"{number(graph, other)} {identity(graph.name, other.id, name, way)}," for other, name, way in joined)
        fields.append(f"LinkedTo=({''.join(ends)})")
    if pin.get("hidden"):
        fields.append("bHidden=True")
    if pin.get("advanced"):
        fields.append("bAdvancedView=True")
    return f"   CustomProperties Pin ({','.join(fields)},)"


def user_pin(pin: dict) -> str:
    """A pin of a custom event, which its node declares."""
    fields = pin_type(pin["type"]).replace("PinType.", "")
    return f'   CustomProperties UserDefinedPin (PinName="{pin["pin"]}",PinType=({fields}),DesiredPinDirection=EGPD_Output)'


def paste(graph: Graph, catalogue: Catalogue) -> str:
    """The text of a graph without faults."""
    links: dict[tuple, list] = {}
    for link in graph.links:
        links.setdefault((link.source.id, link.out, "out"), []).append((link.target, link.into, "in"))
        links.setdefault((link.target.id, link.into, "in"), []).append((link.source, link.out, "out"))
    out = []
    for node in graph.nodes.values():
        row = node.row
        out.append(f'Begin Object Class=/Script/BlueprintGraph.{CLASSES[row["kind"]]} Name="{number(graph, node)}"')
        out += [f"   {line}" for line in head(graph, node)]
        out += [f"   NodePosX={node.x * 16}", f"   NodePosY={node.y * 16}", f"   NodeGuid={identity(graph.name, node.id)}"]
        out += [pin_line(graph, node, pin, links) for pin in row["pins"]]
        if row["kind"] == "custom":
            out += [user_pin(pin) for pin in row["pins"] if pin["type"] != "exec"]
        out.append("End Object")
    for index, box in enumerate(graph.comments):
        out += [f'Begin Object Class=/Script/UnrealEd.EdGraphNode_Comment Name="EdGraphNode_Comment_{index}"',
                f"   NodePosX={box.x * 16}", f"   NodePosY={box.y * 16}", f"   NodeWidth={box.w * 16}", f"   NodeHeight={box.h * 16}",
                f'   NodeComment="{box.text}"', f"   NodeGuid={identity(graph.name, 'comment', str(index))}", "End Object"]
    return "\n".join(out) + "\n"


BLOCK = re.compile(r'^Begin Object Class=(\S+) Name="(\w+)"\n(.*?)^End Object$', re.M | re.S)
PIN = re.compile(r'CustomProperties Pin \(PinId=(\w+),PinName="([^"]*)"(.*)\)$', re.M)


def events_faults(text: str, catalogue: Catalogue) -> list[str]:
    """What a component's event lacks of that which has it called."""
    rows = {(row["class"][1:], row["function"]): row for rows in catalogue.nodes.values() for row in rows if row["kind"] == "event"}
    found, given = [], []
    for class_, name, body in BLOCK.findall(text):
        if not class_.endswith(CLASSES["event"]):
            continue
        fields = dict(re.findall(r"^ *(\w+)=(.*)$", body, re.M))
        owner = re.search(r"\.(\w+)'\"$", fields.get("DelegateOwnerClass", ""))
        row = rows.get((owner.group(1) if owner else "", fields.get("DelegatePropertyName", "").strip('"')))
        if row is None:
            found.append(f"{name}: no component of the plugin has such an event")
            continue
        if fields.get("EventReference") != f'(MemberParent="{PACKAGE}",MemberName="{signature(row)}")':
            found.append(f"{name}: its EventReference is not {signature(row)}")
        function = fields.get("CustomFunctionName", "")
        if not function.startswith('"BndEvt__') or function in given:
            found.append(f"{name}: it has no CustomFunctionName of its own")
        given.append(function)
    return found


def faults(text: str, catalogue: Catalogue) -> list[str]:
    """What does not fit in pasteable text: functions, pins and types that no header has, links with one end only."""
    found, pins, asked = events_faults(text, catalogue), {}, []
    rows = {(row["class"], row["function"]): row for rows in catalogue.nodes.values() for row in rows}
    for class_, name, body in BLOCK.findall(text):
        for parent, member in re.findall(r"FunctionReference=\(MemberParent=\"[^']*'/Script/Consac\.(\w+)'\",MemberName=\"(\w+)\"", body):
            row = rows.get(("U" + parent, member)) or rows.get(("A" + parent, member))
            if row is None:
                found.append(f"{name}: no node of the plugin calls {parent}::{member}")
            else:
                known = {p["pin"] for p in row["pins"]}
                found += [f"{name}: {member} has no pin '{pin}'" for _, pin, _ in PIN.findall(body) if pin not in known]
        found += [f"{name}: there is no type {type_}" for type_ in re.findall(r"'/Script/Consac\.(\w+)'", body)
                  if not any(prefix + type_ in catalogue.types for prefix in ("U", "A", "F", ""))]
        for id_, pin, rest in PIN.findall(body):
            pins[name, id_] = pin
            linked = re.search(r"LinkedTo=\((.*?)\)", rest)
            asked += [((name, id_), tuple(end.split())) for end in (linked.group(1).split(",") if linked else []) if end]
    for end, other in asked:
        if other not in pins:
            found.append(f"{end[0]}: {pins[end]} is linked to a pin that is not there")
        elif (other, end) not in asked:
            found.append(f"{end[0]}: the link of {pins[end]} has one end only")
    return found
