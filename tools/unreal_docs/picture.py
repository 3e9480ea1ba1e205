"""A graph as an SVG that looks as the editor draws it: cards with a coloured head, white wires for the order in which
things happen, coloured ones for values. Text widths are estimated, so cards are a little wider than they need be."""
from html import escape

from .graph import Comment, Graph, Link, Node
from .nodes import display

GRID, ROW, HEAD, PAD = 16, 22, 28, 12
FONT = "font-family=\"'Segoe UI', Roboto, 'Helvetica Neue', 'DejaVu Sans', Arial, sans-serif\""
COLOURS = {"exec": "#ffffff", "bool": "#b01010", "byte": "#0a8074", "int": "#1fe0b0", "int64": "#a8e08c", "float": "#9bf04a",
           "double": "#9bf04a", "string": "#ff3ad0", "name": "#c98aff", "text": "#e57ca8"}
HEADS = {"function": "#2a6ea6", "own": "#2a6ea6", "pure": "#3f8a4a", "break": "#2f5fa0", "async": "#2a6ea6", "event": "#9c1f1f",
         "override": "#9c1f1f", "custom": "#9c1f1f", "branch": "#6b6f76", "set": "#3a5a48", "get": ""}


def colour(type_: str) -> str:
    type_ = type_.removesuffix("[]")
    if type_ in COLOURS:
        return COLOURS[type_]
    return {"E": "#0a8074", "F": "#3f7fe8"}.get(type_[:1], "#29a9f5")


def width_of(text: str, size: float) -> float:
    """About how wide a text is."""
    narrow, wide = "iljtfr.,:;'|!() ", "mwMWQO@%"
    return sum(0.34 if c in narrow else 0.88 if c in wide else 0.68 if c.isupper() else 0.58 for c in text) * size


def label(node: Node, pin: dict) -> str:
    """What stands beside a pin; exec pins in and out have none, as in the editor."""
    if "label" in pin:
        return pin["label"].strip()
    if pin["pin"] in ("execute", "then") or node.row["kind"] == "get":
        return ""
    return {"self": "Target", "ReturnValue": "Return Value"}.get(pin["pin"], display(pin["pin"]))


class Card:
    """A node with the places of its pins."""

    def __init__(self, node: Node, linked: set):
        self.node, self.linked = node, linked
        self.x = node.x * GRID
        shown = [p for p in node.row["pins"] if self.shows(p)]
        self.left = [p for p in shown if p["way"] == "in"]
        self.right = [p for p in shown if p["way"] == "out"]
        self.pill = node.row["kind"] == "get"
        self.subtitle = self._subtitle()
        self.head = 0 if self.pill else HEAD + (14 if self.subtitle else 0)
        # A head without a second line sits lower, so that the exec pins of a row stand in one line.
        lower = 14 if self.head == HEAD and any(p["type"] == "exec" for p in shown) else 0
        self.y = node.y * GRID + lower
        rows = max(len(self.left), len(self.right), 1)
        self.h = 30 if self.pill else self.head + rows * ROW + 10
        self.w = self._width()

    def shows(self, pin: dict) -> bool:
        key = (self.node.id, pin["pin"])
        return not pin.get("hidden") and (not pin.get("advanced") or key in self.linked or pin["pin"] in self.node.values)

    def _subtitle(self) -> str:
        row = self.node.row
        if row["kind"] == "event":
            return f"on {row['component']}"
        if row["kind"] == "custom":
            return "Custom Event"
        if row["kind"] in ("function", "own", "async") and not row["static"] and row["class"]:
            return "Target is " + display(row["class"][1:])
        return ""

    def value(self, pin: dict) -> str | None:
        """What stands in an unconnected pin's box; None where there is no box."""
        if (self.node.id, pin["pin"]) in self.linked or pin["type"] == "exec" or pin["type"][-1] == "]" or pin["type"][:1] in "UAF":
            return None
        empty = {"int": "0", "int64": "0", "float": "0.0", "bool": "false", "byte": "0"}.get(pin["type"], "")
        return self.node.values.get(pin["pin"], pin.get("default", empty))

    def _side(self, pin: dict) -> float:
        value, text = self.value(pin), label(self.node, pin)
        box = 0 if value is None or pin["way"] == "out" else 22 if pin["type"] == "bool" else max(26.0, width_of(value, 11) + 14)
        return 22 + width_of(text, 12) + box

    def _width(self) -> float:
        if self.pill:
            return round(width_of(self.node.row["function"], 13) + 54)
        rows = max(len(self.left), len(self.right))
        sides = [(self._side(self.left[i]) if i < len(self.left) else 0) + (self._side(self.right[i]) if i < len(self.right) else 0)
                 for i in range(rows)]
        return round(max([width_of(self.node.row["node"], 13.5) * 1.06 + 50, width_of(self.subtitle, 10) + 44,
                          *[s + 2 * PAD + 10 for s in sides]]))

    def place(self, name: str, way: str) -> tuple[float, float]:
        """Where a wire begins or ends."""
        pins = self.left if way == "in" else self.right
        row = next(i for i, p in enumerate(pins) if p["pin"] == name)
        y = self.y + (15 if self.pill else self.head + 6 + row * ROW + ROW / 2)
        return (self.x + PAD if way == "in" else self.x + self.w - PAD), y

    def draw(self) -> str:
        kind = self.node.row["kind"]
        tint = HEADS[kind]
        radius = 15 if self.pill else 7
        out = "<g>" + rect(self.x, self.y, self.w, self.h, radius, "#121417", 'fill-opacity=".93" stroke="#050505" stroke-width="1.2"')
        if self.pill:
            pin = self.right[0]
            out += rect(self.x + 1, self.y + 1, self.w - 2, 13, 12, colour(pin["type"]), 'fill-opacity=".22"')
            out += text(self.x + 16, self.y + 20, display(self.node.row["function"]), 13, "#e8e8e8")
        else:
            out += (f'<path d="M{self.x} {self.y + self.head}v{7 - self.head}a7 7 0 0 1 7 -7h{self.w - 14}a7 7 0 0 1 7 7v{self.head - 7}z" '
                    f'fill="url(#{kind})"/>')
            out += rect(self.x + 11, self.y + 10, 9, 9, 2, tint, 'stroke="#fff" stroke-opacity=".75"')
            out += text(self.x + 28, self.y + 19, self.node.row["node"], 13.5, "#ffffff", weight=600)
            if self.subtitle:
                out += text(self.x + 28, self.y + 33, self.subtitle, 10, "#b9c2cc")
        for pins, way in ((self.left, "in"), (self.right, "out")):
            for pin in pins:
                out += self._pin(pin, way)
        return out + "</g>"

    def _pin(self, pin: dict, way: str) -> str:
        x, y = self.place(pin["pin"], way)
        linked = (self.node.id, pin["pin"]) in self.linked
        tint = colour(pin["type"])
        fill = tint if linked else "#121417"
        if pin["type"] == "exec":
            out = f'<path d="M{x - 6} {y - 6}h5l6 6l-6 6h-5z" fill="{fill}" stroke="{tint}" stroke-width="1.3" stroke-linejoin="round"/>'
        elif pin["type"].endswith("]"):
            out = "".join(f'<rect x="{x - 6 + 4.4 * i}" y="{y - 6 + 4.4 * j}" width="3.2" height="3.2" fill="{fill if (i, j) != (1, 1) else tint}" '
                          f'stroke="{tint}" stroke-width=".7"/>' for i in range(3) for j in range(3))
        else:
            out = f'<circle cx="{x}" cy="{y}" r="5" fill="{fill}" stroke="{tint}" stroke-width="1.8"/>'
        shown, name = label(self.node, pin), pin["pin"]
        if self.pill:
            return out
        if way == "out":
            return out + (text(x - 11, y + 4, shown, 12, "#dfe3e8", anchor="end") if shown else "")
        out += text(x + 11, y + 4, shown, 12, "#dfe3e8") if shown else ""
        value = self.value(pin)
        if value is not None:
            at = x + 17 + (width_of(shown, 12) if shown else 0)
            if pin["type"] == "bool":
                out += rect(at, y - 7, 14, 14, 3, "#0b0c0e", 'stroke="#5a6068"')
                out += f'<path d="M{at + 3} {y}l3 4l5 -8" fill="none" stroke="#e8e8e8" stroke-width="1.8"/>' if value == "true" else ""
            else:
                out += rect(at, y - 9, max(26, round(width_of(value, 11) + 12)), 18, 4, "#0b0c0e", 'stroke="#4a5058"')
                out += text(at + 6, y + 4, value, 11, "#c9ced6")
        return out


def rect(x: float, y: float, w: float, h: float, radius: float, fill: str, more: str = "") -> str:
    return f'<rect x="{x:g}" y="{y:g}" width="{w:g}" height="{h:g}" rx="{radius}" fill="{fill}" {more}/>'


def text(x: float, y: float, words: str, size: float, fill: str, anchor: str = "start", weight: int = 400) -> str:
    return f'<text x="{x:.0f}" y="{y:.0f}" font-size="{size}" fill="{fill}" text-anchor="{anchor}" font-weight="{weight}">{escape(words)}</text>'


def wire(link: Link, cards: dict[str, Card]) -> str:
    x0, y0 = cards[link.source.id].place(link.out, "out")
    x1, y1 = cards[link.target.id].place(link.into, "in")
    type_ = link.source.pin(link.out, "out")["type"]
    x0, x1 = x0 + 5, x1 - 6
    if x1 >= x0 - 20:
        bend = max(26.0, abs(x1 - x0) * 0.5) if abs(y1 - y0) > 3 or x1 < x0 else 0
        path = f"M{x0:.0f} {y0:.0f}C{x0 + bend:.0f} {y0:.0f} {x1 - bend:.0f} {y1:.0f} {x1:.0f} {y1:.0f}"
    else:  # back to an earlier node: below everything between the two
        low = max(card.y + card.h for card in cards.values() if x1 - 30 < card.x + card.w and card.x < x0 + 30) + 26
        path = (f"M{x0:.0f} {y0:.0f}h14q12 0 12 12V{low - 12:.0f}q0 12 -12 12H{x1 - 14:.0f}q-12 0 -12 -12V{y1 + 12:.0f}q0 -12 12 -12H{x1:.0f}")
    size = 2.6 if type_ == "exec" else 2.0
    return f'<path d="{path}" fill="none" stroke="{colour(type_)}" stroke-width="{size}" stroke-linecap="round"/>'


def comment(box: Comment) -> str:
    x, y, w, h = (v * GRID for v in (box.x, box.y, box.w, box.h))
    head = f'<path d="M{x} {y + 26}v-20a6 6 0 0 1 6 -6h{w - 12}a6 6 0 0 1 6 6v20z" fill="#ffffff" fill-opacity=".09"/>'
    return (rect(x, y, w, h, 6, "#ffffff", 'fill-opacity=".045" stroke="#ffffff" stroke-opacity=".16"') + head
            + text(x + 12, y + 18, box.text, 13, "#f0f0f0"))


def definitions() -> str:
    """The heads' colours, fading to the right, and the editor's grid."""
    out = "".join(f'<linearGradient id="{kind}"><stop offset="0" stop-color="{tint}"/>'
                  f'<stop offset="1" stop-color="{tint}" stop-opacity=".12"/></linearGradient>' for kind, tint in HEADS.items() if tint)
    for name, size, tint, width in (("fine", GRID, "#333", 0.6), ("coarse", 8 * GRID, "#161616", 1.4)):
        out += (f'<pattern id="{name}" width="{size}" height="{size}" patternUnits="userSpaceOnUse">'
                f'<path d="M{size} 0H0V{size}" fill="none" stroke="{tint}" stroke-width="{width}"/></pattern>')
    return out


def cards_of(graph: Graph) -> dict[str, Card]:
    linked = {(link.source.id, link.out) for link in graph.links} | {(link.target.id, link.into) for link in graph.links}
    return {id_: Card(node, linked) for id_, node in graph.nodes.items()}


def overlaps(graph: Graph) -> list[tuple[int, str]]:
    """(line, message) for each two nodes that cover each other."""
    cards = list(cards_of(graph).values())
    return [(b.node.line, f"'{a.node.id}' and '{b.node.id}' cover each other; move one")
            for i, a in enumerate(cards) for b in cards[i + 1:]
            if a.x < b.x + b.w and b.x < a.x + a.w and a.y < b.y + b.h and b.y < a.y + a.h]


def svg(graph: Graph) -> str:
    """The picture of a graph without faults."""
    cards = cards_of(graph)
    boxes = [(c.x, c.y, c.x + c.w, c.y + c.h) for c in cards.values()]
    boxes += [(c.x * GRID, c.y * GRID, (c.x + c.w) * GRID, (c.y + c.h) * GRID) for c in graph.comments]
    left, top = min(b[0] for b in boxes) - 32, min(b[1] for b in boxes) - 64
    w, h = max(b[2] for b in boxes) + 32 - left, max(b[3] for b in boxes) + 40 - top
    out = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{left:.0f} {top:.0f} {w:.0f} {h:.0f}" width="{w:.0f}" height="{h:.0f}" {FONT}>'
           f"<title>{escape(graph.title)}</title><desc>{escape(graph.about)}</desc>\n<defs>{definitions()}</defs>\n")
    out += "".join(rect(left, top, w, h, 10, fill) for fill in ("#262626", "url(#fine)", "url(#coarse)")) + "\n"
    out += text(left + 20, top + 32, graph.title, 18, "#f4f4f4", weight=600) + "\n"
    out += "\n".join([comment(c) for c in graph.comments] + [wire(link, cards) for link in graph.links] + [c.draw() for c in cards.values()])
    return out + "\n</svg>\n"
