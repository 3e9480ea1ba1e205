"""docs/unreal-nodes.md from the node table."""
from .nodes import display

INTRO = """# The nodes of the Unreal plugin

Every Blueprint node of the plugin with its pins, every property that the Details panel shows, and every type. Written by
`tools/unreal_docs.py` from the plugin's headers; [unreal.md](unreal.md) shows how they go together.

`Failed` pins give an `Error` in words, and the log has the same line. A pin in *italics* must have a wire. The
hyperparameters of every algorithm are data assets with the names of `consac list hyperparameters ALGORITHM`.
"""


def wording(type_: str) -> str:
    """A pin's type for people."""
    array = type_.endswith("[]")
    base = type_.removesuffix("[]")
    name = base if base[:1].islower() else display(base[1:])
    return f"list of {name}" if array else name


def cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def pin_text(pin: dict) -> str:
    name = {"self": "Target", "ReturnValue": "Return Value"}.get(pin["pin"], display(pin["pin"]))
    shown = f"*{name}*" if pin.get("must_link") or pin["pin"] == "self" else name
    if pin["type"] != "exec":
        shown += f" ({wording(pin['type'])}{' = ' + pin['default'] if pin.get('default') else ''})"
    return shown + (f": {pin['says'].rstrip('.')}" if pin.get("says") and pin["pin"] != "self" else "")


def node_section(row: dict) -> str:
    kinds = {"pure": "value only", "event": "event", "async": "waits without holding up the game", "function": ""}
    owner = "" if row["static"] else f" on {display(row['class'][1:])}"
    about = ", ".join(part for part in (kinds[row["kind"]], f"`{row['class']}::{row['function']}`") if part)
    out = f"### {row['node']}{owner if row['kind'] == 'event' else ''}\n\n{row['tooltip']}\n\n"
    for way in ("in", "out"):
        pins = [pin_text(p) for p in row["pins"] if p["way"] == way and not p.get("hidden") and p["pin"] not in ("execute", "then")]
        if pins:
            out += f"- {way}: " + "; ".join(cell(p) for p in pins) + "\n"
    return out + f"- {about}\n\n"


def markdown(table: dict) -> str:
    out = INTRO
    categories: dict[str, list[dict]] = {}
    for row in table["nodes"]:
        categories.setdefault(row["category"], []).append(row)
    for category, rows in sorted(categories.items()):
        out += f"\n## {category.replace('|', ' > ')}\n\n" + "".join(node_section(row) for row in rows)
    out = out.rstrip("\n") + "\n\n## Properties\n"
    for type_ in table["types"]:
        rows = [row for row in table["properties"] if row["class"] == type_["type"]]
        if rows:
            out += f"\n### {display(type_['type'][1:])}\n\n{type_['tooltip']}\n\n| property | type | default | what |\n|---|---|---|---|\n"
            for row in rows:
                limits = " to ".join(filter(None, (row.get("ClampMin"), row.get("ClampMax"))))
                kind = wording(row["type"]) + (f", {limits}" if "ClampMax" in row and "ClampMin" in row else f", from {limits}" if limits else "")
                out += f"| {row['property']} | {kind} | {cell(row['default'])} | {cell(row['tooltip'])} |\n"
    out += "\n## Choices\n\n| type | value | what |\n|---|---|---|\n"
    for type_ in table["types"]:
        if type_["header"] != "ConsacHyperparameters.h":
            out += "".join(f"| {display(type_['type'][1:])} | {display(v['value'])} | {cell(v['says'])} |\n" for v in type_.get("values", []))
    return out
