@icon("res://addons/consac/icon.svg")
class_name ConsacSensor
extends Node
## Something that observes for the [ConsacAgent] above it. Extend it for a sensor of your own.

## Under which its entry stands; no two of an agent share one.
@export var entry_name: StringName = &"sensor"
## Shows in the running game what it senses, where it knows how (rays, grids). Debug > Visible Collision Shapes does so
## for all sensors.
@export var drawn: bool = false


## Override: what to draw with [member drawn], as lines: from, to (both as the sensor's node sees them) and a colour, one
## after the other.
func lines() -> Array:
	return []


## Called by [ConsacAgent] once the sensor is complete: begins to draw around [param node].
func begin_drawing(node: Node) -> void:
	if DisplayServer.get_name() == "headless" or not (drawn or node.get_tree().debug_collisions_hint):
		return
	var drawing: Node = ConsacSensorDrawing2D.new() if node is Node2D else ConsacSensorDrawing3D.new()
	drawing.sensor = self
	node.add_child(drawing, false, Node.INTERNAL_MODE_BACK)


## Override: what is missing for it to observe, in one sentence, or "". Asked before [method entries].
func fault() -> String:
	return ""


## Override: what it adds to the agent's observations. Asked once, before the first episode.
func entries() -> Array[ConsacEntry]:
	return []


## Override: the node that it senses around, for drawing; null where there is none.
func place() -> Node:
	return null


## Override: put one value into [param into] for each of [method entries].
func sense(_into: Dictionary) -> void:
	pass
