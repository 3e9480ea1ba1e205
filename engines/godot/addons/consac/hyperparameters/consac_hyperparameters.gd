# Written by tools/generate_hyperparameters.py from the program's own table; do not edit.
class_name ConsacHyperparameters
extends Resource
## What every algorithm's hyperparameters have in common.


## The algorithm that they belong to.
func algorithm() -> String:
	return ""


## Name to value, both as the program [code]consac[/code] reads them.
func collect() -> Dictionary:
	return {}


## A number, or "lin_" and a number that goes down to nothing over the training.
static func schedule_text(value: float, linear: bool) -> String:
	return ("lin_" if linear else "") + var_to_str(value)
