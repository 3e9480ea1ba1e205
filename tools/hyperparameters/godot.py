"""Godot resources: for each algorithm a script with an exported property for each hyperparameter."""
import math
import textwrap

from .table import Algorithm, Row, pascal
from .unreal import bound, real

HEAD = "# Written by tools/generate_hyperparameters.py from the program's own table; do not edit.\n"
BASE = f'''{HEAD}class_name ConsacHyperparameters
extends Resource
## What every algorithm's hyperparameters have in common.


## The algorithm that they belong to.
func algorithm() -> String:
	return ""


## Name to value, both as the program [code]consac[/code] reads them.
func collect() -> Dictionary:
	return {{}}


## A number, or "lin_" and a number that goes down to nothing over the training.
static func schedule_text(value: float, linear: bool) -> String:
	return ("lin_" if linear else "") + var_to_str(value)
'''


def range_of(row: Row) -> str:
    """The annotation of a number."""
    if math.isinf(row.low):
        return "@export"
    step = ", 1" if row.kind == "integer" else ", 1e-8"
    write = bound if row.kind == "integer" else (lambda value: real(bound(value)))
    if math.isinf(row.high):
        return f'@export_range({write(row.low)}, {write(max(1.0, row.low + 1.0))}{step}, "or_greater")'
    return f"@export_range({write(row.low)}, {write(row.high)}{step})"


def default(row: Row) -> str:
    if row.kind == "boolean":
        return row.default
    if row.kind in ("choice", "text"):
        return f'"{row.default}"'
    if row.kind == "integer":
        return str(int(float(row.default))) if row.default != "none" else bound(max(row.low, 0))
    return real(row.default.removeprefix("lin_"))


TYPES = {"boolean": "bool", "integer": "int", "real": "float", "schedule": "float", "choice": "String", "text": "String"}


def describe(text: str) -> str:
    return "".join(f"## {line}\n" for line in textwrap.wrap(text, 95))


def declaration(row: Row) -> str:
    out = ""
    if row.optional:
        out += describe(f"Whether [member {row.name}] is set at all.")
        out += f"@export var set_{row.name}: bool = {'false' if row.default == 'none' else 'true'}\n"
    if row.kind == "choice":
        annotation = f"@export_enum({', '.join(f'{chr(34)}{choice}{chr(34)}' for choice in row.choices)})"
    else:
        annotation = range_of(row) if row.kind in ("integer", "real", "schedule") else "@export"
    out += describe(row.tooltip)
    out += f"{annotation} var {row.name}: {TYPES[row.kind]} = {default(row)}\n"
    if row.kind == "schedule":
        out += describe(f"[member {row.name}] times the part of the training that is left: 1 at its start, 0 at its end.")
        out += f"@export var {row.name}_linear: bool = {'true' if row.default.startswith('lin_') else 'false'}\n"
    return out


def text_of(row: Row) -> str:
    texts = {"boolean": f'"true" if {row.name} else "false"', "integer": f"str({row.name})", "real": f"var_to_str({row.name})",
             "schedule": f"schedule_text({row.name}, {row.name}_linear)", "choice": row.name, "text": row.name}
    return texts[row.kind] + (f' if set_{row.name} else "none"' if row.optional else "")


def file_name(algorithm: Algorithm) -> str:
    return f"consac_{algorithm.name.replace('-', '_')}_hyperparameters.gd"


def script(algorithm: Algorithm) -> str:
    what = algorithm.what[0].upper() + algorithm.what[1:]
    out = f"{HEAD}class_name Consac{pascal(algorithm.name)}Hyperparameters\nextends ConsacHyperparameters\n{describe(what + '.')}\n"
    out += "\n".join(declaration(row) for row in algorithm.rows)
    out += f'\n\nfunc algorithm() -> String:\n\treturn "{algorithm.name}"\n\n\nfunc collect() -> Dictionary:\n\treturn {{\n'
    return out + "".join(f'\t\t"{row.name}": {text_of(row)},\n' for row in algorithm.rows) + "\t}\n"
