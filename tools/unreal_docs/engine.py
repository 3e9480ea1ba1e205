"""The engine's own nodes that the example graphs use. Names as the editor's; tests compare functions with a stub of the
engine's Python interface."""

ACTOR = "/Script/Engine.Actor"
BY_NAME = {
    "Event Begin Play": {"kind": "override", "class": ACTOR, "function": "ReceiveBeginPlay", "pins": [("then", "out", "exec", "")]},
    "Event Tick": {"kind": "override", "class": ACTOR, "function": "ReceiveTick",
                   "pins": [("then", "out", "exec", ""), ("DeltaSeconds", "out", "float", "")]},
    "Event End Play": {"kind": "override", "class": ACTOR, "function": "ReceiveEndPlay", "pins": [("then", "out", "exec", "")]},
    "Print String": {"kind": "function", "class": "/Script/Engine.KismetSystemLibrary", "function": "PrintString", "static": True,
                     "pins": [("execute", "in", "exec", ""), ("InString", "in", "string", "Hello"), ("then", "out", "exec", "")]},
    "Branch": {"kind": "branch", "class": "", "function": "",
               "pins": [("execute", "in", "exec", ""), ("Condition", "in", "bool", "true"), ("then", "out", "exec", ""),
                        ("else", "out", "exec", "")]},
    "Less Equal": {"kind": "pure", "class": "/Script/Engine.KismetMathLibrary", "function": "LessEqual_IntInt", "static": True,
                   "pins": [("A", "in", "int", "0"), ("B", "in", "int", "0"), ("ReturnValue", "out", "bool", "")]},
}
LABELS = {("Branch", "then"): "True", ("Branch", "else"): "False"}


def node(name: str) -> dict:
    """An engine's node in the form of the node table."""
    found = BY_NAME[name]
    pins = [{"pin": pin, "way": way, "type": type_} | ({"default": default} if default else {}) for pin, way, type_, default in found["pins"]]
    for pin in pins:
        if (name, pin["pin"]) in LABELS:
            pin["label"] = LABELS[name, pin["pin"]]
    return {"node": name, "kind": found["kind"], "class": found["class"], "function": found["function"],
            "static": found.get("static", False), "pins": pins}
