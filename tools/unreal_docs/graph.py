"""Example graphs: a readable text (engines/unreal/graphs/*.graph), checked against the node table.

  title TEXT                     about TEXT (several lines)      name of the picture and what it shows
  component NAME CLASS           variable NAME TYPE              what the Blueprint must have
  event NAME [PIN TYPE]...                                       a custom event of the Blueprint
  node ID at X Y WHAT            in units of the editor's grid; WHAT is a node's name, or
                                 get NAME, set NAME, break STRUCT, event NAME, call NAME, on COMPONENT: EVENT
    PIN VALUE                    indented: what stands in an unconnected pin
  comment at X Y W H TEXT
  A.PIN -> B.PIN                 a link; '.then', '.execute' and an only output may be left out
"""
import re
from dataclasses import dataclass, field

from . import engine


@dataclass
class Node:
    id: str
    x: int
    y: int
    what: str
    line: int
    row: dict  # as in the node table
    values: dict[str, str] = field(default_factory=dict)

    def pin(self, name: str, way: str | None = None) -> dict | None:
        return next((p for p in self.row["pins"] if p["pin"] == name and way in (None, p["way"])), None)


@dataclass
class Link:
    source: Node
    out: str
    target: Node
    into: str
    line: int


@dataclass
class Comment:
    x: int
    y: int
    w: int
    h: int
    text: str


@dataclass
class Graph:
    name: str
    title: str = ""
    about: str = ""
    components: dict[str, str] = field(default_factory=dict)
    variables: dict[str, str] = field(default_factory=dict)
    events: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    nodes: dict[str, Node] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    comments: list[Comment] = field(default_factory=list)
    faults: list[tuple[int, str]] = field(default_factory=list)


class Catalogue:
    """The node table, looked up by name."""

    def __init__(self, table: dict):
        self.nodes: dict[str, list[dict]] = {}
        for row in table["nodes"]:
            self.nodes.setdefault(row["node"], []).append(row)
        self.types = {row["type"]: row for row in table["types"]}
        self.members: dict[str, list[dict]] = {}
        for row in table["properties"]:
            self.members.setdefault(row["class"], []).append(row)

    def knows(self, type_: str) -> bool:
        plain = ("exec", "bool", "byte", "int", "int64", "float", "double", "string", "name", "text", "UObject", "AActor", "FVector")
        return type_.removesuffix("[]") in plain or type_.removesuffix("[]") in self.types

    def fits(self, source: str, target: str) -> bool:
        """Whether a wire may join the two types."""
        if source == target or {source, target} == {"float", "double"}:
            return True
        while source in self.types and source[:1] in "UA":
            source = self.types[source]["base"]
            if source == target:
                return True
        return target == "UObject" and source[:1] in "UA"

    def values_of(self, enum: str) -> list[str]:
        return [v["value"] for v in self.types.get(enum, {}).get("values", [])]

    def find(self, graph: Graph, what: str) -> dict | str:
        """The row of what a node is, or what is wrong with it."""
        word, _, rest = what.partition(" ")
        if word in ("get", "set") and (rest in graph.variables or rest in graph.components):
            return self._variable(word, rest, graph.variables.get(rest) or graph.components[rest])
        if word in ("get", "set"):
            return f"there is no variable or component '{rest}'"
        if word == "break":
            return self._break(rest)
        if word in ("event", "call"):
            return self._own(graph, word, rest)
        if word == "on":
            return self._bound(graph, rest)
        if what in engine.BY_NAME:
            return engine.node(what)
        found = [row for row in self.nodes.get(what, []) if row["kind"] != "event"]
        if len(found) != 1:
            return f"{len(found)} nodes are called '{what}' in the node table"
        return found[0]

    @staticmethod
    def _variable(word: str, name: str, type_: str) -> dict:
        if word == "get":
            pins = [{"pin": name, "way": "out", "type": type_}]
        else:
            pins = [{"pin": "execute", "way": "in", "type": "exec"}, {"pin": name, "way": "in", "type": type_},
                    {"pin": "then", "way": "out", "type": "exec"}, {"pin": "Output_Get", "way": "out", "type": type_, "label": " "}]
        return {"node": f"{word.capitalize()} {name}", "kind": word, "class": "", "function": name, "static": False, "pins": pins}

    def _break(self, struct: str) -> dict | str:
        if struct not in self.types or self.types[struct]["kind"] != "USTRUCT":
            return f"there is no struct '{struct}' in the node table"
        pins = [{"pin": struct[1:], "way": "in", "type": struct}]
        pins += [{"pin": row["name"], "way": "out", "type": row["type"]} for row in self.members.get(struct, [])]
        title = "Break " + re.sub(r"(?<=[a-z])(?=[A-Z])", " ", struct[1:])
        return {"node": title, "kind": "break", "class": struct, "function": "", "static": True, "pins": pins}

    @staticmethod
    def _own(graph: Graph, word: str, name: str) -> dict | str:
        if name not in graph.events:
            return f"there is no event '{name}'; declare it by 'event {name}'"
        way = "out" if word == "event" else "in"
        pins = [{"pin": "execute", "way": "in", "type": "exec"}] if word == "call" else []
        pins += [{"pin": "then", "way": "out", "type": "exec"}]
        pins += [{"pin": pin, "way": way, "type": type_} for pin, type_ in graph.events[name]]
        title = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
        return {"node": title, "kind": "custom" if word == "event" else "own", "class": "", "function": name, "static": False, "pins": pins}

    def _bound(self, graph: Graph, rest: str) -> dict | str:
        component, _, event = rest.partition(": ")
        if component not in graph.components:
            return f"there is no component '{component}'"
        class_ = graph.components[component]
        row = next((r for r in self.nodes.get(event, []) if r["kind"] == "event" and r["class"] == class_), None)
        return row | {"component": component} if row else f"{class_} has no event '{event}' in the node table"


HEAD = re.compile(r"(\w+) at (-?\d+) (-?\d+) (.+)")
BOX = re.compile(r"at (-?\d+) (-?\d+) (\d+) (\d+) (.+)")
LINK = re.compile(r"(\w+)(?:\.(\w+))? -> (\w+)(?:\.(\w+))?")


def read(name: str, text: str, catalogue: Catalogue) -> Graph:
    """A graph; what is wrong with it stands in its faults."""
    graph = Graph(name)
    links, node = [], None
    for number, line in enumerate(text.split("\n"), 1):
        word, _, rest = line.strip().partition(" ")
        if not word or word.startswith("#"):
            continue
        if line[0] == " ":
            if node is None:
                graph.faults.append((number, "a pin's value stands below its node"))
            else:
                node.values[word] = rest
        elif " -> " in line:
            links.append((number, line.strip()))
        else:
            node = _line(graph, catalogue, number, word, rest)
    for number, line in links:
        _link(graph, catalogue, number, line)
    _check(graph, catalogue)
    return graph


def _line(graph: Graph, catalogue: Catalogue, number: int, word: str, rest: str) -> Node | None:
    if word == "title":
        graph.title = rest
    elif word == "about":
        graph.about = f"{graph.about} {rest}".strip()
    elif word in ("component", "variable"):
        name, _, type_ = rest.partition(" ")
        (graph.components if word == "component" else graph.variables)[name] = type_
        if not catalogue.knows(type_):
            graph.faults.append((number, f"{name}: there is no type '{type_}' in the node table"))
    elif word == "event":
        name, *pins = rest.split()
        graph.events[name] = list(zip(pins[::2], pins[1::2]))
    elif word == "comment" and BOX.fullmatch(rest):
        x, y, w, h, text = BOX.fullmatch(rest).groups()
        graph.comments.append(Comment(int(x), int(y), int(w), int(h), text))
    elif word == "node" and HEAD.fullmatch(rest):
        id_, x, y, what = HEAD.fullmatch(rest).groups()
        row = catalogue.find(graph, what)
        if isinstance(row, str):
            graph.faults.append((number, row))
        elif id_ in graph.nodes:
            graph.faults.append((number, f"node '{id_}' is there twice"))
        else:
            graph.nodes[id_] = Node(id_, int(x), int(y), what, number, row)
            return graph.nodes[id_]
    else:
        graph.faults.append((number, f"cannot read '{word} {rest}'"))
    return None


def _link(graph: Graph, catalogue: Catalogue, number: int, line: str) -> None:
    found = LINK.fullmatch(line)
    if not found:
        graph.faults.append((number, f"cannot read the link '{line}'"))
        return
    source_id, out, target_id, into = found.groups()
    ends = [graph.nodes.get(source_id), graph.nodes.get(target_id)]
    if None in ends:
        graph.faults.append((number, f"there is no node '{source_id if ends[0] is None else target_id}'"))
        return
    source, target = ends
    into = into or "execute"
    target_pin = target.pin(into, "in")
    if out is None:
        data = [p["pin"] for p in source.row["pins"] if p["way"] == "out" and p["type"] != "exec"]
        out = data[0] if into != "execute" and len(data) == 1 else "then"
    source_pin = source.pin(out, "out")
    if source_pin is None or target_pin is None:
        node, pin, way = (source, out, "output") if source_pin is None else (target, into, "input")
        graph.faults.append((number, f"'{node.row['node']}' has no {way} pin '{pin}'"))
    elif not catalogue.fits(source_pin["type"], target_pin["type"]):
        graph.faults.append((number, f"{out} is {source_pin['type']}, {into} of '{target.row['node']}' is {target_pin['type']}"))
    else:
        graph.links.append(Link(source, out, target, into, number))


VALUES = {"int": r"-?\d+", "int64": r"-?\d+", "byte": r"\d+", "bool": r"true|false", "float": r"-?\d+(\.\d+)?", "double": r"-?\d+(\.\d+)?",
          "string": r".*", "name": r"\w+", "text": r".*"}


def _check(graph: Graph, catalogue: Catalogue) -> None:
    """Values of pins, how many wires a pin takes, and pins that must not stay empty."""
    taken: dict[tuple[str, str, str], int] = {}
    for link in graph.links:
        exec_ = link.source.pin(link.out, "out")["type"] == "exec"
        key = ("out", link.source.id, link.out) if exec_ else ("in", link.target.id, link.into)
        if key in taken:
            graph.faults.append((link.line, f"the pin {key[2]} of '{key[1]}' has two wires; it takes one"))
        taken[key] = link.line
    linked = {(link.target.id, link.into) for link in graph.links} | {(link.source.id, link.out) for link in graph.links}
    for node in graph.nodes.values():
        for name, value in node.values.items():
            pin = node.pin(name, "in")
            allowed = catalogue.values_of(pin["type"]) if pin else []
            if pin is None:
                graph.faults.append((node.line, f"'{node.row['node']}' has no input pin '{name}'"))
            elif (node.id, name) in linked:
                graph.faults.append((node.line, f"{name} of '{node.id}' has a wire and a value"))
            elif value not in allowed if allowed else not re.fullmatch(VALUES.get(pin["type"], r"(?!)"), value):
                graph.faults.append((node.line, f"'{value}' is no {pin['type']} for {name} of '{node.row['node']}'"))
        for pin in node.row["pins"]:
            target = pin["pin"] == "self" or pin["type"][:1] in "UA" and not pin.get("hidden")
            if pin["way"] == "in" and (pin.get("must_link") or target) and (node.id, pin["pin"]) not in linked:
                graph.faults.append((node.line, f"{pin['pin']} of '{node.row['node']}' needs a wire"))
        if not any(node.id in (link.source.id, link.target.id) for link in graph.links) and node.row["kind"] != "custom":
            graph.faults.append((node.line, f"'{node.id}' has no wire at all"))
