@icon("res://addons/consac/icon.svg")
class_name ConsacGridSensor2D
extends ConsacGridSensor
## A grid around a Node2D: ahead is its x axis, to the right its y axis.

## What the grid lies around; not seen itself.
@export var origin: Node2D

var _shape := RectangleShape2D.new()
var _query := PhysicsShapeQueryParameters2D.new()


func _point(at: Vector2) -> Variant:
	var point := Vector2(at.y, at.x)
	return point if turned else point.rotated(-origin.global_rotation)


func _set_up() -> void:
	_shape.size = Vector2.ONE * cell_size * 0.98
	_query.shape = _shape
	_query.collision_mask = collision_mask
	_query.collide_with_areas = hit_areas
	if origin is CollisionObject2D:
		_query.exclude = [(origin as CollisionObject2D).get_rid()]


func _in_cell(at: Vector2) -> Array[Dictionary]:
	var turn := origin.global_rotation if turned else 0.0
	_query.transform = Transform2D(turn, origin.global_position + Vector2(at.y, at.x).rotated(turn))
	return origin.get_world_2d().direct_space_state.intersect_shape(_query, MOST_AT_ONCE)
