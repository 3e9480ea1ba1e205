class_name ConsacGridSensor
extends ConsacSensor
## What stands in which cell of a grid around a node, as a map: for each of [member classes] a layer of
## [member cells], row by row from far left to near right, 1 where a body of that group is in the cell. Use
## [ConsacGridSensor2D] or [ConsacGridSensor3D].

## Cells across and ahead.
@export var cells := Vector2i(9, 9)
## Side of a cell.
@export_range(0.001, 1e6) var cell_size: float = 1.0
## Groups that are told apart, a layer each.
@export var classes: Array[StringName] = []
## The grid turns with the node; false: it lies along the world's axes.
@export var turned: bool = true
## Physics layers that are seen.
@export_flags_3d_physics var collision_mask: int = 0xffffffff
## Areas are seen, too.
@export var hit_areas: bool = false

const MOST_AT_ONCE := 16  # bodies in a cell
const FULL := Color(1.0, 0.8, 0.2, 0.9)
const EMPTY := Color(0.6, 0.9, 1.0, 0.2)

var _map := PackedFloat32Array()


func fault() -> String:
	if place() == null:
		return "set origin to the node that the grid lies around"
	if classes.is_empty():
		return "add the groups that the grid tells apart to classes"
	return "" if cells.x > 0 and cells.y > 0 else "cells is %s, expected at least one each way" % cells


func entries() -> Array[ConsacEntry]:
	return [ConsacEntry.box(entry_name, classes.size() * cells.x * cells.y, 0.0, 1.0)]


func sense(into: Dictionary) -> void:
	var layer := cells.x * cells.y
	_map = PackedFloat32Array()
	_map.resize(classes.size() * layer)
	_set_up()
	for cell in layer:
		for hit: Dictionary in _in_cell(middle_of(cell)):
			var body := hit.get("collider") as Node
			for i in classes.size():
				if body != null and body.is_in_group(classes[i]):
					_map[i * layer + cell] = 1.0
	into[entry_name] = _map


## The middle of cell [param index] as the node sees it: x to the right, y ahead.
func middle_of(index: int) -> Vector2:
	var across := index % cells.x - (cells.x - 1) / 2.0
	var ahead := (cells.y - 1) / 2.0 - index / cells.x
	return Vector2(across, ahead) * cell_size


func place() -> Node:
	return get(&"origin")


func lines() -> Array:
	var all := []
	var layer := cells.x * cells.y
	if _map.size() < layer:
		return all
	for cell in layer:
		var full := false
		for i in classes.size():
			full = full or _map[i * layer + cell] > 0.0
		var at := middle_of(cell)
		var half := cell_size * 0.46
		var corners := [Vector2(-half, -half), Vector2(half, -half), Vector2(half, half), Vector2(-half, half)]
		for i in 4:
			all.append_array([_point(at + corners[i]), _point(at + corners[(i + 1) % 4]), FULL if full else EMPTY])
	return all


# Override: a point of the grid as the node sees it.
func _point(_at: Vector2) -> Variant:
	return Vector2.ZERO


# Override: makes the query ready, whose place alone differs from cell to cell.
func _set_up() -> void:
	pass


# Override: the hits of intersect_shape in the cell around this point of the grid.
func _in_cell(_at: Vector2) -> Array[Dictionary]:
	return []
