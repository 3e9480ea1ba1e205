@icon("res://addons/consac/icon.svg")
class_name ConsacSensor
extends Node
## Something that observes for the [ConsacAgent] above it. Extend it for a sensor of your own.

## Under which its entry stands; no two of an agent share one.
@export var entry_name: StringName = &"sensor"


## Override: what it adds to the agent's observations. Asked once, before the first episode.
func entries() -> Array[ConsacEntry]:
	return []


## Override: put one value into [param into] for each of [method entries].
func sense(_into: Dictionary) -> void:
	pass
